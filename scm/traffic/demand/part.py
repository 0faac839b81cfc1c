"""The demand part: spawns cars as a table says, sends them on their way, and removes them.

A car whose time has come enters as soon as there is room; until then it waits in the entry's queue
and counts as queued. Its route is the quickest one at the lanes' speed limits. At its end the car
is removed.
"""

import heapq
from collections import defaultdict, deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.errors import DemandError, nearest
from scm.maps.route import MAX_PASSES, roads_of
from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, Subscription
from scm.traffic.demand.table import Flow, departures
from scm.v2x.exchange import Call, Incoming, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.demand_status import DemandStatus
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.trip import Trip

PERIOD_NS = 100 * NS_PER_MS
RETRY_NS = 500 * NS_PER_MS  # of an entry without room
STATUS_EVERY_NS = NS_PER_S
NO_ROOM = ("occupied", "full", "timeout", "unreachable")
NAME_IN_USE = "owned"


@dataclass(slots=True)
class _Departure:
    """A car that is to enter."""

    due_ns: int
    car: str
    entry: str
    route: tuple[str, ...]
    vehicle: str = ""


@dataclass(slots=True)
class _Entry:
    """A spawn place, who waits for it, and when to try again."""

    waiting: deque[_Departure] = field(default_factory=deque)
    next_ns: int = 0
    is_spawning: bool = False


