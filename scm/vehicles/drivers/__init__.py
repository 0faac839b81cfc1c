"""Drivers: who steers a car when nobody else does. One law, compiled, for one car or ten thousand.

law          all that a driver decides, in order          crowd    any number of drivers on one map
way          where a car is along its lanes               errands  route requests in, progress out
ahead        which cars stand or drive on the way         alone    one car with a crowd of its own
stop_lines   stop or go: what the signals say             trips    the errands of one car alone
giving_way   stop or go where there are no signals        rules    what signs say, where ways meet
exits        whether there is room behind a junction      route    one car along a path
pace         how fast, and which throttle for it          heard    cars around one, by their CAMs
steering     a way and a pose to a steering command
Tables of arrays: streets and rules the map, memory the drivers, stations the CAMs, signal_table the
signals. chance decides whose radio frames get lost; limits reads what a driver must know from a car
file.
"""
