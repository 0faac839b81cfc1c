"""Drivers: who steers a car when nobody else does.

route       follows a path through the city: signals, other cars, speed, steering
track       the path as the driver looks at it: sampled, with a view ahead
trips       the errands of one car: route requests in, progress out
steering    path and pose to a steering command
heard       the other cars, as their CAMs tell
limits      what a driver must know of its car
ahead       which cars stand or drive on the way, and how far they are
stop_lines  stop or go at a line: signals, dilemma zone, room behind the junction
pace        speeds: how fast the way allows, and which throttle gives a speed
"""
