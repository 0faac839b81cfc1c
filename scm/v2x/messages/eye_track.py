"""Where a car is, by all overhead cameras together."""

from typing import ClassVar

from scm.v2x.message import Message

Row6 = tuple[float, float, float, float, float, float]


class EyeTrack(Message, kw_only=True, frozen=True):
    """Pose of the rear axle's centre in the map frame and its motion, brought forward to `t_ns`.

    Attributes:
        vehicle: The car; `tag-<id>` for a tag of no car.
        t_ns: The time of the estimate: when it was sent, not when a frame was exposed.
        speed_mps: Along the car, + = forward; `lateral_speed_mps`: + = to its left.
        covariance: Rows over x, y, yaw, speed, lateral speed, yaw rate, in the units of these.
        age_s: Since a camera last saw it.
        stale: Not seen for so long that it must not be used for driving.
        flags: What is wrong with it, as `scm.eye.track.sighting.Track` has them.
        cameras: Those that saw it last.
    """

    KEY: ClassVar[str] = "eye/pose/{vehicle}"
    RATE_HZ: ClassVar[float | None] = 20.0

    vehicle: str
    tag_id: int
    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    lateral_speed_mps: float
    yaw_rate_radps: float
    covariance: tuple[Row6, Row6, Row6, Row6, Row6, Row6]
    age_s: float
    stale: bool
    flags: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()


MESSAGE = EyeTrack
