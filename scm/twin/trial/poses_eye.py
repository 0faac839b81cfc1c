"""Overhead cameras without pictures: poses of cars that report where they are, as seen from above.

Each camera sees its part of the floor. Frames come at a rate, somewhat irregularly; some are lost;
poses have noise, come late, and are off as a camera or a tag is.
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from scm.clock import NS_PER_MS, NS_PER_S, nanoseconds, seconds
from scm.geometry import wrap_angle
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.vehicle_state import VehicleState

RATE_HZ, JITTER_S, LOST, LATE_NS = 30.0, 0.002, 0.015, 60 * NS_PER_MS
STD = (0.002, 0.002, 0.0087)  # m, m, rad
REMEMBERED = 16  # reports of each car
Pose = tuple[float, float, float]
Seen = Callable[[str, str, float, Pose], Pose]
"""Returns the pose that a camera shows of a car at a time [s], by their names, and the true one."""


@dataclass(slots=True)
class View:
    """One camera.

    Attributes:
        x_m: Between which it sees cars.
        next_ns: When its next frame is exposed.
    """

    name: str
    x_m: tuple[float, float]
    next_ns: int = 0
    frames: int = field(default=0)


class PosesEye(BasePart):
    """All cameras of a city; see `scm.runtime.part.Part`.

    Args:
        views: The cameras.
        seen: What they show, but for the noise.
        rng: Of the noise.
        start_ns: Zero of the time that `seen` gets.
    """

    name, role, period_ns = "eye", "part", 20 * NS_PER_MS
    subscriptions: Sequence[Subscription] = (Subscription(VehicleState),)

    def __init__(
        self, views: Sequence[View], seen: Seen, rng: np.random.Generator, start_ns: int = 0
    ) -> None:
        self._views, self._seen, self._rng, self._start_ns = views, seen, rng, start_ns
        self._reports: dict[str, deque[VehicleState]] = {}
        variances = [one**2 for one in STD]
        self._covariance = (variances[0], 0.0, 0.0, 0.0, variances[1], 0.0, 0.0, 0.0, variances[2])
        for view in views:
            view.next_ns = start_ns

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Return the poses of the frames that are due."""
        for item in inbox:
            if isinstance(item.message, VehicleState):
                name = item.message.vehicle
                self._reports.setdefault(name, deque(maxlen=REMEMBERED)).append(item.message)
        out = list[Outgoing]()
        for view in self._views:
            while view.next_ns <= now_ns - LATE_NS:
                out += self._frame(view)
                view.frames += 1
                at_s = view.frames / RATE_HZ + self._rng.uniform(-JITTER_S, JITTER_S)
                view.next_ns = self._start_ns + nanoseconds(at_s)
        return out

    def _frame(self, view: View) -> list[Outgoing]:
        low, high = view.x_m
        out = list[Outgoing]()
        for name, reports in self._reports.items():
            pose = _at(reports, view.next_ns)
            if pose is None or not low <= pose[0] < high or self._rng.random() < LOST:
                continue
            t_s = seconds(view.next_ns - self._start_ns)
            shown = self._seen(view.name, name, t_s, pose)
            x, y, yaw = np.add(shown, STD * self._rng.standard_normal(3)).tolist()
            out.append(
                EyePose(
                    camera=view.name, vehicle=name, tag_id=0, t_ns=view.next_ns, x_m=x, y_m=y,
                    yaw_rad=wrap_angle(yaw), covariance=self._covariance,
                )
            )  # fmt: skip
        return out


def _at(reports: Sequence[VehicleState], t_ns: int) -> Pose | None:
    """Return where a car was between two of its reports; None: it was not there then."""
    later = None
    for report in reversed(reports):
        if report.t_ns <= t_ns:
            if later is None or later.t_ns - report.t_ns > NS_PER_S // 4:
                return None
            part = (t_ns - report.t_ns) / (later.t_ns - report.t_ns)
            turn = wrap_angle(later.yaw_rad - report.yaw_rad)
            return (
                report.x_m + part * (later.x_m - report.x_m),
                report.y_m + part * (later.y_m - report.y_m),
                report.yaw_rad + part * turn,
            )
        later = report
    return None


def sees(
    faults: Callable[[str, float], Mapping[str, float]],
    tags: Callable[[str, float], Mapping[str, float]],
    edges: Mapping[str, float],
    shown: Callable[[Mapping[str, float], float, float, float], Pose],
) -> Seen:
    """Return what cameras with faults show of tags that may have been knocked aside.

    Args:
        faults: Of a camera at a time.
        tags: Of a car's tag at a time.
        edges: Of each camera the x that stays where it is when its scale changes [m].
        shown: Of the reality: a pose as it is seen with such faults.
    """

    def seen(camera: str, car: str, t_s: float, pose: Pose) -> Pose:
        x, y, yaw = shown(tags(car, t_s), *pose)
        x, y, yaw = shown(faults(camera, t_s), x - edges[camera], y, yaw)
        return x + edges[camera], y, yaw

    return seen
