"""What one car has heard of the others: the newest CAM of each, carried on to now."""

import math
from typing import NamedTuple

from scm.clock import NS_PER_MS, NS_PER_S
from scm.v2x.etsi_convert import CamView
from scm.vehicles.driver import Other

FORGOTTEN_NS = 1500 * NS_PER_MS


class Heard(NamedTuple):
    """A car as it told of itself: the middle of its outline, and its velocity, map frame."""

    t_ns: int
    x: float
    y: float
    vx: float
    vy: float
    yaw: float
    speed: float
    length: float
    width: float


class Ears:
    """The other cars as heard over the radio; silent ones are forgotten."""

    def __init__(self) -> None:
        self._heard: dict[str, Heard] = {}

    def hear(self, station: str, car: Heard) -> None:
        """Take what a station told of itself."""
        self._heard[station] = car

    def others(self, now_ns: int) -> tuple[Other, ...]:
        """Return everybody heard lately where they are now if they went straight on."""
        old = [name for name, car in self._heard.items() if now_ns - car.t_ns > FORGOTTEN_NS]
        for name in old:
            del self._heard[name]
        found = []
        for t_ns, x, y, vx, vy, yaw, speed, length, width in self._heard.values():
            age = (now_ns - t_ns) / NS_PER_S
            found.append(Other(x + vx * age, y + vy * age, yaw, speed, length, width))
        return tuple(found)


def heard(view: CamView, now_ns: int) -> Heard | None:
    """Return what a CAM that arrived now says; None if it leaves out which way the car points."""
    yaw = view.yaw_rad
    if yaw is None:
        return None
    speed = view.speed_mps or 0.0
    c, s, back = math.cos(yaw), math.sin(yaw), 0.5 * view.length_m
    x, y = view.x_m - back * c, view.y_m - back * s
    return Heard(now_ns, x, y, speed * c, speed * s, yaw, speed, view.length_m, view.width_m)
