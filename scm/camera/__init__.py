"""Cameras of cars."""
