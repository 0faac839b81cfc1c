"""Messages, keys and the bus: how the parts of a city and the cars communicate.

A message is one class in one file of `messages/`; key, rate and delivery are class attributes.
`bus.py` is the contract, `bus_zenoh.py` and `bus_memory.py` implement it. May import errors, clock,
geometry, maps. To add a message: copy a file of `messages/` and change it.
"""
