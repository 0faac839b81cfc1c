"""A camera's pose of a car, and a car's track."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats
from scm.geometry import Pose2
from scm.scenery.tags import TAG_COUNT

ROOF_TAG_SIZE = "roof_tag_size"
"""Flag of a sighting whose tag has another size than in its car file, and of its track."""
MAX_POSITION_M = 1e4  # beyond: a broken sighting
MAX_STD = 100.0
LEAST_STD = 1e-6
"""Minimum of a sighting's own noise, [m] and [rad]: below it, differing ones contradict."""


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """One camera's pose of one tag's car.

    Attributes:
        vehicle: The car whose tag it is; `tag-<id>` for an unknown tag.
        t_ns: When the frame was exposed.
        pose: Of the rear axle, map frame.
        covariance: Over x [m], y [m], yaw [rad], (3, 3).
        shared: Part of it common to all sightings by this camera, (3, 3); None: all of it, so that
            nothing averages out.
        common_mode: Part of it common to all cameras, (3, 3); None: nothing.
        flags: Of the camera, and `ROOF_TAG_SIZE`; its tracks inherit them.
    """

    camera: str
    tag_id: int
    vehicle: str
    t_ns: int
    pose: Pose2
    covariance: Floats
    shared: Floats | None = None
    common_mode: Floats | None = None
    flags: tuple[str, ...] = ()

    def components(self) -> tuple[Floats, Floats, Floats]:
        """Return the parts of the covariance, (3, 3) each: own noise, shared and common-mode.

        Without `shared`, nearly all of it is assumed to be common.
        """
        common_mode = np.zeros((3, 3)) if self.common_mode is None else self.common_mode
        shared = 0.98 * (self.covariance - common_mode) if self.shared is None else self.shared
        return self.covariance - shared - common_mode, shared, common_mode


def usable(sightings: Sequence[Sighting]) -> Bools:
    """Return which sightings are valid, (n,); those from the bus may hold anything."""
    if not sightings:
        return np.zeros(0, dtype=np.bool_)
    poses = np.array([one.pose for one in sightings], dtype=np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        components = np.array([one.components() for one in sightings])
        components = (components + components.swapaxes(2, 3)) / 2.0
    good = np.isfinite(poses).all(axis=1) & (np.abs(poses) < MAX_POSITION_M).all(axis=1)
    good &= (np.abs(components) < MAX_STD**2).all(axis=(1, 2, 3))
    good &= np.array([0 <= one.tag_id < TAG_COUNT for one in sightings])
    least = np.linalg.eigvalsh(np.where(good[:, None, None, None], components, 0.0))[..., 0]
    return np.asarray(good & (least > (LEAST_STD**2, -(LEAST_STD**2), -(LEAST_STD**2))).all(axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Estimated motion of a car.

    Attributes:
        t_ns: Time of the estimate.
        speed_mps: Of the rear axle along the car; `lateral_speed_mps` to its left.
        covariance: Over x, y, yaw, speed, lateral speed, yaw rate, (6, 6).
        age_s: Time since a camera last saw it.
        stale: Not seen for longer than a track can be trusted.
        flags: `tentative` seen fewer than three times, `unknown` an unknown tag, `duplicate` two
            places have its id, `disagree` two cameras see it slightly apart, `wrong_id` it is where
            another car is, or its tag has changed, `jumped` it was put elsewhere, `roof_tag_size`
            its tag has another size than in its car file; and those of its cameras.
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
