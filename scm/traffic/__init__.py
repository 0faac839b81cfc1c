"""Traffic signals: what a junction shows, and a second channel that doubts it.

`kernel.py` decides colours, `timing.py` and `program.py` derive its times and conflicts from the
map, `plans/` wish, `part.py` runs it. `monitor.py`, `card.py`, `monitor_part.py` are the second
channel: they share no code with the first. May import v2x, maps. To add a plan: one file in plans/.
"""
