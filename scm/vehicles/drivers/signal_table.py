"""The last received SPATEMs and monitor states of each junction.

One table serves one car or a whole batch of drivers. On a lossy channel it stores the last few
frames, and each driver uses the newest one that reached it.
"""

import math

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.maps.roadside import roadside_place
from scm.records.city_map import CityMap
from scm.records.signals import Colour
from scm.v2x.etsi.cam_spatem import SpatemBody
from scm.v2x.etsi.convert import REVISIONS, colours_of
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.drivers.channel import IDEAL, Channel, has_arrived, ideal
from scm.vehicles.jit import kernel_function, plain

MAX_AGE_NS = NS_PER_S  # SPATEMs come at 10 Hz
RESOLUTION_S = 0.1  # of a SPATEM's times

COLOURS: tuple[Colour | None, ...] = (None, "green", "yellow", "red", "flashing_red", "dark")
UNKNOWN, GREEN, YELLOW, RED, FLASHING, _DARK = range(6)
_CODES = {colour: code for code, colour in enumerate(COLOURS)}
_SPATEM_SALT = 77  # sender ids of roadside units, apart from those of cars and hazards


class ReceivedSignals(ArrayStruct):
    """The arrays: j junctions, g signal groups over all junctions, m stored frames per junction.

    Attributes:
        newest: (j,) row of the newest frame.
        number: (m, j) sequence number of each frame; -1: none.
        arrived_ns: (m, j) reception times.
        flashing: (m, j) whether the frame reports a junction out of order.
        colour: (m, g) index into `COLOURS`.
        min_end: (m, g) minimum remaining time of the colour at reception [s]; NaN: unknown.
        fault: (j,) whether the monitor has latched a fault.
        place: (j, 2) position of the roadside unit [m].
        channel: The radio channel of SPATEMs.
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
    """The signals of one map, as received.

    Attributes:
        received: The arrays.
        ignored: Number of frames of another map, or of another revision of it.
    """

    def __init__(self, city_map: CityMap, history: int = 1, channel: Channel | None = None) -> None:
        self._revision = city_map.revision % REVISIONS
        self._history = history
        junctions = city_map.junctions
        self._junctions = {junction.number: n for n, junction in enumerate(junctions)}
        self._names = {junction.name: n for n, junction in enumerate(junctions)}
        groups = [(junction, group) for junction in junctions for group in junction.groups]
        self._group_names = {(j.name, group.name): n for n, (j, group) in enumerate(groups)}
        self._groups: list[dict[int, int]] = [{} for _ in junctions]
        for n, (junction, group) in enumerate(groups):
            self._groups[self._names[junction.name]][group.number] = n
        shape = history, len(junctions)
        self.received = ReceivedSignals(
            newest=np.zeros(len(junctions), np.int64),
            number=np.full(shape, -1, np.int64),
            arrived_ns=np.zeros(shape, np.int64),
            flashing=np.zeros(shape, np.bool_),
            colour=np.zeros((history, len(groups)), np.int64),
            min_end=np.full((history, len(groups)), np.nan),
            fault=np.zeros(len(junctions), np.bool_),
            place=np.array([roadside_place(city_map, j.name) for j in junctions]).reshape(-1, 2),
            channel=channel or ideal(),
        )
        self._frames = 0
        self.ignored = 0

    def receive_spatem(self, body: SpatemBody, arrived_ns: int) -> None:
        """Store a SPATEM that arrived at `arrived_ns`; count and ignore one of another map."""
        junction = self._junctions.get(body.intersection)
        if junction is None or body.revision != self._revision:
            self.ignored += 1
            return
        received, groups = self.received, self._groups[junction]
        place = (int(received.newest[junction]) + 1) % self._history
        received.newest[junction] = place
        received.number[place, junction] = self._frames
        self._frames += 1
        received.arrived_ns[place, junction] = arrived_ns
        received.flashing[place, junction] = "failureFlash" in body.status
        for group in groups.values():
            received.colour[place, group] = UNKNOWN
        for number, state in colours_of(body).items():
            group_at = groups.get(number)
            if group_at is not None:
                received.colour[place, group_at] = _CODES[state.colour]
                received.min_end[place, group_at] = (
                    np.nan if state.min_end_s is None else state.min_end_s
                )

    def receive_monitor_status(self, status: MonitorStatus) -> None:
        """Store a junction's fault state; a fault stays until the monitor clears it."""
        junction = self._names.get(status.junction)
        if junction is not None:
            self.received.fault[junction] = status.fault is not None

    def colour(self, junction: str, group: str, now_ns: int) -> Colour | None:
        """Return the colour to act on, or None without usable data; see `usable_colour`."""
        number = self._group_names.get((junction, group))
        if number is None:
            return None
        at, received = self._names[junction], self.received
        place = int(received.newest[at]) if received.number[received.newest[at], at] >= 0 else -1
        colour: Colour | None = COLOURS[_usable_colour(received, number, at, place, now_ns)]
        return colour

    def may_go(self, junction: str, group: str, now_ns: int) -> bool:
        """Return whether a car may pass the group's stop line now."""
        return self.colour(junction, group, now_ns) == "green"

    def time_to_change(self, junction: str, group: str, now_ns: int) -> float | None:
        """Return the minimum time until the colour changes [s], or None when unknown."""
        if self.colour(junction, group, now_ns) in (None, "flashing_red"):
            return None
        at, received = self._names[junction], self.received
        place = received.newest[at]
        min_end = float(received.min_end[place, self._group_names[junction, group]])
        if math.isnan(min_end):
            return None
        return max(0.0, min_end - 1e-9 * int(now_ns - received.arrived_ns[place, at]))


@kernel_function
def frame_for(
    received: ReceivedSignals, junction: int, receiver: int, now_ns: int, seed: int
) -> int:
    """Return the row of the newest frame of a junction that reached a receiver, or -1."""
    history = len(received.number)
    for older in range(history):
        place = (received.newest[junction] - older) % history
        number = received.number[place, junction]
        if number < 0:
            return -1
        if received.channel.numbers[IDEAL] > 0.0:
            return int(place)
        age_ns = now_ns - received.arrived_ns[place, junction]
        x, y = received.place[junction, 0], received.place[junction, 1]
        sender = -_SPATEM_SALT - junction
        if has_arrived(received.channel, seed, sender, receiver, number, x, y, age_ns):
            return int(place)
    return -1


@kernel_function
def usable_colour(
    received: ReceivedSignals, group: int, junction: int, place: int, now_ns: int
) -> int:
    """Return the colour to act on as an index into `COLOURS`; UNKNOWN without usable data.

    A green counts as yellow once its guaranteed time has passed, until the next frame confirms it:
    a car that can stop then stops.
    """
    if place < 0:
        return UNKNOWN
    age_ns = now_ns - received.arrived_ns[place, junction]
    if abs(age_ns) > MAX_AGE_NS:
        return UNKNOWN
    if received.flashing[place, junction] or received.fault[junction]:
        return FLASHING
    colour = received.colour[place, group]
    lapsed = 1e-9 * age_ns > received.min_end[place, group] + RESOLUTION_S
    return YELLOW if colour == GREEN and lapsed else int(colour)


_usable_colour = plain(usable_colour)
