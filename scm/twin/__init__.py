"""The living twin: notices that a car is no longer what its car file says, and what changed.

- `windows`: what the car file misses in each second of driving, and how each known effect would
  change that.
- `detector`: sequential detection of a change in those misses, with its onset.
"""
