"""What was last told of the signals, junction by junction, for every receiver of the air.

One table serves one car, or a whole crowd: where frames get lost, it keeps the last few of them,
and each reader takes the newest one that reached it.
"""

from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.maps.roadside import roadside_place
from scm.records.city_map import CityMap
from scm.v2x.etsi.cam_spatem import SpatemBody
from scm.v2x.etsi.convert import REVISIONS, colours_of
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Colour
from scm.vehicles.drivers.channel import IDEAL, Channel, has_arrived, ideal
from scm.vehicles.jit import law

FRESH_NS = NS_PER_S
RESOLUTION_S = 0.1

COLOURS: tuple[Colour | None, ...] = (None, "green", "yellow", "red", "flashing_red", "dark")
UNKNOWN, GREEN, YELLOW, RED, FLASHING, _DARK = range(6)
_CODES = {colour: code for code, colour in enumerate(COLOURS)}
_SALT = 77


class Told(NamedTuple):
    """The arrays: j junctions, g groups counted through all of them, m frames kept of each.

    Attributes:
        newest: (j,) which of the frames kept is the newest.
        number: (m, j) of each frame, -1: there is none.
        arrived_ns: (m, j).
        flashing: (m, j) whether the frame says that the junction is out of order.
        colour: (m, g) by their place in `COLOURS`.
        min_end: (m, g) for how long the colour lasts at least [s] after arrival, NaN: unknown.
        fault: (j,) whether the monitor has found a fault.
        place: (j, 2) where the roadside units stand [m].
        channel: What the air does to SPATEMs on their way.
    """

    newest: Ints
    number: Ints
    arrived_ns: Ints
    flashing: Bools
    colour: Ints
    min_end: Floats
    fault: Bools
    place: Floats
    channel: Channel


class SignalTable:
    """The signals of one map.

    Attributes:
        told: The arrays.
        ignored: Frames of another map, or another revision of it.
    """

    def __init__(self, city_map: CityMap, kept: int = 1, channel: Channel | None = None) -> None:
        self._revision = city_map.revision % REVISIONS
        self._kept = kept
        self._junctions = {junction.number: n for n, junction in enumerate(city_map.junctions)}
        self._names = {junction.name: n for n, junction in enumerate(city_map.junctions)}
        numbers: list[dict[int, int]] = []
        count = 0
        for junction in city_map.junctions:
            numbers.append({group.number: count + k for k, group in enumerate(junction.groups)})
            count += len(junction.groups)
        self._groups = numbers
        junctions = len(numbers)
        self.told = Told(
            newest=np.zeros(junctions, np.int64),
            number=np.full((kept, junctions), -1, np.int64),
            arrived_ns=np.zeros((kept, junctions), np.int64),
            flashing=np.zeros((kept, junctions), np.bool_),
            colour=np.zeros((kept, count), np.int64),
            min_end=np.full((kept, count), np.nan),
            fault=np.zeros(junctions, np.bool_),
            place=np.array([roadside_place(city_map, j.name) for j in city_map.junctions]).reshape(
                -1, 2
            ),
            channel=channel or ideal(),
        )
        self._frames = 0
        self.ignored = 0

    def hear_spatem(self, body: SpatemBody, arrived_ns: int) -> None:
        """Take a SPATEM that arrived at `arrived_ns`; one of another map is ignored and counted."""
        junction = self._junctions.get(body.intersection)
        if junction is None or body.revision != self._revision:
            self.ignored += 1
            return
        told, groups = self.told, self._groups[junction]
        place = (int(told.newest[junction]) + 1) % self._kept
        told.newest[junction] = place
        told.number[place, junction] = self._frames
        self._frames += 1
        told.arrived_ns[place, junction] = arrived_ns
        told.flashing[place, junction] = "failureFlash" in body.status
        for group in groups.values():
            told.colour[place, group] = UNKNOWN
        for number, state in colours_of(body).items():
            group_at = groups.get(number)
            if group_at is not None:
                told.colour[place, group_at] = _CODES[state.colour]
                told.min_end[place, group_at] = (
                    np.nan if state.min_end_s is None else state.min_end_s
                )

    def hear_monitor(self, status: MonitorStatus) -> None:
        """Take the monitor's verdict on a junction; a fault stands until the monitor lifts it."""
        junction = self._names.get(status.junction)
        if junction is not None:
            self.told.fault[junction] = status.fault is not None


@law
def frame_for(told: Told, junction: int, receiver: int, now_ns: int, seed: int) -> int:
    """Return the place of the newest frame of a junction that reached a receiver, or -1."""
    kept = len(told.number)
    for older in range(kept):
        place = (told.newest[junction] - older) % kept
        number = told.number[place, junction]
        if number < 0:
            return -1
        if told.channel.numbers[IDEAL] > 0.0:
            return int(place)
        age_ns = now_ns - told.arrived_ns[place, junction]
        x, y = told.place[junction, 0], told.place[junction, 1]
        sender = -_SALT - junction
        if has_arrived(told.channel, seed, sender, receiver, number, x, y, age_ns):
            return int(place)
    return -1


@law
def believed(told: Told, group: int, junction: int, place: int, now_ns: int) -> int:
    """Return the colour to act on, by its place in `COLOURS`; 0 when nothing is to be believed.

    A green whose promised earliest end has passed counts as yellow until the next frame says that
    it goes on: a car that can stop then does.
    """
    if place < 0:
        return UNKNOWN
    age_ns = now_ns - told.arrived_ns[place, junction]
    if abs(age_ns) > FRESH_NS:
        return UNKNOWN
    if told.flashing[place, junction] or told.fault[junction]:
        return FLASHING
    colour = told.colour[place, group]
    lapsed = 1e-9 * age_ns > told.min_end[place, group] + RESOLUTION_S
    return YELLOW if colour == GREEN and lapsed else int(colour)
