"""The cars around one car, from their CAMs, extrapolated at their last speed."""

import math
from collections import deque

from scm.clock import NS_PER_S, seconds
from scm.geometry import Pose2
from scm.v2x.etsi.cam_spatem import CamBody
from scm.v2x.etsi.convert import ASSUMED_LENGTH_M, ASSUMED_WIDTH_M, CamView, read_cam
from scm.vehicles.driver import Other
from scm.vehicles.drivers.cars_ahead import REACH
from scm.vehicles.drivers.reception import MAX_NEWEST_AGE_NS, MIN_MEAN_CAMS

MAX_CAM_AGE_NS = 3 * NS_PER_S
CAMS_COUNTED = 16
COUNTED_FOR_NS = CAMS_COUNTED * NS_PER_S
MAX_EXTRAPOLATION_S = 1.0
MARGIN_M = 2.0


class CamTracker:
    """What one car knows of the others; a car is dropped three seconds after its last CAM."""

    def __init__(self) -> None:
        self._latest: dict[int, tuple[CamView, int]] = {}
        self._arrivals: dict[int, deque[int]] = {}

    def receive(self, body: CamBody, arrived_ns: int) -> None:
        """Store a CAM that arrived at `arrived_ns`, on the receiver's clock.

        A CAM without a position does not replace the last known place.
        """
        view = read_cam(body)
        if view.place is not None:
            self._latest[body.station_id] = (view, arrived_ns)
        arrivals = self._arrivals.setdefault(body.station_id, deque(maxlen=CAMS_COUNTED))
        arrivals.append(arrived_ns)

    def reception_is_good(self, now_ns: int) -> bool:
        """Return whether reception on a lossy channel is good enough; see `reception.py`.

        It is if the car received some station in the last 16 s, each one lately, and all of them
        often enough. A station that has left counts as not received for that long.
        """
        recent = (
            (s, [t for t in row if now_ns - t <= COUNTED_FOR_NS])
            for s, row in self._arrivals.items()
        )
        self._arrivals = {s: deque(row, CAMS_COUNTED) for s, row in recent if row}
        rows = self._arrivals.values()
        are_fresh = all(now_ns - row[-1] <= MAX_NEWEST_AGE_NS for row in rows)
        return bool(rows) and are_fresh and sum(map(len, rows)) >= MIN_MEAN_CAMS * len(rows)

    def others(self, now_ns: int, near: Pose2 | None = None) -> tuple[Other, ...]:
        """Return the estimated places of the others now, in the order of their station ids.

        With `near`, cars that cannot be within a driver's reach of it are left out: in a large city
        extrapolating all of them would cost more than the rest of driving.
        """
        fresh = {
            station: latest
            for station, latest in self._latest.items()
            if now_ns - latest[1] <= MAX_CAM_AGE_NS
        }
        self._latest = fresh
        return tuple(
            other_of(view, seconds(now_ns - arrived_ns))
            for _, (view, arrived_ns) in sorted(fresh.items())
            if near is None or _may_be_within_reach(view, near)
        )


def _may_be_within_reach(view: CamView, near: Pose2) -> bool:
    length_m, (x_m, y_m) = view.length_m or ASSUMED_LENGTH_M, _place_of(view)
    farthest = REACH + MARGIN_M + length_m + MAX_EXTRAPOLATION_S * abs(view.speed_mps or 0.0)
    dx, dy = x_m - near.x, y_m - near.y
    return dx * dx + dy * dy <= farthest * farthest


def other_of(view: CamView, age_s: float) -> Other:
    """Return a car extrapolated from its CAM.

    Missing values are assumed on the safe side: the size of a Nigel, standstill, and for an unknown
    heading a square around the front bumper that holds the car in any direction.

    Raises:
        ValueError: when the CAM has no position.
    """
    length, width = view.length_m or ASSUMED_LENGTH_M, view.width_m or ASSUMED_WIDTH_M
    x, y = _place_of(view)
    if view.yaw_rad is None:
        return Other(x=x, y=y, yaw=0.0, speed=0.0, length=2.0 * length, width=2.0 * length)
    yaw, speed = view.yaw_rad, view.speed_mps or 0.0
    ahead = speed * min(age_s, MAX_EXTRAPOLATION_S) - 0.5 * length
    turned = (view.yaw_rate_radps or 0.0) * min(age_s, MAX_EXTRAPOLATION_S)
    return Other(
        x=x + ahead * math.cos(yaw + 0.5 * turned),
        y=y + ahead * math.sin(yaw + 0.5 * turned),
        yaw=yaw + turned,
        speed=speed,
        length=length,
        width=width,
    )


def _place_of(view: CamView) -> tuple[float, float]:
    if view.place is None:
        msg = f"CAM of station {view.station_id}: expected a position, got unavailable"
        raise ValueError(msg)
    return view.place
