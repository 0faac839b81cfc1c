"""The radio: which stations receive a frame, by distance and chance.

A frame reaches other stations as `vehicles/drivers/channel.py` says. Stations are cars, and the
roadside units at their junctions. The drivers of hosted cars receive theirs in
`vehicles/drivers/driver_batch.py`; here are all other receivers.
"""

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.maps.roadside import roadside_place
from scm.records.city_map import CityMap, Point
from scm.v2x.etsi.convert import roadside_station
from scm.v2x.message import Message
from scm.vehicles.drivers.channel import (
    DELAY_NS,
    FADING,
    JITTER_NS,
    LOSS,
    RANGE,
    Channel,
    link_losses,
)
from scm.vehicles.noise import bases_of, key_of, uniforms
from scm.world.alerts import WarningState
from scm.world.cam_triggers import CamTriggers
from scm.world.channel_load import ChannelLoad


@dataclass(slots=True)
class RadioCounts:
    """Counts of frames: one frame to three stations counts three times, except in `sent`.

    Attributes:
        out_of_range: Beyond a sharp edge.
        lost: All that got lost within it: `by_chance`, `by_distance` (fading and walls) and
            `by_load` (collisions, and what a full channel never sends).
        late: How many of the delivered came later than at once; `late_ns` all they were late.
        unknown: Frames of senders whose position is unknown.
    """

    sent: int = 0
    delivered: int = 0
    out_of_range: int = 0
    lost: int = 0
    by_chance: int = 0
    by_distance: int = 0
    by_load: int = 0
    late: int = 0
    late_ns: int = 0
    unknown: int = 0


class Receivers:
    """Stations that frames are brought to.

    Attributes:
        names: Theirs, in order.
        x, y: Where their antennas are, map frame [m].
    """

    def __init__(self, places: Mapping[str, Point]) -> None:
        self.places = dict(places)
        self.names: Sequence[str] = sorted(places)
        at = np.array([places[name] for name in self.names]).reshape(-1, 2)
        self.x, self.y = np.ascontiguousarray(at.T)
        self._number = {name: number for number, name in enumerate(self.names)}

    def number(self, name: str) -> int | None:
        """Return which of them a station is; None: none."""
        return self._number.get(name)


class Burst(NamedTuple):
    """Frames of one kind that are sent at the same time, one a sender.

    Attributes:
        x, y: Where the senders' antennas are, map frame (k,) [m].
    """

    kind: str
    senders: Sequence[str]
    x: Floats
    y: Floats
    t_ns: int

    def of(self, rows: Bools) -> "Burst":
        """Return the frames of some rows (k,)."""
        senders = [name for name, wanted in zip(self.senders, rows, strict=True) if wanted]
        return self._replace(senders=senders, x=self.x[rows], y=self.y[rows])


