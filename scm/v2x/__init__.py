"""Messages, keys and the bus: how the parts of a city, and the cars, talk to each other.

A message is one class in one file of `messages/`; its key, rate and delivery are facts of the
class. `bus.py` is the contract, `bus_zenoh.py` and `bus_memory.py` keep it. May import errors,
clock, geometry, maps. To add a message: copy a file of `messages/` and change it.
"""
