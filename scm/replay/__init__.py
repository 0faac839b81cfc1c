"""Simulates a recorded drive again.

`free_run` starts windows in the measured motion and applies the recorded commands. `drive` holds a
recording on the simulation's time grid, `commands` the car's commands, `smooth` its smoothed poses,
`camera` the camera's faults; `windows` simulates many windows side by side. May import
data_quality, vehicles.
"""
