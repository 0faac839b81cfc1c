"""Faults injected into a running city, and how long it takes until it is safe."""
