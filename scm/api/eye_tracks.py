"""The Eye's tracks: each car by all cameras together, received while somebody requests them."""

import math

from scm.api.picture import Held
from scm.clock import NS_PER_S
from scm.records.eye import TrackRow
from scm.runtime.part import Subscription
from scm.v2x.messages.eye_track import EyeTrack

WATCHED_NS = 5 * NS_PER_S
"""How long after a request tracks are received: 20 a second of each car are many."""
SHOWN_S = 2.0
AS_SENT = ("vehicle", "tag_id", "t_ns", "stale", "flags", "cameras")
ROUNDED = ("x_m", "y_m", "yaw_rad", "speed_mps", "lateral_speed_mps", "yaw_rate_radps")


class TrackWatch:
    """When tracks were last requested, and the newest of each car; not safe between threads."""

    def __init__(self) -> None:
        self._until_ns: int | None = None
        self._newest: dict[str, Held[EyeTrack]] = {}

    def subscribe(self, now_ns: int) -> bool:
        """Receive tracks from now on; return whether they were not received before."""
        is_new = self._until_ns is None
        self._until_ns = now_ns + WATCHED_NS
        return is_new

    def forget(self, now_ns: int) -> bool:
        """Drop old tracks; return whether the last request is so old that none are received."""
        shown_ns = round(SHOWN_S * NS_PER_S)
        self._newest = {
            vehicle: held
            for vehicle, held in self._newest.items()
            if now_ns - held.arrived_ns <= shown_ns
        }
        if self._until_ns is None or now_ns < self._until_ns:
            return False
        self._until_ns, self._newest = None, {}
        return True

    def receive(self, track: EyeTrack, t_ns: int) -> None:
        """Keep a track."""
        if self._until_ns is not None:
            self._newest[track.vehicle] = Held(track, t_ns)

    def subscriptions(self) -> tuple[Subscription, ...]:
        """Return the subscriptions needed now."""
        return () if self._until_ns is None else (Subscription(EyeTrack),)

    def rows(self, now_ns: int) -> tuple[TrackRow, ...]:
        """Return the newest track of each car, by name."""
        return tuple(
            _row(held.message, held.age_s(now_ns))
            for _, held in sorted(self._newest.items())
            if held.age_s(now_ns) <= SHOWN_S
        )


def _row(track: EyeTrack, age_s: float) -> TrackRow:
    x, y, yaw, speed = (math.sqrt(max(0.0, track.covariance[i][i])) for i in range(4))
    return TrackRow(
        **{name: getattr(track, name) for name in AS_SENT},
        **{name: round(getattr(track, name), 4) for name in ROUNDED},
        std_x_m=round(x, 5),
        std_y_m=round(y, 5),
        std_yaw_rad=round(yaw, 5),
        std_speed_mps=round(speed, 5),
        age_s=round(track.age_s + age_s, 2),
    )
