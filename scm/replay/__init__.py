"""A recording driven again by the simulator.

`free_run` starts windows in the measured motion and gives them the recorded commands. `drive` holds
a recording on the simulation's grid, `commands` what the car was commanded, `smooth` its smoothed
poses, `camera` what was seen of it, `windows` drives many windows side by side. May import
data_quality, vehicles.
"""
