"""A CAM as a claim: a car's position and motion, and their claimed standard deviations."""

import math

import msgspec

from scm.traffic.misbehaviour.limits import Limits
from scm.v2x.etsi.cam_spatem import SCALE, CamBody
from scm.v2x.etsi.codes import is_out_of_range, scaled
from scm.v2x.etsi.convert import (
    ASSUMED_LENGTH_M,
    ASSUMED_WIDTH_M,
    generated_ns,
    read_cam,
)

SIGMAS_95 = 1.96  # confidence fields mean 95 %
MIN_STD = 1e-4  # metre, m/s or radian; a claimed zero must not divide
ACCEL_UNIT_MPS2 = 0.1 / SCALE


class Claim(msgspec.Struct, frozen=True, gc=False):
    """The content of one CAM, in metres of the floor.

    Attributes:
        who: The station's number in the message.
        station: Who sent it, by its key on the bus.
        receiver: Who received it.
        sent_ns: When it left its antenna.
        t_ns: The time that it claims to be of.
        lost_ns: Time that passed without the car being moved, see `CamRx`.
        x_m, y_m: The middle of the front bumper, map frame.
        yaw_rad, speed_mps, accel_mps2, yaw_rate_radps, length_m, width_m: None: absent, or
            beyond the field's range. Speed is negative in reverse.
        is_beyond_speed: Whether its speed is beyond the field's range.
        accel_beyond_mps2: The end of the field's range, +-1.14, that its acceleration exceeds, as
            Nigels do; None: it does not.
        own_m, own_mps, own_rad: Standard deviations of position, speed and yaw.
    """

    who: int
    station: str
    receiver: str
    sent_ns: int
    t_ns: int
    lost_ns: int
    x_m: float
    y_m: float
    yaw_rad: float | None
    speed_mps: float | None
    accel_mps2: float | None
    yaw_rate_radps: float | None
    length_m: float | None
    width_m: float | None
    is_beyond_speed: bool
    accel_beyond_mps2: float | None
    own_m: float
    own_mps: float
    own_rad: float
    body: CamBody

    @property
    def size(self) -> tuple[float, float]:
        """Return length and width [m]; a Nigel's where the CAM lacks them."""
        return self.length_m or ASSUMED_LENGTH_M, self.width_m or ASSUMED_WIDTH_M

    @property
    def accel_range(self) -> tuple[float, float] | None:
        """Return the least and the greatest possible acceleration; None: it has none."""
        if self.accel_mps2 is not None:
            return self.accel_mps2, self.accel_mps2
        beyond = self.accel_beyond_mps2
        if beyond is None:
            return None
        return (beyond, math.inf) if beyond > 0.0 else (-math.inf, beyond)

    @property
    def middle(self) -> tuple[float, float]:
        """Return the middle of the car's body; of one without a yaw, its front [m]."""
        if self.yaw_rad is None:
            return self.x_m, self.y_m
        half = self.size[0] / 2.0
        return self.x_m - half * math.cos(self.yaw_rad), self.y_m - half * math.sin(self.yaw_rad)

    def rear(self, front_share: float) -> tuple[float, float]:
        """Return the rear axle's centre if so much of the car lies before it [m]."""
        if self.yaw_rad is None:
            return self.x_m, self.y_m
        front = front_share * self.size[0]
        return self.x_m - front * math.cos(self.yaw_rad), self.y_m - front * math.sin(self.yaw_rad)


def claim_of(
    station: str, receiver: str, sent_ns: int, body: CamBody, limits: Limits, lost_ns: int = 0
) -> Claim | None:
    """Return what a CAM claims; None if it has no position."""
    reported = read_cam(body)
    if reported.place is None:
        return None
    motion = body.motion
    accel_mps2, beyond_mps2 = accel_of(body)
    ellipse = body.position.position_confidence_ellipse
    own = limits.own_m, limits.own_mps, limits.own_rad
    most = limits.most_own_m, limits.most_own_mps, limits.most_own_rad
    return Claim(
        body.station_id,
        station,
        receiver,
        sent_ns,
        generated_ns(body, sent_ns),
        lost_ns,
        *reported.place,
        reported.yaw_rad,
        reported.speed_mps,
        accel_mps2,
        reported.yaw_rate_radps,
        reported.length_m,
        reported.width_m,
        is_out_of_range(motion.speed, "value"),
        beyond_mps2,
        _deviation(ellipse, "semi_major", 0.01 / SCALE, own[0], most[0]),
        _deviation(motion.speed, "confidence", 0.01 / SCALE, own[1], most[1]),
        _deviation(motion.heading, "confidence", math.radians(0.1), own[2], most[2]),
        body,
    )


def accel_of(body: CamBody) -> tuple[float | None, float | None]:
    """Return the acceleration of a CAM, or the range end that it exceeds; see `Claim` [m/s^2]."""
    reported = body.motion.longitudinal_acceleration
    if is_out_of_range(reported, "value"):
        return None, reported.value * ACCEL_UNIT_MPS2
    return scaled(reported, "value", ACCEL_UNIT_MPS2), None


def _deviation(
    record: msgspec.Struct, field: str, unit: float, unknown: float, most: float
) -> float:
    """Return the standard deviation of a confidence field, never more than `most`."""
    if is_out_of_range(record, field):
        return most
    reported = scaled(record, field, unit)
    return unknown if reported is None else min(max(reported / SIGMAS_95, MIN_STD), most)
