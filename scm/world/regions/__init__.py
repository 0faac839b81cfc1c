"""One city cut into regions, each with a world of its own; together they are equal to one world.

Start at `region.py`, the tick of a region; `cut.py` cuts a map, `ownership.py` says which region
owns which car, `transfer.py` carries a car from one region to another, `exchange.py` holds what
regions tell each other once a tick, and `part.py` runs all regions of a city as one part.
"""
