"""Faults of measurement: one module, one fault, one pure law a channel and its facts as `MEASURE`.

A law's argument names are its wiring (`measure.py`): channels, parameters, `value`, `t`, `start`.
May import numpy, `arrays`, `measure` and `param`; nothing else.
To add one: copy `gyro_bias.py`, change the equation, run `pytest -k your_fault`.
"""
