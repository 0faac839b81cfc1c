"""What is known of cars that somebody else simulates: where they are and how they move over ground.

It stands in for a `Fleet` where such cars are measured: a LIDAR needs no more. All the rest is at
rest and level.
"""

import numpy as np

from scm.arrays import Floats


class Placed:
    """Cars by row; write where they are.

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
        self.impact_x = self.impact_y = self.impact_yaw = rest
        self.throttle = self.steer_angle = rest
        self.wheel_angle: Floats = np.broadcast_to(rest[:, None], (capacity, 4))
