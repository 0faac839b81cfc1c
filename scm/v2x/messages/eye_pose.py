"""Where an overhead camera sees a car."""

from typing import ClassVar

from scm.v2x.message import Message

Rows = tuple[float, float, float, float, float, float, float, float, float]


class EyePose(Message, kw_only=True, frozen=True):
    """Pose of the rear axle's centre in the map frame, with covariance.

    Attributes:
        vehicle: The car whose tag it is; `tag-<id>` for a tag of no car.
        t_ns: When the frame was exposed.
        covariance: Row by row, 3 x 3 over x [m], y [m], yaw [rad].
        map_tag_age_ms: Since the camera last saw the map's tag: its frame may have moved since.
        shared_covariance: The part of it that all poses by this camera have in common.
        lean_covariance: The part that all cameras have in common: roll and pitch of the body.
        flags: What is wrong with the camera, by the codes of its `EyeStatus`: do not trust it.
    """

    KEY: ClassVar[str] = "eye/{camera}/pose/{vehicle}"
    RATE_HZ: ClassVar[float | None] = 10.0

    camera: str
    vehicle: str
    tag_id: int
    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    covariance: Rows
    map_tag_age_ms: float = 0.0
    shared_covariance: Rows | None = None
    lean_covariance: Rows | None = None
    flags: tuple[str, ...] = ()


MESSAGE = EyePose
