"""Traffic signals: what a junction shows, and a second channel that doubts it.

`kernel.py` decides colours, `proof*.py` and `flood.py` prove it; `policies/` wish through
`rings.py` or the timetables of `plans/`; `controller.py` runs them and keeps promises,
`detectors.py` sees cars, `part.py` talks. `conflict_table.py`, `monitor.py`, `monitor_part.py` are
the second channel and share no code with the first. May import v2x, maps. To add a policy or
plan: one file.
"""
