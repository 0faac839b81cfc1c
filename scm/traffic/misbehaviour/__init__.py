"""Who lies on the air: checks on what cars claim, what they add up to, and attacks to try them on.

`checks/` judge one claim each way and `fusion.py` remembers; `detector.py` ties them together.
`attacks/` turn honest CAMs into false ones. To add a check or an attack, copy a file there.
Nothing here knows a bus: the part is `scm/traffic/misbehaviour/part.py`.
"""