class Radio:
    """The channel to all stations but hosted cars.

    Whether a frame is lost or late is a hash of its sender, kind and time, so it does not depend on
    which other frames anybody subscribes to: who watches a city does not change it.
    """

    def __init__(self, channel: Channel, seed: int) -> None:
        self._channel = channel
        self._seed = seed
        self._keys: dict[tuple[str, str, str], np.uint64] = {}
        self.counts = RadioCounts()

    def reach(self, burst: Burst, receivers: Receivers, load: Floats | None = None) -> Bools:
        """Return who receives the frames of a burst, (k, number of receivers).

        Nobody receives its own. `load` (n,) is the share of frames that each loses to a full
        channel.
        """
        x, y, senders = burst.x, burst.y, burst.senders
        numbers = self._channel.numbers
        sharp = numbers[FADING] <= 0.0
        near: Bools = np.hypot(receivers.x - x[:, None], receivers.y - y[:, None]) <= numbers[RANGE]
        if not sharp:
            near = np.ones_like(near)
        own = np.zeros_like(near)
        for row, sender in enumerate(senders):
            column = receivers.number(sender)
            if column is not None:
                own[row, column] = True
        near &= ~own
        received = near & ~self._lost(burst, near, receivers, load)
        counts = self.counts
        counts.sent += len(senders)
        counts.delivered += int(received.sum())
        counts.lost += int((near & ~received).sum())
        counts.out_of_range += int((~near & ~own).sum())
        return received

    def delays(self, burst: Burst, received: Bools) -> Ints:
        """Return by how much each received frame of a burst is late [ns], (k, n)."""
        numbers = self._channel.numbers
        late = np.full(received.shape, numbers[DELAY_NS])
        if numbers[JITTER_NS]:
            late += numbers[JITTER_NS] * self._luck(burst, "delay", received.shape[1])
        if late.any():
            self.counts.late += int(received.sum())
            self.counts.late_ns += int(late[received].sum())
        return late.astype(np.int64)

    def _luck(self, burst: Burst, use: str, count: int) -> Floats:
        """Return numbers from 0 to 1 for each frame and receiver, (k, count)."""
        keys, names = self._keys, [(use, burst.kind, sender) for sender in burst.senders]
        for name in names:
            if name not in keys:
                keys[name] = key_of(self._seed, "radio", *name)
        bases = bases_of(
            np.array([keys[name] for name in names], np.uint64),
            np.full(len(names), burst.t_ns, np.int64),
        )
        return uniforms(bases, count)

    def _lost(self, burst: Burst, near: Bools, receivers: Receivers, load: Floats | None) -> Bools:
        """Return which frames to near receivers get lost, and count why."""
        numbers, walls, x, y = self._channel.numbers, self._channel.walls, burst.x, burst.y
        link = np.zeros(near.shape)
        if numbers[FADING] or len(walls):
            places = (np.ascontiguousarray(x), np.ascontiguousarray(y))
            link_losses(numbers, walls, *places, receivers.x, receivers.y, link)
        busy = np.zeros(near.shape[1]) if load is None else load
        if not (numbers[LOSS] or link.any() or busy.any()):
            return np.zeros_like(near)
        luck = self._luck(burst, "loss", near.shape[1])
        by_chance = np.full(near.shape, numbers[LOSS])
        by_distance = by_chance + (1.0 - by_chance) * link
        by_load = by_distance + (1.0 - by_distance) * busy
        counts = self.counts
        counts.by_chance += int((near & (luck < by_chance)).sum())
        counts.by_distance += int((near & (luck >= by_chance) & (luck < by_distance)).sum())
        counts.by_load += int((near & (luck >= by_distance) & (luck < by_load)).sum())
        lost: Bools = luck < by_load
        return lost


def roadside_places(city_map: CityMap) -> dict[str, Point]:
    """Return where the roadside units stand: amid the lights of their junctions.

    A junction without lights gets the middle of the floor.
    """
    return {
        roadside_station(junction.name): roadside_place(city_map, junction.name)
        for junction in city_map.junctions
    }


class DelayQueue:
    """Delayed frames by their arrival time; equal times keep the order of `put`."""

    def __init__(self) -> None:
        self._waiting: list[tuple[int, int, Message]] = []
        self._count = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, due_ns: int, frame: Message) -> None:
        """Add a frame that arrives at a time."""
        self._count += 1
        heapq.heappush(self._waiting, (due_ns, self._count, frame))

    def waiting(self) -> list[tuple[int, Message]]:
        """Return all frames with their arrival times, in order of arrival."""
        return [(due_ns, frame) for due_ns, _, frame in sorted(self._waiting, key=itemgetter(0, 1))]

    def later_than(self, now_ns: int) -> int:
        """Return how many frames arrive after a time."""
        return sum(due_ns > now_ns for due_ns, _, _ in self._waiting)

    def arrived(self, now_ns: int) -> list[Message]:
        """Return and forget the frames that have arrived by now."""
        frames = []
        while self._waiting and self._waiting[0][0] <= now_ns:
            frames.append(heapq.heappop(self._waiting)[2])
        return frames


@dataclass(slots=True)
class RadioState:
    """The radio of the city.

    Attributes:
        link: Decides which frames reach everybody except the drivers of hosted cars.
        load: How busy the channel is.
        cams: When hosted cars must send a CAM.
        roadside: Where the roadside units stand, by station.
        units: These as receivers.
        in_flight: Frames that arrive later.
        published: The counts at the last `RadioStatus`.
        warnings: Warnings on the air.
        counts_elsewhere, waiting_elsewhere: What other regions of the city count, and how many
            frames arrive later there.
    """

    link: Radio
    load: ChannelLoad
    cams: CamTriggers
    roadside: dict[str, Point]
    units: Receivers
    in_flight: DelayQueue = field(default_factory=DelayQueue)
    published: RadioCounts = field(default_factory=RadioCounts)
    warnings: WarningState = field(default_factory=WarningState)
    counts_elsewhere: RadioCounts = field(default_factory=RadioCounts)
    waiting_elsewhere: int = 0

    def counts(self) -> RadioCounts:
        """Return the counts of the whole city."""
        parts = astuple(self.link.counts), astuple(self.counts_elsewhere)
        return RadioCounts(*map(sum, zip(*parts, strict=True)))
