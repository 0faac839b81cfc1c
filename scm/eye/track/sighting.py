"""What a camera says of a car, and what is told of a track."""

from dataclasses import dataclass

from scm.arrays import Floats
from scm.geometry import Pose2


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """Where one camera saw one tag.

    Attributes:
        vehicle: The car whose tag it is; `tag-<id>` for a tag that belongs to nobody.
        t_ns: When the frame was exposed.
        pose: Of the rear axle, map frame.
        covariance: Over x [m], y [m], yaw [rad], (3, 3).
        shared: The part of it that all sightings by this camera have in common, (3, 3); None: all
            of it, which averages nothing away.
        lean: The part of it that all cameras have in common, (3, 3); None: nothing.
        flags: What is wrong with the camera; its tracks carry them on.
    """

    camera: str
    tag_id: int
    vehicle: str
    t_ns: int
    pose: Pose2
    covariance: Floats
    shared: Floats | None = None
    lean: Floats | None = None
    flags: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Where a car is now.

    Attributes:
        t_ns: The time that it is told for.
        speed_mps: Of the rear axle along the car; `lateral_speed_mps` to its left.
        covariance: Over x, y, yaw, speed, lateral speed, yaw rate, (6, 6).
        age_s: Since a camera last saw it.
        stale: Not seen for longer than a track is to be trusted.
        flags: `tentative` seen fewer than three times, `unknown` a tag of nobody, `duplicate` two
            places claim its id, `disagree` two cameras see it a little apart, `wrong_id` it stands
            where another car is, or its tag has changed, `jumped` it was put elsewhere; and those
            of its cameras.
        cameras: Those that saw it last, within `scm.eye.track.tracks.STALE_NS`.
    """

    vehicle: str
    tag_id: int
    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    lateral_speed_mps: float
    yaw_rate_rad_s: float
    covariance: Floats
    age_s: float
    stale: bool
    flags: tuple[str, ...]
    cameras: tuple[str, ...]
