"""Traffic: signals, their monitor, demand, observation and misbehaviour; one room each.

`signals/` decides and publishes what junctions show, `monitor/` checks it independently, `demand/`
brings cars, `observation/` counts traffic and finds violations, `misbehaviour/` checks what cars
claim on the air. `car_facts.py` reads what they must know of cars. May import v2x, maps and
vehicles; knows no bus.
"""
