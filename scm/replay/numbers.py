"""The parameters of a car and of its sensor faults by key, with their neutral values."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats

Numbers = Mapping[str, float]
"""A number that changes stands as what it is in the end, and with these after its key: what it was
before, and when the change begins and ends on the drive's clock [s]. One that comes and goes
stands as what it is meanwhile, and with when it is again what it was before."""
BEFORE, SINCE, UNTIL, BACK = "@before", "@since_s", "@until_s", "@back_s"
"""Of a number that follows a recorded variable: the variable's place in `VARIABLES`, and the value
of the variable at which the number is what it stands as; at 0 it is what it was `BEFORE`."""
BY, AT = "@by", "@at"
THROTTLE_DELAY, STEERING_DELAY = "drive.delay_s", "steering.delay_s"
THROTTLE_CLOCK = "clock.throttle_s"  # the throttle acts so much later than the steering
# Faults of measurement by the key that their library parameter has, and their neutral values.
COMMAND_CLOCK = "clock.commands_s"  # commands take effect so much later than they are stamped
POSE_CLOCK = "clock.pose_s"  # poses are stamped so much later than the other sensors
NEUTRAL: Mapping[str, float] = {
    COMMAND_CLOCK: 0.0, POSE_CLOCK: 0.0, "measure.pose_delay_s": 0.0, "measure.clock_offset_s": 0.0,
    "measure.clock_rate": 0.0, "measure.pose_scale": 1.0, "measure.camera_tilt_x_per_m": 0.0,
    "measure.camera_tilt_y_per_m": 0.0, "measure.pose_point_x_m": 0.0,
    "measure.pose_point_y_m": 0.0, "measure.pose_heading_rad": 0.0, "measure.encoder_loss": 0.0,
    "measure.gyro_bias_rad_s": 0.0, "measure.gyro_scale": 1.0, "measure.speed_scale": 1.0,
    "measure.accel_bias_x_m_s2": 0.0, "measure.accel_bias_y_m_s2": 0.0,
    "measure.imu_angle_rad": 0.0,
}  # fmt: skip
MOTION_VARIABLES = (
    "speed", "lateral_speed", "yaw_rate", "accel_x", "accel_y", "steer_angle",
    "wheel_angle.fl", "wheel_angle.fr", "wheel_angle.rl", "wheel_angle.rr",
)  # fmt: skip
TETHER_STEPS = 50  # between two moments at which a simulated pose is set to the measured one


@dataclass(frozen=True, slots=True)
class Change:
    """A number of one set that changes during a drive, from `before` to `after`.

    Attributes:
        column: Of the set.
        since_s, until_s: When the change begins and ends; the same: a step.
        back_s: When the number is `before` again.
    """

    column: int
    key: str
    before: float
    after: float
    since_s: float
    until_s: float
    back_s: float = math.inf

    def done(self, first_s: Floats | float, last_s: Floats | float) -> Floats:
        """Return the share of the change that is done, its mean over each span of time."""
        span = np.maximum(np.subtract(last_s, first_s), 1e-9)
        return np.asarray((self._area(last_s) - self._area(first_s)) / span)

    def _area(self, t: Floats | float) -> Floats:
        """Return the integral of the share that is done, up to each time."""
        t = np.minimum(t, self.back_s)
        length = max(self.until_s - self.since_s, 1e-9)
        inside = np.clip(np.subtract(t, self.since_s), 0.0, length)
        return np.asarray(
            inside * inside / (2.0 * length) + np.maximum(np.subtract(t, self.until_s), 0.0)
        )


@dataclass(frozen=True, slots=True)
class Dependence:
    """A number of one set that follows a recorded variable from `before`, in proportion.

    Attributes:
        column: Of the set.
        variable: Its place in `VARIABLES`.
        after: What the number is where the variable is `at`.
    """

    column: int
    key: str
    variable: int
    at: float
    before: float
    after: float


def dependences_in(sets: Sequence[Numbers]) -> Iterator[Dependence]:
    """Yield the numbers that follow a recorded variable, set by set."""
    for column, numbers in enumerate(sets):
        for key in numbers:
            if key.endswith(BY):
                of = key.removesuffix(BY)
                yield Dependence(
                    column, of, round(numbers[key]), numbers[of + AT], numbers[of + BEFORE],
                    numbers[of],
                )  # fmt: skip


def changes_in(sets: Sequence[Numbers]) -> Iterator[Change]:
    """Yield the numbers that change, set by set."""
    for column, numbers in enumerate(sets):
        for key in numbers:
            if key.endswith(SINCE):
                of = key.removesuffix(SINCE)
                yield Change(
                    column, of, numbers[of + BEFORE], numbers[of], numbers[key],
                    numbers[of + UNTIL], numbers.get(of + BACK, math.inf),
                )  # fmt: skip
