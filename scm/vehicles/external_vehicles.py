"""The known state of cars that are simulated elsewhere: pose and planar motion.

It replaces a `Fleet` where such cars are measured; a LIDAR needs no more. All other values are
those of a car at rest on level floor.
"""

import numpy as np

from scm.arrays import Floats


class ExternalVehicles:
    """Cars by row; write their poses and motion here.

    Attributes:
        x, y, yaw: Rear-axle pose in the map frame, (capacity,) [m, rad].
        speed, lateral_speed, yaw_rate: Its motion along and across the body [m/s, rad/s].
    """

    def __init__(self, capacity: int) -> None:
        self.x, self.y, self.yaw, self.speed, self.lateral_speed, self.yaw_rate = np.zeros(
            (6, capacity)
        )
        rest: Floats = np.zeros(capacity)
        rest.flags.writeable = False
        self.roll = self.pitch = self.roll_rate = self.pitch_rate = rest
        self.roll_accel = self.pitch_accel = self.yaw_accel = rest
        self.accel_x = self.accel_y = self.accel_z = rest
        self.contact_accel_x = self.contact_accel_y = self.contact_yaw_accel = rest
        self.throttle = self.steer_angle = rest
        self.wheel_angle: Floats = np.broadcast_to(rest[:, None], (capacity, 4))
