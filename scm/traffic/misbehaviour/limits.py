"""The limits of a car's motion and of its own measurements, in metres of the floor.

Those of VeReMi NextGen hold after division by the city's scale of 14, speed by the car's own
limit instead: acceleration 5.4 m/s^2 and deceleration 5.0 m/s^2 would be 0.39 and 0.36 m/s^2
here, and Nigels drive harder than that, so these too are the car's own; heading 76 degrees and
a reappearance after 4.7 s are used as they are.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

NIGEL_MPS = 0.267  # top speed
HEADING_RAD = math.radians(76.0)  # between motion and heading
REAPPEARS_S = 4.7  # after a longer silence a station is new


@dataclass(frozen=True)
class Limits:
    """Of one kind of car.

    Attributes:
        speed_mps: Greatest speed.
        accel_mps2: Greatest gain of speed over a tenth of a second; `decel_mps2` likewise of loss.
        start_mps2: Gain of speed over a tenth of a second at full throttle; `stop_mps2` likewise
            of loss at none, which brakes: a driver does neither, a guard does.
        interval_s: Least time between two CAMs.
        own_m: Standard deviation of a position whose CAM has none; likewise the others.
        most_own_m: The greatest standard deviation that a CAM may claim; likewise the others.
        front_share: Of a car's length, what lies before its rear axle.
        has_tag: Whether its car file has a tag on its roof.
    """

    speed_mps: float = NIGEL_MPS
    accel_mps2: float = 0.9
    decel_mps2: float = 1.5
    start_mps2: float = 2.3
    stop_mps2: float = 2.7
    interval_s: float = 0.1
    own_m: float = 0.008
    own_mps: float = 0.008
    own_rad: float = 0.02
    own_mps2: float = 0.05
    most_own_m: float = 0.03
    most_own_mps: float = 0.03
    most_own_rad: float = 0.1
    front_share: float = 0.767
    has_tag: bool = True

    @cached_property
    def hard(self) -> "Limits":
        """The same for braking with full throttle in reverse, as drivers by hand do."""
        most = self.start_mps2 + self.stop_mps2
        return replace(self, accel_mps2=most, decel_mps2=most, start_mps2=most, stop_mps2=most)


def limits_of(speed_mps: float, front_share: float, *, has_tag: bool) -> Limits:
    """Return the limits of a car by its top speed: a faster one accelerates and brakes harder."""
    nigel = Limits()
    times = max(1.0, speed_mps / NIGEL_MPS)
    return replace(
        nigel,
        speed_mps=speed_mps,
        accel_mps2=nigel.accel_mps2 * times,
        decel_mps2=nigel.decel_mps2 * times,
        start_mps2=nigel.start_mps2 * times,
        stop_mps2=nigel.stop_mps2 * times,
        front_share=front_share,
        has_tag=has_tag,
    )
