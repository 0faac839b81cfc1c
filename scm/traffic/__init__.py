"""Traffic signals: what a junction shows, and a second channel that doubts it.

`kernel.py` decides colours and `proof.py` proves it; `timing.py`, `program.py` derive times and
conflicts from the map; `plans/` wish, `controller.py` runs them, `promise.py` tells ends, `part.py`
talks. `card.py`, `monitor.py`, `monitor_part.py` are the second channel and share no code with the
first. May import v2x, maps. To add a plan: one file in `plans/`.
"""
