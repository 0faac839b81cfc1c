"""Sensors of a car: one file per kind, with `SENSOR` and `KEYS`. `Bank` adds their errors."""
