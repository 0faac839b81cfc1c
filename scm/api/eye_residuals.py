"""How far the Eye's poses lay from the truth over the last minutes: samples, and their numbers.

Two a second of each camera and car are kept: the error's swing, which has half a second or more to
it where a car drives, and not its every frame.
"""

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence

from scm.clock import NS_PER_S
from scm.records.eye import Residual, ResidualSample, ResidualStats
from scm.v2x.messages.eye_pose import EyePose

HISTORY_NS = 300 * NS_PER_S
EVERY_NS = NS_PER_S // 2
MOST_PAIRS = 2_000
_DEPTH = HISTORY_NS // EVERY_NS


class ResidualLog:
    """The newest samples of each camera and car."""

    def __init__(self) -> None:
        self._pairs: dict[tuple[str, str], deque[ResidualSample]] = {}

    def add(self, pose: EyePose, residual: Residual) -> None:
        """Keep a pose's residual, unless it comes too soon after the last one kept."""
        pair = (pose.camera, pose.vehicle)
        if pair not in self._pairs and len(self._pairs) >= MOST_PAIRS:
            return
        stored = self._pairs.setdefault(pair, deque(maxlen=_DEPTH))
        if stored and pose.t_ns < stored[-1].t_ns:
            stored.clear()  # the world was restarted: its time went back
        if stored and pose.t_ns < stored[-1].t_ns + EVERY_NS:
            return
        stored.append(
            ResidualSample(
                vehicle=pose.vehicle,
                t_ns=pose.t_ns,
                x_m=round(pose.x_m, 4),
                y_m=round(pose.y_m, 4),
                x_mm=residual.x_mm,
                y_mm=residual.y_mm,
                yaw_deg=residual.yaw_deg,
            )
        )

    def samples(
        self, camera: str, now_ns: int, window_s: float, vehicle: str = ""
    ) -> dict[str, tuple[ResidualSample, ...]]:
        """Return what a camera's poses of the last seconds were off by, oldest first, by car."""
        oldest_ns = now_ns - round(window_s * NS_PER_S)
        return {
            name: tuple(one for one in stored if one.t_ns >= oldest_ns)
            for (seen_by, name), stored in sorted(self._pairs.items())
            if seen_by == camera and vehicle in ("", name)
        }

    def forget(self, now_ns: int) -> None:
        """Drop cars that no camera has seen for long."""
        oldest_ns = now_ns - HISTORY_NS
        for pair in [pair for pair, stored in self._pairs.items() if stored[-1].t_ns < oldest_ns]:
            del self._pairs[pair]


def stats_of(samples: Iterable[ResidualSample]) -> ResidualStats:
    """Return the numbers of some samples."""
    found = tuple(samples)
    if not found:
        return ResidualStats(
            samples=0, mean_mm=None, p95_mm=None, worst_mm=None,
            bias_x_mm=None, bias_y_mm=None, bias_yaw_deg=None, yaw_std_deg=None,
        )  # fmt: skip
    far = sorted(math.hypot(one.x_mm, one.y_mm) for one in found)
    yaw = _mean([one.yaw_deg for one in found])
    spread = _mean([(one.yaw_deg - yaw) ** 2 for one in found])
    return ResidualStats(
        samples=len(found),
        mean_mm=round(_mean(far), 2),
        p95_mm=round(far[math.ceil(0.95 * len(far)) - 1], 2),
        worst_mm=round(far[-1], 2),
        bias_x_mm=round(_mean([one.x_mm for one in found]), 2),
        bias_y_mm=round(_mean([one.y_mm for one in found]), 2),
        bias_yaw_deg=round(yaw, 3),
        yaw_std_deg=round(math.sqrt(spread), 3),
    )


def thinned(
    samples: Mapping[str, Sequence[ResidualSample]], most: int
) -> tuple[ResidualSample, ...]:
    """Return at most so many of all cars' samples, evenly taken, the newest of each among them."""
    total = sum(len(stored) for stored in samples.values())
    step = max(1, math.ceil(total / most))
    return tuple(one for stored in samples.values() for one in tuple(stored)[::-1][::step][::-1])


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)
