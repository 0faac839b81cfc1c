"""The shared world: moves the cars it hosts, lets all collide, serves sensors and radio.

Start at `step.py`, one tick on one page; `world.py` is what is stepped, `part.py` ties it to a bus.
Every other file is one stage or one rule: `contacts` `sensing` `radio` `lease` `driving` `remote`.
May import vehicles, maps and messages; knows no bus, no camera, no page.
To answer one more request copy a function in `requests.py`.
"""
