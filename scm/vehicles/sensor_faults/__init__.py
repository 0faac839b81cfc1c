"""Sensor faults: each module has one pure function per channel and a `SENSOR_FAULT` constant.

Argument names are the wiring (`sensor_fault.py`): channels, parameters, `value`, `t`, `start`.
May import only numpy, `arrays`, `sensor_fault` and `param`.
To add one: copy `gyro_bias.py`, change the equation, run `pytest -k your_fault`.
"""
