"""Everything on the bus into one MCAP file that survives a kill, and the way back.

`part.py` listens and writes, `mcap_file.py` is the file, `recover.py` mends one that was cut off,
`drives.py` makes recordings of its cars of it.
"""
