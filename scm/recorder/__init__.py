"""Records all messages of the bus in an MCAP file that survives a kill, and reads such files.

`part.py` records, `mcap_file.py` writes and reads files, `recover.py` repairs a truncated file,
`drives.py` reads the recordings of a run's cars, `play.py` drives a written drive and records it.
"""
