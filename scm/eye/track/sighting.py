"""What a camera says of a car, and what is told of a track."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats
from scm.geometry import Pose2
from scm.scenery.tags import TAG_COUNT

ROOF_TAG_SIZE = "roof_tag_size"
"""The flag of a sighting whose tag has another size than its car file says, and of its track."""
FARTHEST_M = 1e4
LARGEST_STD = 100.0
LEAST_STD = 1e-6
"""Of a sighting's own noise, [m] and [rad]: with less, two that differ cannot both be true."""


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
        flags: What is wrong with the camera, and `ROOF_TAG_SIZE`; its tracks carry them on.
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

    def doubts(self) -> tuple[Floats, Floats, Floats]:
        """Return what the covariance is made of, (3, 3) each: own noise, `shared` and `lean`.

        A camera that does not tell its part is taken to have nearly all of it in common.
        """
        lean = np.zeros((3, 3)) if self.lean is None else self.lean
        shared = 0.98 * (self.covariance - lean) if self.shared is None else self.shared
        return self.covariance - shared - lean, shared, lean


def usable(sightings: Sequence[Sighting]) -> Bools:
    """Return which sightings are numbers that a filter can take, (n,); any may come over a bus."""
    if not sightings:
        return np.zeros(0, dtype=np.bool_)
    poses = np.array([one.pose for one in sightings], dtype=np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        doubts = np.array([one.doubts() for one in sightings])
        doubts = (doubts + doubts.swapaxes(2, 3)) / 2.0
    good = np.isfinite(poses).all(axis=1) & (np.abs(poses) < FARTHEST_M).all(axis=1)
    good &= (np.abs(doubts) < LARGEST_STD**2).all(axis=(1, 2, 3))
    good &= np.array([0 <= one.tag_id < TAG_COUNT for one in sightings])
    least = np.linalg.eigvalsh(np.where(good[:, None, None, None], doubts, 0.0))[..., 0]
    return np.asarray(good & (least > (LEAST_STD**2, -(LEAST_STD**2), -(LEAST_STD**2))).all(axis=1))


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
            where another car is, or its tag has changed, `jumped` it was put elsewhere,
            `roof_tag_size` its tag has another size than its car file says; and those of its
            cameras.
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
