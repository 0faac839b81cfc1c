"""Calibration of a real car: drive a pattern, observe it with the Eye, identify its parameters.

pattern -> part (guards, record) -> recording -> fit -> car file
"""
