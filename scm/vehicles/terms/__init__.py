"""Physical effects: one module, one effect, one pure scalar function and its facts as `TERM`.

A function's argument names are its wiring (`physics_variables.py`); a car uses an effect when its
file lists it. It is straight-line text, of `lane_math` where it needs more than arithmetic: no
if, no loop. May import math, `jit`, `param`, `physics_variables`, `term` and the curves beside this
folder; nothing else.
To add one: copy `rolling_resistance.py`, change the equation, run `pytest -k your_term`.
"""
