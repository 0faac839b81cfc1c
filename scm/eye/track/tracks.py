"""One estimate per car: sightings in, in any order; tracks out, at any time.

Frames of several cameras arrive late and out of order. The tracks after each recent frame are
stored for `LATE_NS`: an earlier frame is inserted in order, and the later ones are processed again.
"""

from collections.abc import Collection, Iterable
from itertools import groupby

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_MS, NS_PER_S
from scm.eye.track.fleet import KINDS, Fleet
from scm.eye.track.motion import STATES
from scm.eye.track.sighting import Sighting, Track, usable
from scm.eye.track.update import updated
from scm.geometry import wrap_angle

STALE_NS = NS_PER_S // 2  # without a sighting a track is stale
MEMORY_NS = 5 * NS_PER_S  # of a track without a sighting
LATE_NS = 300 * NS_PER_MS
"""Maximum delay of a network camera's frames; older ones are refused."""
AHEAD_NS = 50 * NS_PER_MS
"""Frames further in the future have a wrong clock."""
MIN_SIGHTINGS = 3  # of a track that is not tentative
MAX_CAMERAS, MAX_CARS, MAX_PENDING = 8, 1000, 2000
OVERLAP_M = 0.05
"""Minimum distance of two cars' rear axles."""


class Tracks:
    """Tracks of all cars.

    Args:
        cameras: Whose sightings are used; None: of the first `MAX_CAMERAS`.
    """

    def __init__(self, cameras: Collection[str] | None = None) -> None:
        self._cameras = None if cameras is None else frozenset(cameras)
        self._refused = 0
        self._pending: list[Sighting] = []
        self._now_ns = 0
        self._before = Fleet()
        self._recent: list[tuple[int, tuple[Sighting, ...], Fleet]] = []

    def see(self, sightings: Iterable[Sighting], now_ns: int) -> None:
        """Add sightings of one or several frames, not later than `now_ns`.

        A frame may be added in several calls: it is processed when tracks are requested.
        """
        received = list(sightings)
        good = [one for one, can in zip(received, usable(received), strict=True)
                if can and self._is_ours(one, now_ns)]  # fmt: skip
        self._refused += len(received) - len(good)
        self._pending += good
        self._now_ns = now_ns
        if len(self._pending) > MAX_PENDING:
            self._process_pending()

    @property
    def refused(self) -> int:
        """Number of refused sightings: too late, from the future, or invalid.

        Also those of an unknown camera, or of one camera or car too many.
        """
        self._process_pending()
        return self._refused

    def _process_pending(self) -> None:
        """Process the sightings added since the last call: of a frame, all at once."""
        good, self._pending = self._pending, []
        good.sort(key=lambda one: (one.t_ns, one.camera))
        for (t_ns, _), frame in groupby(good, key=lambda one: (one.t_ns, one.camera)):
            one_frame = tuple(frame)
            accepted = self._with_room(one_frame)
            self._refused += len(one_frame) - len(accepted)
            if accepted:
                self._insert(t_ns, accepted)
        self._forget(self._now_ns)

    def at(self, t_ns: int) -> tuple[Track, ...]:
        """Return every track at a time, also of cars out of view."""
        self._process_pending()
        fleet = self._fleet()
        rows = np.flatnonzero(fleet.t_ns >= t_ns - MEMORY_NS)
        if not len(rows):
            return ()
        times = np.full(len(rows), t_ns)
        mean, covariance = fleet.predicted(rows, times)
        covariance = covariance[:, :STATES, :STATES]
        covariance[:, :3, :3] += fleet.common_mode[rows]
        wrong = _intruders(mean, fleet.came_ns[rows])
        return tuple(
            _track(fleet, int(row), t_ns, mean[i], covariance[i], bool(wrong[i]))
            for i, row in enumerate(rows)
        )

    def _is_ours(self, one: Sighting, now_ns: int) -> bool:
        """Return whether a sighting is recent, and of one of our cameras."""
        ours = self._cameras is None or one.camera in self._cameras
        return ours and now_ns - MEMORY_NS <= one.t_ns <= now_ns + AHEAD_NS

    def _with_room(self, frame: tuple[Sighting, ...]) -> tuple[Sighting, ...]:
        """Return the sightings of a frame of known cars, and of new ones while there is room."""
        fleet = self._fleet()
        if frame[0].camera not in fleet.cameras and len(fleet.cameras) >= MAX_CAMERAS:
            return ()
        new = {one.vehicle: None for one in frame if one.vehicle not in fleet.vehicles}
        over = set(list(new)[max(0, MAX_CARS - len(fleet.vehicles)) :])
        return tuple(one for one in frame if one.vehicle not in over) if over else frame

    def _fleet(self) -> Fleet:
        return self._recent[-1][2] if self._recent else self._before

    def _insert(self, t_ns: int, frame: tuple[Sighting, ...]) -> None:
        newest = self._recent[-1][0] if self._recent else t_ns
        if t_ns < newest - LATE_NS:
            self._refused += len(frame)
            return
        later = [one for one in self._recent if one[0] > t_ns]
        del self._recent[len(self._recent) - len(later) :]
        for then_ns, seen in [(t_ns, frame), *((one[0], one[1]) for one in later)]:
            self._recent.append((then_ns, seen, updated(self._fleet(), seen)))

    def _forget(self, now_ns: int) -> None:
        """Drop history that no late frame can change, and cars long out of view."""
        if not self._recent:
            return
        newest, seen, fleet = self._recent[-1]
        self._recent[-1] = newest, seen, fleet.without(now_ns - MEMORY_NS)
        old = sum(one[0] < newest - LATE_NS for one in self._recent)
        if old:
            self._before = self._recent[old - 1][2]
            del self._recent[:old]


def _intruders(mean: Floats, came_ns: Ints) -> Bools:
    """Return which tracks appeared where another was before, (n,)."""
    x, y = mean[:, 0], mean[:, 1]
    apart = np.hypot(x[:, None] - x, y[:, None] - y)
    after = came_ns[:, None] > came_ns
    return np.asarray(((apart < OVERLAP_M) & after).any(axis=1), dtype=np.bool_)


def _track(
    fleet: Fleet, row: int, t_ns: int, mean: Floats, covariance: Floats, intrudes: bool
) -> Track:
    age_ns = max(0, t_ns - int(fleet.t_ns[row]))
    recent = fleet.seen_ns[row] >= fleet.t_ns[row] - STALE_NS
    cameras = [index for index in np.flatnonzero(recent) if fleet.seen_ns[row, index]]
    vehicle, tag_id = fleet.vehicles[row], fleet.tag_ids[row]
    flags = {
        kind
        for kind, until in zip(KINDS, fleet.flagged_until_ns[row], strict=True)
        if until >= t_ns
    }
    flags.update(flag for index in cameras for flag in fleet.flags[index])
    if fleet.count[row] < MIN_SIGHTINGS:
        flags.add("tentative")
    if vehicle == f"tag-{tag_id}":
        flags.add("unknown")
    if intrudes:
        flags.add("wrong_id")
    x, y, yaw, speed, lateral, turn = (float(value) for value in mean[:STATES])
    return Track(
        vehicle=vehicle, tag_id=tag_id, t_ns=t_ns, x_m=x, y_m=y, yaw_rad=wrap_angle(yaw),
        speed_mps=speed, lateral_speed_mps=lateral, yaw_rate_rad_s=turn, covariance=covariance,
        age_s=age_ns / NS_PER_S, stale=age_ns > STALE_NS, flags=tuple(sorted(flags)),
        cameras=tuple(fleet.cameras[index] for index in cameras),
    )  # fmt: skip
