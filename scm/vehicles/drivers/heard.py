"""The cars around, as their CAMs tell: remembered for a while and moved on at their last speed."""

import math
from collections import deque

from scm.clock import NS_PER_S, seconds
from scm.geometry import Pose2
from scm.v2x.etsi.cam_spatem import CamBody
from scm.v2x.etsi.convert import ASSUMED_LENGTH_M, ASSUMED_WIDTH_M, CamView, read_cam
from scm.vehicles.driver import Other
from scm.vehicles.drivers.ahead import REACH
from scm.vehicles.drivers.silence import ENOUGH, FRESH_NS

REMEMBER_NS = 3 * NS_PER_S
COUNTED = 16
COUNTED_NS = COUNTED * NS_PER_S
LONGEST_GUESS_S = 1.0
AROUND_M = 2.0


class HeardCars:
    """What one car knows of the others; a silent one is forgotten after three seconds."""

    def __init__(self) -> None:
        self._heard: dict[int, tuple[CamView, int]] = {}
        self._arrivals: dict[int, deque[int]] = {}

    def hear(self, body: CamBody, arrived_ns: int) -> None:
        """Take a CAM that arrived at `arrived_ns`, on the receiver's own clock.

        One that does not say where its car is leaves the last known place in force.
        """
        view = read_cam(body)
        if view.place is not None:
            self._heard[body.station_id] = (view, arrived_ns)
        arrivals = self._arrivals.setdefault(body.station_id, deque(maxlen=COUNTED))
        arrivals.append(arrived_ns)

    def hears_well(self, now_ns: int) -> bool:
        """Return whether a car on an air that loses frames may take silence for absence.

        It has heard of somebody in the last 16 s, of each lately, and of all often enough; see
        `silence.py`. Who has left counts as silent for so long.
        """
        kept = (
            (s, [t for t in row if now_ns - t <= COUNTED_NS]) for s, row in self._arrivals.items()
        )
        self._arrivals = {s: deque(row, COUNTED) for s, row in kept if row}
        rows = self._arrivals.values()
        are_fresh = all(now_ns - row[-1] <= FRESH_NS for row in rows)
        return bool(rows) and are_fresh and sum(map(len, rows)) >= ENOUGH * len(rows)

    def others(self, now_ns: int, near: Pose2 | None = None) -> tuple[Other, ...]:
        """Return where the others are believed to be now, in the order of their station ids.

        With `near`, those that cannot be within a driver's reach of it may be left out: in a large
        city working out where they are would cost more than all the rest of driving.
        """
        fresh = {
            station: heard
            for station, heard in self._heard.items()
            if now_ns - heard[1] <= REMEMBER_NS
        }
        self._heard = fresh
        return tuple(
            other_of(view, seconds(now_ns - arrived_ns))
            for _, (view, arrived_ns) in sorted(fresh.items())
            if near is None or _may_be_within_reach(view, near)
        )


def _may_be_within_reach(view: CamView, near: Pose2) -> bool:
    length_m, (x_m, y_m) = view.length_m or ASSUMED_LENGTH_M, _place_of(view)
    farthest = REACH + AROUND_M + length_m + LONGEST_GUESS_S * abs(view.speed_mps or 0.0)
    dx, dy = x_m - near.x, y_m - near.y
    return dx * dx + dy * dy <= farthest * farthest


def other_of(view: CamView, age_s: float) -> Other:
    """Return a car moved on from its CAM.

    What a CAM does not tell is assumed so that the driver keeps clear: a size is a Nigel's, a car
    of unknown speed stands, and one of unknown heading is a square around its front bumper that
    holds it whichever way it points.

    Raises:
        ValueError: when the CAM does not say where the car is.
    """
    length, width = view.length_m or ASSUMED_LENGTH_M, view.width_m or ASSUMED_WIDTH_M
    x, y = _place_of(view)
    if view.yaw_rad is None:
        return Other(x=x, y=y, yaw=0.0, speed=0.0, length=2.0 * length, width=2.0 * length)
    yaw, speed = view.yaw_rad, view.speed_mps or 0.0
    ahead = speed * min(age_s, LONGEST_GUESS_S) - 0.5 * length
    turned = (view.yaw_rate_radps or 0.0) * min(age_s, LONGEST_GUESS_S)
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
