"""The shared world: hosted cars, contacts of all cars, sensors and radio.

Start at `step.py`, one tick on one page; `world.py` and `cars.py` hold what is stepped, `part.py`
connects it to a bus. Every other file is one stage or one rule: `reception` `driving` `collide`
`watch` `sensing` `publish` `transmission`; `contacts` `radio` `lease` `remote`.
May import vehicles, maps and messages; knows no bus, no camera, no page.
To answer one more request copy a function in `requests.py`.
"""
