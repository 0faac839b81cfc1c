"""One driver with a crowd of its own: the law of thousands of cars, for a car that drives itself.

Whatever it is shown is the whole world that it knows.
"""

import math

import numpy as np

from scm.maps.route import Roads
from scm.vehicles.driver import CarLimits, Other, RouteView
from scm.vehicles.drivers.channel import DEAF
from scm.vehicles.drivers.driver_batch import Crowd
from scm.vehicles.drivers.memory import WAITING_FOR
from scm.vehicles.drivers.streets import streets_of

OWN = 0
MOST_OTHERS = 63


class Alone:
    """The driver of one car.

    Attributes:
        crowd: Where it is sent, as slot `OWN`.
    """

    def __init__(self, roads: Roads, limits: CarLimits, seed: int = 0) -> None:
        self.crowd = Crowd(streets_of(roads), 1 + MOST_OTHERS)
        self.crowd.enter(OWN, limits, seed)
        self._shown = 0

    @property
    def done_m(self) -> float:
        """Distance driven since it was sent [m]."""
        return float(self.crowd.done_m[OWN])

    @property
    def cross_track(self) -> float:
        """How far the rear axle is beside the way [m], + = left."""
        return float(self.crowd.cross_track[OWN])

    @property
    def waiting_for(self) -> str | None:
        """What holds the car at rest: `signal`, `vehicle`, `stop`, or None."""
        return WAITING_FOR[self.crowd.waiting[OWN]]

    @property
    def arrived(self) -> bool:
        """Whether its route is done."""
        return bool(self.crowd.arrived[OWN])

    def decide(self, view: RouteView) -> tuple[float, float]:
        """Return (throttle, steering), both -1 to 1: + forward, + left."""
        self._show(_nearest(view), view.now_ns)
        self.crowd.channel.numbers[DEAF] = 0.0 if view.hears_well else 1.0
        pose = (*view.pose, view.speed)
        return self.crowd.decide_alone(OWN, view.now_ns, pose, view.signals.table, stop=view.stop)

    def _show(self, others: tuple[Other, ...], now_ns: int) -> None:
        """Put the others into the crowd as if each had just told where it is."""
        crowd = self.crowd
        for slot in range(1 + len(others), 1 + self._shown):
            crowd.show(slot, 0.0, 0.0)
        self._shown = len(others)
        if others:
            for slot, other in enumerate(others, start=1):
                crowd.show(slot, other.length, other.width)
            told = np.array([_cam(other) for other in others])
            crowd.hear(np.arange(1, 1 + len(others)), now_ns, *told.T)


def _nearest(view: RouteView) -> tuple[Other, ...]:
    """Return as many others as there is room for: more cannot stand within a driver's reach."""
    if len(view.others) <= MOST_OTHERS:
        return view.others
    x, y, _ = view.pose
    return tuple(sorted(view.others, key=lambda o: math.hypot(o.x - x, o.y - y))[:MOST_OTHERS])


def _cam(other: Other) -> tuple[float, float, float, float, float]:
    """Return what a car would tell: its front bumper, heading, speed and turn."""
    ahead = 0.5 * other.length
    x, y = other.x + ahead * math.cos(other.yaw), other.y + ahead * math.sin(other.yaw)
    return x, y, other.yaw, other.speed, 0.0
