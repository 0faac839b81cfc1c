"""Recordings of cars, anybody's: a `recording.yaml` says what stands where, in which unit.

`description.py` is that file as data, `expression.py` its formulas, `units.py` its units,
`table.py` reads the files it names (`parquet.py`, `matlab.py` and `bag.py` those that need a
library of their own) as `columns.py`, `read.py` makes a `Recording` of channels in SI. May import
errors.
"""
