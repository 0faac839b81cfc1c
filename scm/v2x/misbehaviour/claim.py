"""A CAM as a claim: where a car says it is, how it moves, and how sure it says it is."""

import math

import msgspec

from scm.clock import NS_PER_MS
from scm.v2x.etsi import SCALE, CamBody
from scm.v2x.etsi_convert import generated_ns, read_cam
from scm.v2x.etsi_parts import NO_CONFIDENCE, NO_ELLIPSE
from scm.v2x.misbehaviour.limits import Limits

SURELY = 1.96
"""Deviations within which 95 % lie: what confidence means in these messages."""
ACCEL_UNKNOWN = 161
NEAR_NS = 30_000 * NS_PER_MS


class Claim(msgspec.Struct, frozen=True, gc=False):
    """What one CAM says, in metres of the table.

    Attributes:
        who: The station's number in the message.
        station: Who sent it, by its key on the bus.
        receiver: Who heard it.
        sent_ns: When it left its antenna.
        t_ns: When it says that it was true.
        lost_ns: Of the time until then, what passed without the car being moved, see `CamRx`.
        x_m, y_m: The middle of the front bumper, map frame.
        speed_mps: Negative in reverse.
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
    length_m: float
    width_m: float
    own_m: float
    own_mps: float
    own_rad: float
    body: CamBody

    @property
    def middle(self) -> tuple[float, float]:
        """Return the middle of the car's body; of one without a yaw, its front [m]."""
        if self.yaw_rad is None:
            return self.x_m, self.y_m
        half = self.length_m / 2.0
        return self.x_m - half * math.cos(self.yaw_rad), self.y_m - half * math.sin(self.yaw_rad)

    def rear(self, front_share: float) -> tuple[float, float]:
        """Return the rear axle's centre if so much of the car lies before it [m]."""
        if self.yaw_rad is None:
            return self.x_m, self.y_m
        front = front_share * self.length_m
        return self.x_m - front * math.cos(self.yaw_rad), self.y_m - front * math.sin(self.yaw_rad)


def claim_of(
    station: str, receiver: str, sent_ns: int, body: CamBody, limits: Limits, lost_ns: int = 0
) -> Claim:  # fmt: skip
    """Return what a CAM claims."""
    told = read_cam(body)
    motion = body.motion
    accel = motion.longitudinal_acceleration.value
    ellipse = body.position.position_confidence_ellipse.semi_major
    speed, heading = motion.speed.confidence, motion.heading.confidence
    return Claim(
        body.station_id,
        station,
        receiver,
        sent_ns,
        generated_ns(body, sent_ns),
        lost_ns,
        told.x_m,
        told.y_m,
        told.yaw_rad,
        told.speed_mps,
        None if accel == ACCEL_UNKNOWN else accel * 0.1 / SCALE,
        told.yaw_rate_radps,
        told.length_m,
        told.width_m,
        limits.own_m
        if ellipse == NO_ELLIPSE
        else min(max(ellipse * 0.01 / SCALE / SURELY, 1e-4), limits.most_own_m),
        limits.own_mps
        if speed == NO_CONFIDENCE
        else min(max(speed * 0.01 / SCALE / SURELY, 1e-4), limits.most_own_mps),
        limits.own_rad
        if heading == NO_CONFIDENCE
        else min(max(math.radians(heading * 0.1) / SURELY, 1e-3), limits.most_own_rad),
        body,
    )
