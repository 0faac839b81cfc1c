"""The radio: who hears what is sent, by distance and luck.

A frame sent by one station reaches every other station within the map's range, unless the seeded
loss takes it. Stations are cars, and the roadside units at their junctions.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

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


class Radio:
    """A channel of one range and one loss probability."""

    def __init__(self, range_m: float, rng: np.random.Generator, loss: float = 0.0) -> None:
        self._range_m = range_m
        self._rng = rng
        self._loss = loss
        self.counts = RadioCounts()

    def receivers(self, sender: str, places: Mapping[str, Point]) -> list[str]:
        """Return who hears a frame of `sender`, in order of name.

        Args:
            sender: A station of `places`; a frame of anybody else reaches nobody.
            places: Where every station's antenna is, map frame [m].
        """
        counts = self.counts
        counts.sent += 1
        if sender not in places:
            counts.unknown += 1
            return []
        x, y = places[sender]
        heard = []
        for station in sorted(places):
            if station == sender:
                continue
            at_x, at_y = places[station]
            if math.hypot(at_x - x, at_y - y) > self._range_m:
                counts.out_of_range += 1
            elif self._loss and self._rng.random() < self._loss:
                counts.lost += 1
            else:
                counts.delivered += 1
                heard.append(station)
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
