"""The city as ROS 2 sees it: a part that speaks rmw_zenoh's wire format, without ROS.

`part.py` ties a city's cars (`car.py`, `pilot.py`) and drawings (`markers.py`) to ROS topics;
`wire.py` is the only one that opens Zenoh, `names.py` says what travels there and `types.py` how a
message becomes bytes. To show one more thing of a car: a converter in `convert.py`, a line in
`car.py`.
"""
