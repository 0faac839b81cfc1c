"""Observation: traffic counts and violations, from cameras, cars' reports and signals."""
