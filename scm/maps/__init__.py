"""A city is one file: `maps/<name>.toml` holds lanes, lights, signs, walls, tags and cameras.

`model.py` is the map as data; `load.py` reads a file and `check.py` doubts it; `polyline.py` and
`route.py` are ways along lanes, `conflicts.py` what may not be green together; `grid.py` and
`occupancy.py` turn a scan into walls, `grey.py` reads pictures, `segments.py` turns walls into
edges; `draw.py` makes the picture. May import errors, arrays and geometry. To add a map: write one
file in `maps/`.
"""