class DemandPart(BasePart):
    """Serves a demand table; see `scm.runtime.part.Part`.

    Args:
        city_map: Where they drive.
        flows: The table.
        time_of_day_s: At its first step; None: when the first row begins.

    Attributes:
        status: What came of it so far.

    Raises:
        DemandError: a row's ends are unknown, or there is no way between them.
    """

    def __init__(
        self, city_map: CityMap, flows: Sequence[Flow], time_of_day_s: float | None = None
    ) -> None:
        self.name = "demand"
        self.role = "part"
        self.period_ns = PERIOD_NS
        self.subscriptions = (Subscription(Trip),)
        ways = Ways(city_map)
        self._flows = [
            (flow, *ways.of(flow, flow.name or f"row {n}")) for n, flow in enumerate(flows, start=1)
        ]
        self._begin_s = (
            min(flow.begin_s for flow in flows) if time_of_day_s is None else time_of_day_s
        )
        self._start_ns: int | None = None
        self._due: list[_Departure] = []
        self._entries: dict[str, _Entry] = defaultdict(_Entry)
        self._spawning: dict[str, _Departure] = {}
        self._under_way: dict[str, tuple[_Departure, int]] = {}
        self._numbers = 0
        self._next_status_ns = 0
        self._waited_ns = self._travelled_ns = 0
        self.status = DemandStatus(
            t_ns=0, time_of_day_s=self._begin_s, wanted=0, entered=0, arrived=0, refused=0,
            queued=0, longest_queue=0, waited_s=0.0, travel_s=0.0,
        )  # fmt: skip
        self._counts = {"wanted": 0, "entered": 0, "arrived": 0, "refused": 0}

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Handle replies and arrivals, spawn cars that have room, publish the status."""
        if self._start_ns is None:
            self._open(now_ns)
        outbox: list[Outgoing] = []
        for item in inbox:
            if item.call is not None:
                outbox += self._answered(item.call, item.message, now_ns)
            elif isinstance(item.message, Trip):
                outbox += self._receive_trip(item.message, now_ns)
        self._queue_up(now_ns)
        for name, entry in self._entries.items():
            outbox += self._let_in(name, entry, now_ns)
        if now_ns >= self._next_status_ns:
            self._next_status_ns = now_ns + STATUS_EVERY_NS
            outbox.append(self._current_status(now_ns))
        return outbox

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Remove its cars."""
        cars = [*self._under_way]
        self._under_way.clear()
        return [*(_removal(name, "the demand ends") for name in cars), self._current_status(now_ns)]

    def _open(self, now_ns: int) -> None:
        self._start_ns = now_ns
        found = [
            _Departure(now_ns + round((at_s - self._begin_s) * NS_PER_S), flow.car, entry, route)
            for number, (flow, entry, route) in enumerate(self._flows)
            for at_s in departures(flow, number, self._begin_s)
        ]
        self._due = sorted(found, key=lambda departure: departure.due_ns, reverse=True)

    def _queue_up(self, now_ns: int) -> None:
        while self._due and self._due[-1].due_ns <= now_ns:
            departure = self._due.pop()
            self._counts["wanted"] += 1
            self._entries[departure.entry].waiting.append(departure)

    def _let_in(self, name: str, entry: _Entry, now_ns: int) -> list[Outgoing]:
        if not entry.waiting or entry.is_spawning or now_ns < entry.next_ns:
            return []
        departure = entry.waiting[0]
        self._numbers += 1
        departure.vehicle = f"d{self._numbers}"
        entry.is_spawning = True
        self._spawning[departure.vehicle] = departure
        return [Call(SpawnRequest(vehicle=departure.vehicle, car=departure.car, spawn=name))]

    def _answered(self, call: Call, reply: Message, now_ns: int) -> list[Outgoing]:
        request = call.request
        if isinstance(request, SpawnRequest):
            return self._spawned(self._spawning.pop(request.vehicle), reply, now_ns)
        if isinstance(request, RouteRequest) and not isinstance(reply, RouteReply):
            self._under_way.pop(request.vehicle, None)
            self._counts["refused"] += 1
            return [_removal(request.vehicle, "no way"), _warn(request.vehicle, reply, now_ns)]
        return []

    def _spawned(self, departure: _Departure, reply: Message, now_ns: int) -> list[Outgoing]:
        entry = self._entries[departure.entry]
        entry.is_spawning = False
        if isinstance(reply, SpawnReply):
            entry.waiting.popleft()
            self._counts["entered"] += 1
            self._waited_ns += now_ns - departure.due_ns
            self._under_way[departure.vehicle] = (departure, now_ns)
            trip_id = f"demand-{departure.vehicle}-{now_ns}"
            name, via = departure.vehicle, departure.route
            return [Call(RouteRequest(request_id=trip_id, vehicle=name, via=via))]
        code = reply.code if isinstance(reply, Refused) else ""
        if code == NAME_IN_USE:
            return []
        if code in NO_ROOM:
            entry.next_ns = now_ns + RETRY_NS
            return []
        entry.waiting.popleft()
        self._counts["refused"] += 1
        return [_warn(departure.vehicle, reply, now_ns)]

    def _receive_trip(self, trip: Trip, now_ns: int) -> list[Outgoing]:
        """Remove a car whose trip has ended."""
        if trip.arrived_ns is None or trip.vehicle not in self._under_way:
            return []
        if not trip.trip_id.startswith(f"demand-{trip.vehicle}-"):
            return []
        _, began_ns = self._under_way.pop(trip.vehicle)
        self._counts["arrived"] += 1
        self._travelled_ns += trip.arrived_ns - began_ns
        return [_removal(trip.vehicle, "arrived")]

    def _current_status(self, now_ns: int) -> DemandStatus:
        queued = sum(len(entry.waiting) for entry in self._entries.values())
        began_ns = now_ns if self._start_ns is None else self._start_ns
        counts = self._counts
        self.status = DemandStatus(
            t_ns=now_ns,
            time_of_day_s=self._begin_s + seconds(now_ns - began_ns),
            queued=queued,
            longest_queue=max(queued, self.status.longest_queue),
            waited_s=seconds(self._waited_ns) / max(1, counts["entered"]),
            travel_s=seconds(self._travelled_ns) / max(1, counts["arrived"]),
            **counts,
        )
        return self.status


