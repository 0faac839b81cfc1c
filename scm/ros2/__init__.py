"""The bridge to ROS 2: a part that speaks rmw_zenoh's wire format, without a ROS installation.

`part.py` connects the city's cars (`car.py`, `pilot.py`) and drawings (`markers.py`) to ROS topics.
Only `wire.py` opens Zenoh; `names.py` has its keys, and `types.py` encodes messages. To publish
another topic of a car, add a converter to `convert.py` and a line to `car.py`.
"""
