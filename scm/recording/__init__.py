"""Recordings of cars from any source, described by a `recording.yaml`.

`description.py` is that file as data, `expression.py` its formulas, `units.py` its units;
`table.py` reads its files as `columns.py` (`parquet.py`, `matlab.py`, `bag.py` with libraries), and
`read.py` makes a `Recording` of channels in SI. May import errors.
"""
