"""All tracks at once, as arrays: one row a track."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from scm.arrays import Floats, Ints
from scm.eye.track.motion import OFFSET_STATES, STATES, predict, slip_std
from scm.eye.track.sighting import ROOF_TAG_SIZE, Sighting

KINDS = ("duplicate", "disagree", "wrong_id", "jumped", ROOF_TAG_SIZE)
"""Temporary flags of a track."""
FIRST_SPEED_STD_MPS = 2.0  # of a new track
FIRST_YAW_RATE_STD_RADPS = 2.0  # of a new track


def _none(*shape: int) -> Floats:
    return np.zeros(shape)


def _counts(*shape: int) -> Ints:
    return np.zeros(shape, dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Fleet:
    """Tracks of n cars by c cameras; never changed, only replaced.

    Attributes:
        mean: (n, 6 + 3 c), as `motion.predict` has it; likewise `covariance`.
        shared: Covariance of each camera's offset, (n, c, 3, 3).
        common_mode: Covariance common to all cameras, (n, 3, 3).
        t_ns: Time of `mean`, (n,): when the car was last seen.
        seen_ns: When each camera last saw it, (n, c); 0 never.
        count: Number of sightings, (n,).
        came_ns: When it appeared at its present place, (n,).
        outlier_pose: Pose of the last sighting that did not fit, (n, 3); `outlier`: its time, how
            many agree, and whether fitting ones came between, (n, 3).
        flagged_until_ns: Until when each of `KINDS` holds, (n, 5).
        flags: Each camera's last flags.
    """

    vehicles: tuple[str, ...] = ()
    tag_ids: tuple[int, ...] = ()
    cameras: tuple[str, ...] = ()
    mean: Floats = field(default_factory=lambda: _none(0, STATES))
    covariance: Floats = field(default_factory=lambda: _none(0, STATES, STATES))
    shared: Floats = field(default_factory=lambda: _none(0, 0, OFFSET_STATES, OFFSET_STATES))
    common_mode: Floats = field(default_factory=lambda: _none(0, OFFSET_STATES, OFFSET_STATES))
    t_ns: Ints = field(default_factory=lambda: _counts(0))
    seen_ns: Ints = field(default_factory=lambda: _counts(0, 0))
    count: Ints = field(default_factory=lambda: _counts(0))
    came_ns: Ints = field(default_factory=lambda: _counts(0))
    outlier_pose: Floats = field(default_factory=lambda: _none(0, 3))
    outlier: Ints = field(default_factory=lambda: _counts(0, 3))
    flagged_until_ns: Ints = field(default_factory=lambda: _counts(0, len(KINDS)))
    flags: tuple[tuple[str, ...], ...] = ()

    def predicted(self, rows: Ints, t_ns: Ints) -> tuple[Floats, Floats]:
        """Return means and covariances of some tracks at their times, (rows,)."""
        dt = np.asarray((t_ns - self.t_ns[rows]) * 1e-9, dtype=np.float64)
        return predict(self.mean[rows], self.covariance[rows], self.shared[rows], dt)

    def place(self, camera: int) -> slice:
        """Return the slice of a camera's offset in the states."""
        return slice(STATES + OFFSET_STATES * camera, STATES + OFFSET_STATES * (camera + 1))

    def with_camera(self, camera: str, flags: tuple[str, ...]) -> "Fleet":
        """Return it with states for a camera's offset, and with the camera's present flags."""
        if camera in self.cameras:
            index = self.cameras.index(camera)
            if self.flags[index] == flags:
                return self
            return replace(self, flags=(*self.flags[:index], flags, *self.flags[index + 1 :]))
        more = ((0, 0), (0, OFFSET_STATES))
        return replace(
            self,
            cameras=(*self.cameras, camera),
            mean=np.pad(self.mean, more),
            covariance=np.pad(self.covariance, ((0, 0), (0, OFFSET_STATES), (0, OFFSET_STATES))),
            shared=np.pad(self.shared, ((0, 0), (0, 1), (0, 0), (0, 0))),
            seen_ns=np.pad(self.seen_ns, ((0, 0), (0, 1))),
            flags=(*self.flags, flags),
        )

    def with_new(self, sightings: list[Sighting]) -> "Fleet":
        """Return it with an empty row for each of these new cars."""
        n = len(sightings)
        grown: dict[str, Any] = {
            name: np.concatenate((old, np.zeros((n, *old.shape[1:]), dtype=old.dtype)))
            for name in ARRAYS
            for old in (getattr(self, name),)
        }
        return replace(
            self,
            vehicles=(*self.vehicles, *(one.vehicle for one in sightings)),
            tag_ids=(*self.tag_ids, *(one.tag_id for one in sightings)),
            **grown,
        )

    def without(self, older_ns: int) -> "Fleet":
        """Return it without the tracks last seen before that time."""
        keep = np.flatnonzero(self.t_ns >= older_ns)
        if len(keep) == len(self.t_ns):
            return self
        selected: dict[str, Any] = {name: getattr(self, name)[keep] for name in ARRAYS}
        return replace(
            self,
            vehicles=tuple(self.vehicles[row] for row in keep),
            tag_ids=tuple(self.tag_ids[row] for row in keep),
            **selected,
        )


ARRAYS = (
    *("mean", "covariance", "shared", "common_mode", "t_ns", "seen_ns", "count", "came_ns"),
    *("outlier_pose", "outlier", "flagged_until_ns"),
)


def first_covariance(pose: Floats) -> Floats:
    """Return the covariance of a car seen for the first time, (6, 6), from its pose's (3, 3)."""
    covariance = np.zeros((STATES, STATES))
    covariance[:3, :3] = pose
    slip = float(slip_std(np.array([FIRST_SPEED_STD_MPS]))[0])
    covariance[3:, 3:] = np.diag([FIRST_SPEED_STD_MPS, slip, FIRST_YAW_RATE_STD_RADPS]) ** 2
    return covariance
