"""Calibration of a real car: drive a pattern, watch it with the Eye, fit what its car file lacks.

pattern -> part (guards, record) -> recording -> fit -> car file
"""
