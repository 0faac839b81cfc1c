"""Misbehaviour detection: checks of CAMs, their fusion into scores, and attacks to test them.

Each of `checks/` judges one claim, `fusion.py` adds them up; `detector.py` connects both.
`attacks/` turn honest CAMs into false ones. To add a check or an attack, copy a file there.
Only `part.py` and `attacker.py` know messages of the bus.
"""