class Ways:
    """Finds the entries and lanes of a map that a table names."""

    def __init__(self, city_map: CityMap) -> None:
        self._roads = roads_of(city_map)
        self._map = city_map.name
        self._lanes = {lane.name: lane for lane in city_map.lanes}
        self._edges: dict[str, list[str]] = {}
        for lane in self._lanes:
            edge, _, number = lane.rpartition("_")
            if edge and number.isdigit():
                self._edges.setdefault(edge, []).append(lane)
        self._entries: dict[str, tuple[float, str]] = {}
        self._spawns: dict[str, str] = {}
        for spawn in city_map.spawns:
            if spawn.lane is None or spawn.at_m is None:
                continue
            self._spawns[spawn.name] = spawn.lane
            first = self._entries.get(spawn.lane)
            if first is None or spawn.at_m < first[0]:
                self._entries[spawn.lane] = (spawn.at_m, spawn.name)

    def of(self, flow: Flow, where: str) -> tuple[str, tuple[str, ...]]:
        """Return the spawn place and the lanes of the quickest way of a row.

        Raises:
            DemandError: there is no such place or no way.
        """
        goals = [self._named(name, f"{where}: via") for name in flow.via]
        goals.append(self._named(flow.end, f"{where}: to"))
        if flow.start in self._spawns:
            entries = {self._spawns[flow.start]: flow.start}
        else:
            lanes = self._named(flow.start, f"{where}: from")
            entries = {lane: self._entries[lane][1] for lane in lanes if lane in self._entries}
        if not entries:
            raise DemandError(f"{where}: from: {flow.start!r} has no spawn place to enter at")
        route = self._quickest(entries, goals)
        if route is None or len(route) > MAX_PASSES:
            what = "no way" if route is None else f"a way of over {MAX_PASSES} lanes"
            via = f" by {', '.join(map(repr, flow.via))}" if flow.via else ""
            raise DemandError(f"{where}: {what} from {flow.start!r}{via} to {flow.end!r}")
        return entries[route[0]], route

    def _named(self, name: str, where: str) -> tuple[str, ...]:
        """Return the lane of a name, or the lanes of an edge."""
        found = self._edges.get(name, ())
        if name in self._lanes and found:
            msg = f"{where}: {name!r} is a lane and an edge (lane {found[0]!r}): rename the edge"
            raise DemandError(msg)
        if name in self._lanes:
            return (name,)
        if not found:
            hint = nearest(name, [*self._lanes, *self._spawns, *sorted(self._edges)])
            msg = f"{where}: map {self._map} has no lane or edge {name!r}{hint}"
            raise DemandError(msg)
        return tuple(found)

    def _quickest(
        self, starts: Iterable[str], goals: Sequence[Sequence[str]]
    ) -> tuple[str, ...] | None:
        """Return the quickest way that passes a lane of each goal, one after the other."""
        queue: list[tuple[float, int, tuple[str, ...]]] = [
            (self._time_s(lane), 0, (lane,)) for lane in sorted(starts)
        ]
        done: set[tuple[int, str]] = set()
        heapq.heapify(queue)
        while queue:
            elapsed_s, reached, lanes = heapq.heappop(queue)
            reached += lanes[-1] in goals[reached]
            if reached == len(goals):
                return lanes
            if (reached, lanes[-1]) in done:
                continue
            done.add((reached, lanes[-1]))
            for following in self._roads.successors(lanes[-1]):
                if (reached, following) not in done:
                    way = (elapsed_s + self._time_s(following), reached, (*lanes, following))
                    heapq.heappush(queue, way)
        return None

    def _time_s(self, lane: str) -> float:
        return self._roads.length_of(lane) / self._lanes[lane].speed_limit_mps


def _removal(vehicle: str, reason: str) -> Call:
    return Call(RemoveRequest(vehicle=vehicle, reason=reason))


def _warn(vehicle: str, reply: Message, now_ns: int) -> CityEvent:
    detail = reply.detail if isinstance(reply, Refused) else type(reply).__name__
    text = f"{vehicle} could not drive as the demand wants: {detail}"
    return CityEvent(
        severity="warning", source="demand", t_ns=now_ns, name="demand_refused", text=text
    )
