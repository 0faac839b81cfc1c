"""The tick of a region: its cars move, the regions tell each other of theirs, the rest follows.

    advance   requests, drivers, dynamics and contacts of its own cars; hand out cars that leave
      |       one message to each other region, one from each: the only wait of a tick
    report    take in cars that came; sensors, reports and radio

All regions have the same cars under the same vehicle indices, and do the same with every request.
A car is moved, measured and reported by its owner alone; the others know where it is. CAMs need no
message: they say what is known of a car here, so each region sends all of them to its drivers.
"""

from collections.abc import Sequence

import numpy as np

from scm.v2x.exchange import Answer, Incoming, Outgoing, PersistedState
from scm.v2x.messages.denm import DenmTx
from scm.vehicles.drivers.channel import IDEAL
from scm.vehicles.drivers.junction_exits import MAX_CLEAR_M
from scm.vehicles.drivers.lane_graph import LaneGraph
from scm.vehicles.drivers.stop_lines import LOOK_AHEAD
from scm.world.radio import RadioCounts
from scm.world.regions.cut import Cut
from scm.world.regions.exchange import MOTION, NO_COUNTS, RegionNews, counts_of, decode, encode
from scm.world.regions.ownership import CarsSeen, Ownership
from scm.world.regions.transfer import CarTransfer, accept, hand_out
from scm.world.step import advance, report
from scm.world.world import World

MARGIN_M = 3.0  # more than a driver looks at: braking distances, car lengths, cars across a cut


class Region:
    """One region of a city that is cut.

    Args:
        world: Of the whole map, without a car yet.
        cut: Of the map, the same in all regions.
        number: Of this region.

    Attributes:
        world: What it moves.
        ownership: Which cars it owns.
    """

    def __init__(self, world: World, cut: Cut, number: int) -> None:
        self.world = world
        self._cut = cut
        # On a lossy channel it matters who is received at all, wherever that is.
        ideal = world.drivers.channel.numbers[IDEAL] > 0.0
        look_m = farthest_look_m(world.drivers.lane_graph) if ideal else None
        capacity = world.cars.arrays.capacity
        self.ownership = world.ownership = Ownership(cut, number, capacity, look_m)

    def advance(self, now_ns: int, inbox: Sequence[Incoming]) -> tuple[list[Outgoing], list[bytes]]:
        """Move the own cars to `now_ns`; return what they send, and a message for each region."""
        world = self.world
        out = [one for one in advance(world, now_ns, inbox) if self.speaks_of(one)]
        vehicles = world.cars.arrays
        own = np.flatnonzero(vehicles.hosted & ~vehicles.elsewhere)
        news = RegionNews(
            region=self.ownership.number,
            tick=world.tick,
            indices=own.astype("<i4").tobytes(),
            motion=np.stack([getattr(vehicles, name)[own] for name in MOTION]).tobytes(),
            denms=tuple(world.radio.warnings.due),
            counts=counts_of(world.radio.link.counts),
            waiting=world.radio.in_flight.later_than(now_ns),
        )
        return out, encode(news, self._hand_out(now_ns))

    def report(self, now_ns: int, messages: Sequence[bytes]) -> list[Outgoing]:
        """Take the messages of all other regions; return what the own cars report.

        Raises:
            MessageError: when a message is not of this tick, or wrong.
        """
        world, vehicles = self.world, self.world.cars.arrays
        received = [decode(body, world.tick, vehicles.capacity) for body in messages]
        due: list[DenmTx] = list(world.radio.warnings.due)
        world.radio.waiting_elsewhere, counts = 0, np.zeros(len(NO_COUNTS), int)
        for news, _ in received:
            indices = np.frombuffer(news.indices, "<i4")
            motion = np.frombuffer(news.motion).reshape(len(MOTION), -1)
            for name, values in zip(MOTION, motion, strict=True):
                getattr(vehicles, name)[indices] = values
            due += news.denms
            world.radio.waiting_elsewhere += news.waiting
            counts += news.counts
        world.radio.counts_elsewhere = RadioCounts(*counts.tolist())
        if world.radio.warnings.due or any(news.denms for news, _ in received):
            world.radio.warnings.due = sorted(due, key=lambda frame: frame.station)
        self._accept([transfer for _, transfers in received for transfer in transfers])
        self.look()
        return report(world, now_ns)

    def speaks_of(self, outgoing: Outgoing) -> bool:
        """Return whether this region sends what all regions found when they did the same.

        The owner of the car that it is about does, or the first region where it is about none.
        """
        car = self.world.cars.hosted.get(subject_of(outgoing))
        if car is None:
            return self.world.leads
        return not self.world.cars.arrays.elsewhere[car.index]

    def _hand_out(self, now_ns: int) -> list[list[CarTransfer]]:
        """Return the cars that leave, by the region that they go to."""
        ownership, names = self.ownership, self.world.cars.arrays.names
        leaving: list[list[CarTransfer]] = [[] for _ in range(self._cut.regions)]
        goes = (ownership.owner == ownership.number) & (ownership.next != ownership.number)
        for index in np.flatnonzero(goes).tolist():
            car = self.world.cars.hosted[names[index]]
            leaving[int(ownership.next[index])].append(hand_out(self.world, car, now_ns))
            ownership.moved += 1
        return leaving

    def _accept(self, transfers: Sequence[CarTransfer]) -> None:
        for transfer in sorted(transfers, key=lambda one: one.index):
            accept(self.world, transfer)
            self.ownership.moved += 1
        self.ownership.owner[:] = self.ownership.next

    def look(self) -> None:
        """Decide who owns which car next, and which of them drivers here have to look at."""
        vehicles, drivers = self.world.cars.arrays, self.world.drivers
        order = np.flatnonzero(vehicles.hosted)
        if not len(order):
            return
        seen = np.ones(vehicles.capacity, np.bool_)
        place = vehicles.x, vehicles.y, vehicles.yaw, vehicles.front
        fastest_mps = float(np.nanmax(np.abs(vehicles.speed)))
        self.ownership.decide(CarsSeen(order, *place, drivers.sizes, seen), fastest_mps)
        if self.ownership.reaches_far(vehicles.x, vehicles.y):
            seen[:] = True
        drivers.look_at(seen | ~vehicles.elsewhere)


def subject_of(outgoing: Outgoing) -> str:
    """Return the name of the car, or other station, that something to be sent is about."""
    if isinstance(outgoing, PersistedState):
        return outgoing.key if outgoing.table == "leases" else ""
    about: tuple[object, ...] = (outgoing,)
    if isinstance(outgoing, Answer):
        about = outgoing.reply, outgoing.to.message
    for one in about:
        for key in ("vehicle", "station"):
            if name := getattr(one, key, None):
                return str(name)
    return ""


def farthest_look_m(lane_graph: LaneGraph) -> float:
    """Return how far from its car a driver may look at others on an ideal channel [m]."""
    window = lane_graph.arrays.rules.window
    sides = window[:, 2:] - window[:, :2]
    widest = float(np.hypot(sides[:, 0], sides[:, 1]).max(initial=0.0))
    return widest + MAX_CLEAR_M + LOOK_AHEAD + MARGIN_M
