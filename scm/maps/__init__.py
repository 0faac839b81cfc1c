"""A city is one file: `maps/<name>.toml` holds lanes, lights, signs, walls, tags and cameras.

`scm.records.city_map` is the map as data; `load.py` reads a file and `check.py` validates it;
`polyline.py` and `route.py` are paths along lanes, `conflicts.py` what may not be green together;
`grid.py` and `occupancy.py` turn a scan into walls, `grey.py` reads pictures, `segments.py` turns
walls into edges; `draw.py` makes the picture. May import errors, arrays, geometry and records. To
add a map: write one file in `maps/`.
"""
