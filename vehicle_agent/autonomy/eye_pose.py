"""Where the Eye sees a car: a second witness of its pose, beside its own scanner.

A track of the Eye is older than the sweep that it helps to place. Odometry has how the car moved
between the two, so the pose is moved on to the end of the sweep:

    pose at the sweep = pose by the Eye @ (odometry then)^-1 @ (odometry at the sweep)

What a calibration, a tag's place on the roof and two clocks may be wrong by is the same in all
tracks and does not average out: `SYSTEMATIC` is added to each covariance, so that scans that fix
the pose outweigh the Eye by far. A pose that the scans contradict (Mahalanobis distance) for a
second is reported in words.
"""

import math
from collections import deque

import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_MS, NS_PER_S
from scm.geometry import Pose2, wrap_angle
from scm.v2x.messages.eye_track import EyeTrack
from vehicle_agent.autonomy.odometry import LIKELY, Odometry
from vehicle_agent.autonomy.particle_filter import KNOWN, Localised, PoseMeasurement

SYSTEMATIC = (0.03, 0.03, 0.05)  # standard deviation of what all tracks share [m, m, rad]
MAX_AGE_S = 0.25  # since a camera saw the car
LATEST_NS = 400 * NS_PER_MS  # from a track to the sweep that it helps to place
HARMLESS = frozenset({"jumped", "re_anchored", "roof_tag_size"})
"""Flags of tracks that are used: put elsewhere and seen there since, realigned, wide covariance."""
DISAGREE_NS = NS_PER_S  # until a contradiction is reported
REMEMBERED = 8  # sweeps and tracks


class EyePoses:
    """Tracks of one car.

    Attributes:
        problem: How it and the scans disagree, in words; empty: they do not, or not for long.
    """

    def __init__(self) -> None:
        self._tracks = deque[EyeTrack](maxlen=REMEMBERED)
        self._sweeps = deque[Odometry](maxlen=REMEMBERED)
        self._disagree_ns: int | None = None
        self.problem = ""

    def receive(self, track: EyeTrack) -> None:
        """Store a track; one that must not be used is ignored."""
        if _is_usable(track):
            self._tracks.append(track)

    def begin_anew(self) -> None:
        """Forget where odometry had the car: it begins anew."""
        self._sweeps.clear()

    def at_sweep(self, now: Odometry) -> PoseMeasurement | None:
        """Return where the Eye saw the car, at the end of a sweep; None: it did not, lately.

        Each track is used once.
        """
        self._sweeps.append(now)
        track: EyeTrack | None = None
        while self._tracks and self._tracks[0].t_ns <= now.t_ns:
            track = self._tracks.popleft()
        if track is None or now.t_ns - track.t_ns > LATEST_NS:
            return None
        moved = self._odometry_at(track.t_ns).inverse() @ now.pose
        covariance = _covariance(track) + np.diag(np.square(SYSTEMATIC))
        pose = Pose2(track.x_m, track.y_m, track.yaw_rad)
        return PoseMeasurement(pose @ moved, covariance)

    def compare(self, t_ns: int, seen: PoseMeasurement, found: Localised) -> None:
        """Compare where the Eye and the scans have the car."""
        left = np.array(seen.pose) - np.array(found.pose)
        left[2] = wrap_angle(left[2])
        distance = float(left @ np.linalg.solve(seen.covariance + found.covariance, left))
        if distance <= LIKELY:
            self._disagree_ns, self.problem = None, ""
        elif self._disagree_ns is None or t_ns < self._disagree_ns:
            self._disagree_ns = t_ns
        elif t_ns - self._disagree_ns >= DISAGREE_NS and not self.problem:
            away = found.pose.inverse() @ seen.pose
            self.problem = (
                f"the Eye sees the car {math.hypot(away.x, away.y):.2f} m and "
                f"{abs(math.degrees(away.yaw)):.0f} degrees from where its scans fit the map: "
                "the scans are believed"
            )

    def _odometry_at(self, t_ns: int) -> Pose2:
        """Return where odometry had the car: between two sweeps, or before the first."""
        sweeps = list(self._sweeps)
        after = next((one for one in sweeps if one.t_ns >= t_ns), sweeps[-1])
        before = [one for one in sweeps if one.t_ns < t_ns]
        if not before:
            dt_s = (t_ns - after.t_ns) / NS_PER_S
            twist = after.twist
            return after.pose @ Pose2(twist.along_mps * dt_s, 0.0, twist.yaw_rate_radps * dt_s)
        share = (t_ns - before[-1].t_ns) / max(1, after.t_ns - before[-1].t_ns)
        x, y, yaw = before[-1].pose.inverse() @ after.pose
        return before[-1].pose @ Pose2(share * x, share * y, share * yaw)


def _covariance(track: EyeTrack) -> Floats:
    rows: Floats = np.array(track.covariance)[:3, :3]
    return 0.5 * (rows + rows.T)


def _is_usable(track: EyeTrack) -> bool:
    """Return whether a track is fresh, sure and unflagged; the bus may bring anything."""
    numbers, covariance = (track.x_m, track.y_m, track.yaw_rad), _covariance(track)
    if not (np.isfinite(numbers).all() and np.isfinite(covariance).all()):
        return False
    if (np.diag(covariance) > np.square(KNOWN)).any() or np.linalg.eigvalsh(covariance)[0] < 0.0:
        return False
    is_fresh = not track.stale and 0.0 <= track.age_s <= MAX_AGE_S
    return is_fresh and HARMLESS.issuperset(track.flags)
