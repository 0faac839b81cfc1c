"""All tracks at once, as arrays: one row a track."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from scm.arrays import Floats, Ints
from scm.eye.track.motion import OFFSET, STATES, predict, slip_std
from scm.eye.track.sighting import ROOF_TAG_SIZE, Sighting

KINDS = ("duplicate", "disagree", "wrong_id", "jumped", ROOF_TAG_SIZE)
"""What may be said of a track for a while."""
FIRST_SPEED_MPS = 2.0
FIRST_TURN_RAD_S = 2.0


def _none(*shape: int) -> Floats:
    return np.zeros(shape)


def _counts(*shape: int) -> Ints:
    return np.zeros(shape, dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Fleet:
    """Tracks of n cars by c cameras; never changed, only replaced.

    Attributes:
        mean: (n, 6 + 3 c), as `motion.predict` has it; likewise `covariance`.
        shared: What each camera's offset may be, (n, c, 3, 3).
        lean: Doubt that no camera can lessen, (n, 3, 3).
        t_ns: When `mean` holds, (n,): when the car was last seen.
        seen_ns: When each camera last saw it, (n, c); 0 never.
        count: How often it was seen, (n,).
        came_ns: When it appeared where it is, (n,).
        rival: Where sightings are that do not fit, (n, 3), when the last of them was, how many
            of them agree, and whether fitting ones came between, (n, 3).
        said_ns: Until when each of `KINDS` holds, (n, 5).
        flags: What each camera last said is wrong with it.
    """

    vehicles: tuple[str, ...] = ()
    tag_ids: tuple[int, ...] = ()
    cameras: tuple[str, ...] = ()
    mean: Floats = field(default_factory=lambda: _none(0, STATES))
    covariance: Floats = field(default_factory=lambda: _none(0, STATES, STATES))
    shared: Floats = field(default_factory=lambda: _none(0, 0, OFFSET, OFFSET))
    lean: Floats = field(default_factory=lambda: _none(0, OFFSET, OFFSET))
    t_ns: Ints = field(default_factory=lambda: _counts(0))
    seen_ns: Ints = field(default_factory=lambda: _counts(0, 0))
    count: Ints = field(default_factory=lambda: _counts(0))
    came_ns: Ints = field(default_factory=lambda: _counts(0))
    rival_pose: Floats = field(default_factory=lambda: _none(0, 3))
    rival: Ints = field(default_factory=lambda: _counts(0, 3))
    said_ns: Ints = field(default_factory=lambda: _counts(0, len(KINDS)))
    flags: tuple[tuple[str, ...], ...] = ()

    def predicted(self, rows: Ints, t_ns: Ints) -> tuple[Floats, Floats]:
        """Return means and covariances of some tracks at their times, (rows,)."""
        dt = np.asarray((t_ns - self.t_ns[rows]) * 1e-9, dtype=np.float64)
        return predict(self.mean[rows], self.covariance[rows], self.shared[rows], dt)

    def place(self, camera: int) -> slice:
        """Return where a camera's offset stands in the states."""
        return slice(STATES + OFFSET * camera, STATES + OFFSET * (camera + 1))

    def with_camera(self, camera: str, flags: tuple[str, ...]) -> "Fleet":
        """Return it with room for a camera's offsets, and with what the camera now says."""
        if camera in self.cameras:
            index = self.cameras.index(camera)
            if self.flags[index] == flags:
                return self
            return replace(self, flags=(*self.flags[:index], flags, *self.flags[index + 1 :]))
        more = ((0, 0), (0, OFFSET))
        return replace(
            self,
            cameras=(*self.cameras, camera),
            mean=np.pad(self.mean, more),
            covariance=np.pad(self.covariance, ((0, 0), (0, OFFSET), (0, OFFSET))),
            shared=np.pad(self.shared, ((0, 0), (0, 1), (0, 0), (0, 0))),
            seen_ns=np.pad(self.seen_ns, ((0, 0), (0, 1))),
            flags=(*self.flags, flags),
        )

    def with_new(self, sightings: list[Sighting]) -> "Fleet":
        """Return it with an empty row for each of these cars, not yet seen."""
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
        kept: dict[str, Any] = {name: getattr(self, name)[keep] for name in ARRAYS}
        return replace(
            self,
            vehicles=tuple(self.vehicles[row] for row in keep),
            tag_ids=tuple(self.tag_ids[row] for row in keep),
            **kept,
        )


ARRAYS = (
    *("mean", "covariance", "shared", "lean", "t_ns", "seen_ns", "count", "came_ns"),
    *("rival_pose", "rival", "said_ns"),
)


def first_covariance(pose: Floats) -> Floats:
    """Return the doubt of a car just seen for the first time, (6, 6), of its pose's (3, 3)."""
    covariance = np.zeros((STATES, STATES))
    covariance[:3, :3] = pose
    slip = float(slip_std(np.array([FIRST_SPEED_MPS]))[0])
    covariance[3:, 3:] = np.diag([FIRST_SPEED_MPS, slip, FIRST_TURN_RAD_S]) ** 2
    return covariance
