"""The radio: who hears what is sent, by distance and luck.

A frame sent by one station reaches every other station within the map's range, unless the seeded
loss takes it. Stations are cars, and the roadside units at their junctions. What hosted cars hear
their drivers keep, all for themselves (`vehicles/drivers/crowd.py`); here are all other receivers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats
from scm.maps.model import CityMap, Point
from scm.v2x.etsi_convert import roadside_station


@dataclass(slots=True)
class RadioCounts:
    """What became of frames: one frame to three stations counts three times but for `sent`.

    Attributes:
        unknown: Frames of senders whose place nobody knows.
    """

    sent: int = 0
    delivered: int = 0
    out_of_range: int = 0
    lost: int = 0
    unknown: int = 0


class Receivers:
    """Stations that frames are brought to.

    Attributes:
        names: Theirs, in order.
        x, y: Where their antennas are, map frame [m].
    """

    def __init__(self, places: Mapping[str, Point]) -> None:
        self.names: Sequence[str] = sorted(places)
        at = np.array([places[name] for name in self.names]).reshape(-1, 2)
        self.x, self.y = at.T
        self._number = {name: number for number, name in enumerate(self.names)}

    def number(self, name: str) -> int | None:
        """Return which of them a station is; None: none."""
        return self._number.get(name)


class Radio:
    """A channel of one range and one loss probability."""

    def __init__(self, range_m: float, rng: np.random.Generator, loss: float = 0.0) -> None:
        self._range_m = range_m
        self._rng = rng
        self._loss = loss
        self.counts = RadioCounts()

    def reach(self, senders: Sequence[str], x: Floats, y: Floats, receivers: Receivers) -> Bools:
        """Return who hears the frames of senders at x (k,), y (k,): (k, number of receivers).

        Nobody hears itself.
        """
        near: Bools = np.hypot(receivers.x - x[:, None], receivers.y - y[:, None]) <= self._range_m
        own = np.zeros_like(near)
        for row, sender in enumerate(senders):
            column = receivers.number(sender)
            if column is not None:
                own[row, column] = True
        near &= ~own
        heard = near & (self._rng.random(near.shape) >= self._loss) if self._loss else near
        counts = self.counts
        counts.sent += len(senders)
        counts.delivered += int(heard.sum())
        counts.lost += int((near & ~heard).sum())
        counts.out_of_range += int((~near & ~own).sum())
        return heard


def roadside_places(city_map: CityMap) -> dict[str, Point]:
    """Return where the roadside units stand: amid the lights of their junctions.

    A junction without lights gets the middle of the floor.
    """
    return {
        roadside_station(junction.name): _middle(city_map, junction.name)
        for junction in city_map.junctions
    }


def _middle(city_map: CityMap, junction: str) -> Point:
    lights = [light for light in city_map.lights if light.junction == junction]
    if not lights:
        floor = city_map.floor
        return 0.5 * sum(floor.x_m), 0.5 * sum(floor.y_m)
    n = len(lights)
    return sum(light.x_m for light in lights) / n, sum(light.y_m for light in lights) / n
