"""Sensors of a car: one kind a file, with `SENSOR`. They measure exactly; `Bank` spoils."""
