"""The Eye's accuracy: its poses compared with the truth of the same instant.

This is a part of its own since the Eye itself must not see the truth. It publishes nothing; it runs
inside the process that shows its results. The truth comes as snapshots at 20 Hz. Between two of
them position is interpolated linearly and yaw the short way round, which at 0.3 m/s errs by less
than 0.1 mm. A real car has no truth: the world takes its pose from the Eye.
"""

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence

from scm.clock import NS_PER_MS, NS_PER_S
from scm.geometry import Pose2, wrap_angle
from scm.records.eye import Residual, ResidualSample, ResidualStats
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

TRUTH_DEPTH = 80
"""Snapshots stored: 4 s, longer than any camera's latency."""
SAMPLES_NS = 300 * NS_PER_S
"""How long samples are stored."""
SAMPLE_PERIOD_NS = NS_PER_S // 2
"""Between two samples of a car: its error changes over half a second or more, not each frame."""
MAX_PAIRS = 2_000
"""Pairs of camera and car with samples: bounds the memory."""


class EyeAccuracyPart(BasePart):
    """Compares poses with the truth and keeps samples of the differences.

    Attributes:
        truth_ns: Time of the newest truth; None: none yet.
    """

    name = "eye_accuracy"
    role = "part"
    period_ns = 50 * NS_PER_MS
    subscriptions: Sequence[Subscription] = (Subscription(WorldSnapshot), Subscription(EyePose))

    def __init__(self) -> None:
        self._truth: deque[WorldSnapshot] = deque(maxlen=TRUTH_DEPTH)
        self._samples: dict[tuple[str, str], deque[ResidualSample]] = {}
        self._newest: dict[tuple[str, str], Residual | None] = {}
        self.truth_ns: int | None = None

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Compare the poses that arrived; publish nothing."""
        for incoming in inbox:
            if isinstance(incoming.message, WorldSnapshot):
                self._add_truth(incoming.message)
            elif isinstance(incoming.message, EyePose):
                pose = incoming.message
                truth = self.truth_at(pose.vehicle, pose.t_ns)
                self._newest[pose.camera, pose.vehicle] = None
                if truth is not None:
                    residual = residual_of(Pose2(pose.x_m, pose.y_m, pose.yaw_rad), truth)
                    self._newest[pose.camera, pose.vehicle] = residual
                    self._add_sample(pose, residual)
        return []

    def newest(self, camera: str, vehicle: str) -> Residual | None:
        """Return the residual of the newest pose; None when there is no truth of its time."""
        return self._newest.get((camera, vehicle))

    def _add_truth(self, snapshot: WorldSnapshot) -> None:
        if self.truth_ns is not None and snapshot.t_ns < self.truth_ns:
            self._truth.clear()  # the world was restarted: its time went back
        self._truth.append(snapshot)
        self.truth_ns = snapshot.t_ns

    def _add_sample(self, pose: EyePose, residual: Residual) -> None:
        pair = (pose.camera, pose.vehicle)
        if pair not in self._samples and len(self._samples) >= MAX_PAIRS:
            return
        samples = self._samples.setdefault(pair, deque(maxlen=SAMPLES_NS // SAMPLE_PERIOD_NS))
        if samples and pose.t_ns < samples[-1].t_ns:
            samples.clear()  # the world was restarted: its time went back
        if not samples or pose.t_ns >= samples[-1].t_ns + SAMPLE_PERIOD_NS:
            samples.append(
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

    def truth_at(self, vehicle: str, t_ns: int) -> Pose2 | None:
        """Return the true pose of a simulated car at `t_ns`; None outside the stored snapshots."""
        before = after = None
        for snapshot in self._truth:
            if snapshot.t_ns <= t_ns:
                before = snapshot
            if snapshot.t_ns >= t_ns:
                after = snapshot
                break
        if before is None or after is None:
            return None
        first, second = _car(before, vehicle), _car(after, vehicle)
        if first is None or second is None:
            return None
        span_ns = after.t_ns - before.t_ns
        share = (t_ns - before.t_ns) / span_ns if span_ns else 0.0
        return Pose2(
            first.x_m + share * (second.x_m - first.x_m),
            first.y_m + share * (second.y_m - first.y_m),
            wrap_angle(first.yaw_rad + share * wrap_angle(second.yaw_rad - first.yaw_rad)),
        )

    def samples(
        self, camera: str, now_ns: int, window_s: float, vehicle: str = ""
    ) -> dict[str, tuple[ResidualSample, ...]]:
        """Return a camera's samples of the last `window_s` seconds, oldest first, by car."""
        oldest_ns = now_ns - round(window_s * NS_PER_S)
        return {
            name: tuple(sample for sample in samples if sample.t_ns >= oldest_ns)
            for (by, name), samples in sorted(self._samples.items())
            if by == camera and vehicle in ("", name)
        }

    def forget(self) -> None:
        """Drop cars that no camera has seen for as long as samples are stored."""
        oldest_ns = (self.truth_ns or 0) - SAMPLES_NS
        for pair in [p for p, samples in self._samples.items() if samples[-1].t_ns < oldest_ns]:
            del self._samples[pair]
        for pair in self._newest.keys() - self._samples.keys():
            del self._newest[pair]


def residual_of(measured: Pose2, truth: Pose2) -> Residual:
    """Return measured minus true, in millimetres and degrees."""
    return Residual(
        position_mm=round(1000.0 * math.hypot(measured.x - truth.x, measured.y - truth.y), 2),
        x_mm=round(1000.0 * (measured.x - truth.x), 2),
        y_mm=round(1000.0 * (measured.y - truth.y), 2),
        yaw_deg=round(math.degrees(wrap_angle(measured.yaw - truth.yaw)), 3),
    )


def stats_of(samples: Iterable[ResidualSample]) -> ResidualStats:
    """Return the statistics of samples."""
    found = tuple(samples)
    if not found:
        return ResidualStats(
            samples=0, mean_mm=None, p95_mm=None, worst_mm=None,
            bias_x_mm=None, bias_y_mm=None, bias_yaw_deg=None, yaw_std_deg=None,
        )  # fmt: skip
    distances = sorted(math.hypot(one.x_mm, one.y_mm) for one in found)
    yaw = _mean([one.yaw_deg for one in found])
    variance = _mean([(one.yaw_deg - yaw) ** 2 for one in found])
    return ResidualStats(
        samples=len(found),
        mean_mm=round(_mean(distances), 2),
        p95_mm=round(distances[math.ceil(0.95 * len(distances)) - 1], 2),
        worst_mm=round(distances[-1], 2),
        bias_x_mm=round(_mean([one.x_mm for one in found]), 2),
        bias_y_mm=round(_mean([one.y_mm for one in found]), 2),
        bias_yaw_deg=round(yaw, 3),
        yaw_std_deg=round(math.sqrt(variance), 3),
    )


def thinned(
    samples: Mapping[str, Sequence[ResidualSample]], most: int
) -> tuple[ResidualSample, ...]:
    """Return at most `most` of all cars' samples, evenly taken, with the newest of each car."""
    total = sum(len(of_car) for of_car in samples.values())
    step = max(1, math.ceil(total / most))
    return tuple(one for of_car in samples.values() for one in tuple(of_car)[::-1][::step][::-1])


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def _car(snapshot: WorldSnapshot, vehicle: str) -> SnapshotVehicle | None:
    found = (car for car in snapshot.vehicles if car.vehicle == vehicle and car.kind != "real")
    return next(found, None)
