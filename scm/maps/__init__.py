"""A city is one file: `maps/<name>.toml` holds lanes, lights, signs, walls, tags and cameras.

`model.py` is the map as data, `load.py` reads and doubts a file, `route.py` finds ways along lanes,
`occupancy.py` turns scanned grids into walls, `draw.py` makes the picture. May import errors and
geometry.
To add a map: write one file in `maps/`.
"""
