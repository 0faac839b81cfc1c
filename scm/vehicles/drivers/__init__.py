"""Drivers: the control of cars that nobody leases. One compiled controller for any number of cars.

controller       all that a driver decides, in order      driver_batch  many drivers on one map
lane_tracking    where a car is along its lanes           trips         route requests, trip reports
cars_ahead       which cars are on the way ahead          single_car    the driver of one car alone
stop_lines       stop or go by signals                    rules         signs, and where paths cross
giving_way       stop or go without signals               cam_tracker   cars around one, from CAMs
junction_exits   whether there is room behind a junction  hazards       hazard warnings from DENMs
speed_control    allowed speed and throttle               green_light   speed advice at signals
steering         a path and a pose to a steering command  reception     whether reception is good
speed_curvature  what a trained policy chooses, as commands
Tables of arrays: lane_graph the map, driver_state the drivers, received_cams the stations,
signal_table the signals. channel decides which radio frames arrive; limits reads a car's limits
from its car file.
"""
