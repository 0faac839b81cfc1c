"""Any number of drivers over one map: who is where, who was sent where, and what all decide now.

A car is a slot, a number below the capacity. Some slots are driven here, others are only seen: a
car with a driver of its own is shown to the crowd by what it tells on the air.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.errors import MapError
from scm.geometry import Pose2
from scm.maps.segments import wall_segments
from scm.records.city_map import RadioChannel
from scm.v2x.etsi.cam_spatem import SpatemBody
from scm.v2x.etsi.denm import DenmBody
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers import memory as m
from scm.vehicles.drivers.ahead import Scratch, scratch
from scm.vehicles.drivers.channel import channel_of, frames_kept
from scm.vehicles.drivers.green_light import HORIZON
from scm.vehicles.drivers.lane_tracking import look_from
from scm.vehicles.drivers.law import decide
from scm.vehicles.drivers.order import note_standing
from scm.vehicles.drivers.signal_table import SignalTable
from scm.vehicles.drivers.stations import find_cells, hear_cams, nobody
from scm.vehicles.drivers.streets import Streets
from scm.vehicles.drivers.warned import Warnings
from scm.vehicles.drivers.way_back import FARTHEST_M, FREE, free_way, walls_near

PACKED_FROM = 4096
WORTH_THREADS = 256


class Crowd:
    """The drivers of many cars; see the module.

    Args:
        streets: The lanes of the map.
        capacity: How many slots there are.
        seed: Of the luck of radio frames.
        radio: What the air does to frames; None: nothing.

    Attributes:
        throttle: (capacity,) last decided, -1 to 1; likewise `steering`, + = left.
        channel: What the air does to frames on their way to the drivers.
        signals: What is told of the signals.
        threads: How many work on large crowds; what is decided does not depend on it.
        horizon: From how far before a line speed is chosen for its next green [m]; 0: never.
    """

    def __init__(
        self, streets: Streets, capacity: int, *, seed: int = 0, radio: RadioChannel | None = None
    ) -> None:
        city_map = streets.roads.city_map
        self.streets = streets
        self.capacity = capacity
        self._seed = seed
        self._memory = m.empty_memory(capacity)
        radio = radio or RadioChannel()
        self._walls = wall_segments(city_map)
        self.channel = channel_of(
            radio, radio.range_m or city_map.radio_range_m, capacity, self._walls
        )
        kept = frames_kept(radio)
        self._heard = nobody(city_map, capacity, kept, self.channel)
        self.signals = SignalTable(city_map, kept, self.channel)
        self._warnings = Warnings(self.channel)
        self.threads = 1
        self.horizon = HORIZON if city_map.speed_advice else 0.0
        self._rooms = [scratch()]
        self._pool: ThreadPoolExecutor | None = None
        self._poses = self.channel.poses
        self._commands = np.zeros((2, capacity))
        self._kinds: dict[CarLimits, int] = {}
        self._entered = np.zeros(capacity, np.bool_)
        self._sent = np.zeros(capacity, np.bool_)
        self._routes_used = 0
        self.throttle: Floats = self._commands[0]
        self.steering: Floats = self._commands[1]

    def warm(self) -> None:
        """Compile or load now what driving needs; call it before the first car enters."""
        self.warm_law()
        self.warm_rest()

    def warm_law(self) -> None:
        """Compile or load what decides: the larger part."""
        self._decide(np.zeros(0, np.int64), 0, self.signals, stop=False)

    def warm_rest(self) -> None:
        """Compile or load what hears and sets out."""
        nobody: Ints = np.zeros(0, np.int64)
        none: Floats = np.zeros(0)
        self.hear(nobody, 0, none, none, none, none, none)
        if self.capacity and self.streets.names:
            look_from(self.streets.ways, self._memory, 0, 0)
            self._memory.sight[0] = -1
            kinds = np.zeros((1, m.SPEEDS + m.MOST_SPEEDS))
            alone = m.empty_memory(1)._replace(kinds=kinds, routes=np.zeros(1, np.int64))
            alone.sight[0, m.HERE] = 0
            free_way(self.streets.ways, alone, self._rooms[0], np.zeros((0, 4)), 0.0, 0.0, 0.0)

    @property
    def lane(self) -> Ints:
        """Lane of each car, as a place in `streets.names`; -1 before it was sent."""
        return self._memory.sight[:, m.HERE]

    @property
    def s(self) -> Floats:
        """Where each rear axle is along its lane [m]."""
        return self._memory.floats[:, m.S]

    @property
    def cross_track(self) -> Floats:
        """How far each rear axle is beside its lane's middle [m], + = left."""
        return self._memory.floats[:, m.BESIDE]

    @property
    def done_m(self) -> Floats:
        """How far each car has driven along its way since it was sent [m]."""
        return self._memory.floats[:, m.DONE]

    @property
    def arrived(self) -> Bools:
        """Whether each car's route is done; never that of a car that goes round."""
        return self._memory.ints[:, m.ARRIVED] > 0

    @property
    def waiting(self) -> Ints:
        """What holds each car at rest, as a place in `memory.WAITING_FOR`."""
        return self._memory.ints[:, m.WAITING]

    @property
    def turn(self) -> Ints:
        """Where each car's way turns next: 1 left, -1 right, 0 neither."""
        return self._memory.ints[:, m.TURN]

    @property
    def passed(self) -> Ints:
        """How many lanes of its way each car has passed since it was sent."""
        return self._memory.ints[:, m.INDEX]

    def enter(self, slot: int, limits: CarLimits, seed: int = 0) -> None:
        """Put a driver into a car; it stands until it is sent.

        Args:
            slot: The car's.
            limits: What the driver must know of it.
            seed: Decides where it turns while it circulates.
        """
        self.leave(slot)
        if limits not in self._kinds:
            row = m.kind_row(limits, self.streets.sharpest_change(limits.wheelbase))
            kinds = np.vstack([self._memory.kinds, row])
            self._memory = self._memory._replace(kinds=kinds)
            self._kinds[limits] = len(kinds) - 1
        ints = self._memory.ints[slot]
        ints[m.KIND], ints[m.SEED], ints[m.LAST_NS] = self._kinds[limits], seed, m.NEVER_NS
        self._memory.floats[slot] = 0.0
        self._entered[slot] = True
        self.show(slot, limits.length, limits.width)

    def show(self, slot: int, length: float, width: float) -> None:
        """Let others see a car as an outline of this size [m], once it speaks."""
        self._heard.size[slot] = length, width

    def leave(self, slot: int) -> None:
        """Take a car away, its driver and its outline."""
        self._entered[slot] = self._sent[slot] = False
        self._heard.size[slot] = 0.0
        self._heard.number[:, slot] = -1
        self._memory.stood[slot] = m.NEVER_NS
        self._memory.sight[slot] = -1
        self._memory.ints[slot, m.COUNT] = 0
        self._commands[:, slot] = 0.0

    def send(
        self,
        slot: int,
        lanes: Sequence[str],
        s: float,
        after: str = "stop",
        speed: float | None = None,
        first: int = 0,
    ) -> None:
        """Send a car along lanes, without a jerk if it drives already.

        Args:
            slot: The car's.
            lanes: In driving order.
            s: Where on its lane the rear axle is, roughly [m].
            after: What comes after the last lane: `stop` at its end, `loop` to the first one, or
                `circulate`, any lane that follows.
            speed: Wished on free road [m/s]; None: what lanes and curves allow.
            first: Which of the lanes the car is on.

        Raises:
            MapError: when there is no such lane.
        """
        numbers = [self._number(name) for name in lanes]
        ints, floats = self._memory.ints[slot], self._memory.floats[slot]
        at = self._lay(numbers, slot)
        ints[m.ROUTE], ints[m.COUNT], ints[m.INDEX] = at, len(numbers), first
        ints[m.AFTER] = m.AFTERS.index(after)
        ints[m.GOAL] = m.NO_GOAL if after == "loop" else len(numbers) - 1
        ints[m.GOING_LINE], ints[m.RULE_LINE], ints[m.ARRIVED] = -1, -1, 0
        floats[m.S], floats[m.DONE] = s, 0.0
        floats[m.TOLD] = np.inf if speed is None else speed
        look_from(self.streets.ways, self._memory, slot, numbers[first])
        self._sent[slot] = True

    def wall_ahead(
        self,
        slot: int,
        lanes: Sequence[str],
        s: float,
        pose: Pose2,
        after: str = "stop",
        speed: float | None = None,
    ) -> float | None:
        """Return how far a car would get before it hits a wall beside its lane [m]; None: it won't.

        Nothing changes; the arguments are those of `send`, and the pose of the car's rear axle.

        Raises:
            MapError: when there is no such lane.
        """
        numbers = [self._number(name) for name in lanes]
        memory, route = m.empty_memory(1), np.array(numbers, np.int64)
        memory = memory._replace(kinds=self._memory.kinds, routes=route)
        memory.ints[0], memory.floats[0] = self._memory.ints[slot], self._memory.floats[slot]
        ints, floats = memory.ints[0], memory.floats[0]
        ints[m.ROUTE], ints[m.COUNT], ints[m.INDEX] = 0, len(numbers), 0
        ints[m.AFTER] = m.AFTERS.index(after)
        floats[m.S], floats[m.TOLD] = s, np.inf if speed is None else speed
        look_from(self.streets.ways, memory, 0, numbers[0])
        x, y, yaw = pose
        kind = memory.kinds[ints[m.KIND]]
        walls = walls_near(self._walls, x, y, FARTHEST_M + kind[m.FRONT] + kind[m.REAR])
        gone = free_way(self.streets.ways, memory, self._rooms[0], walls, x, y, yaw)
        return None if gone == FREE else gone

    def circulate(
        self, slot: int, lane: str, s: float, speed: float | None = None
    ) -> tuple[str, ...]:
        """Send a car round without end, at each junction where its own seed takes it.

        Returns:
            The lanes it takes first; where there is no choice, those of its whole round.

        Raises:
            MapError: when there is no such lane, or it leads nowhere.
        """
        number = self._number(lane)
        if not self.streets.goes_round[number]:
            self.streets.roads.loop(lane)  # says what is wrong
        self.send(slot, (lane,), s, "circulate", speed)
        return self.go_on(slot)

    def go_on(self, slot: int) -> tuple[str, ...]:
        """Let a car circulate from where it is; return as `circulate` does."""
        self._memory.ints[slot, m.GOAL] = m.NO_GOAL
        self._memory.ints[slot, m.ARRIVED] = 0
        self._memory.floats[slot, m.DONE] = 0.0
        if self._memory.ints[slot, m.AFTER] != m.CIRCULATE:
            msg = f"slot {slot} was not sent to circulate"
            raise ValueError(msg)
        lane = self.streets.names[self.lane[slot]]
        return self.streets.round_from(lane) or self.in_sight(slot)

    def halt(self, slot: int) -> None:
        """Take a car off its way; it is not driven before it is sent again."""
        self._sent[slot] = False

    def in_sight(self, slot: int) -> tuple[str, ...]:
        """Return the lanes of a car's way from the one it is on, as far as it has decided."""
        return tuple(self.streets.names[n] for n in self._memory.sight[slot, m.HERE :] if n >= 0)

    def is_in_junction(self, slots: Ints) -> Bools:
        """Return which of some cars (k,) have their middle where nobody may stop."""
        s, lanes = self.s[slots], self.lane[slots]
        kinds = self._memory.kinds[self._memory.ints[slots, m.KIND]]
        middle = s + 0.5 * (kinds[:, m.FRONT] - kinds[:, m.REAR])
        within = self.streets.forbidden[lanes]
        at = middle[:, None]
        inside: Bools = ((within[:, :, 0] <= at) & (at <= within[:, :, 1])).any(axis=1)
        return inside & (lanes >= 0)

    def hear(
        self,
        slots: Ints,
        now_ns: int,
        x: Floats,
        y: Floats,
        yaw: Floats,
        speed: Floats,
        yaw_rate: Floats,
    ) -> None:
        """Take what cars tell on the air now, shape (k,): of the middle of their front bumpers."""
        cams = np.column_stack((x, y, yaw, speed, yaw_rate))
        stations = np.asarray(slots, np.int64)
        note_standing(self._memory.stood, self._memory.stood_at, stations, now_ns, cams)
        hear_cams(self._heard, stations, now_ns, cams)

    def hear_spatem(self, body: SpatemBody, now_ns: int) -> None:
        """Take a SPATEM that is on the air now."""
        self.signals.hear_spatem(body, now_ns)

    def hear_denm(self, body: DenmBody, now_ns: int) -> None:
        """Take a warning that is on the air now."""
        self._warnings.hear(body, now_ns)

    def hear_monitor(self, status: MonitorStatus) -> None:
        """Take the monitor's verdict on a junction."""
        self.signals.hear_monitor(status)

    def decide(
        self,
        now_ns: int,
        x: Floats,
        y: Floats,
        yaw: Floats,
        speed: Floats,
        driven: Bools,
        *,
        stop: bool = False,
    ) -> None:
        """Let the drivers of the cars that are `driven` decide; the others keep their commands.

        Args:
            now_ns: The present time [ns].
            x: Of each rear axle, map frame, by slot; likewise `y` and `yaw`.
            y: See `x`.
            yaw: See `x`.
            speed: Along each body [m/s].
            driven: Whose driver drives, by slot; cars that were never sent are left out.
            stop: Whether all must come to rest in their lanes, wherever they are.
        """
        poses = self._poses
        poses[:, 0], poses[:, 1], poses[:, 2], poses[:, 3] = x, y, yaw, speed
        cars = np.flatnonzero(driven & self._sent)
        self._decide(cars, now_ns, self.signals, stop=stop)

    def decide_alone(
        self,
        slot: int,
        now_ns: int,
        pose: tuple[float, float, float, float],
        signals: SignalTable,
        *,
        stop: bool,
    ) -> tuple[float, float]:
        """Return (throttle, steering) of one car by signals that it alone has heard.

        Args:
            slot: The car's.
            now_ns: The present time [ns].
            pose: x, y, yaw of its rear axle and speed along its body.
            signals: What it knows of them.
            stop: Whether it must come to rest.
        """
        self._poses[slot] = pose
        self._decide(np.array([slot], np.int64), now_ns, signals, stop=stop)
        return float(self.throttle[slot]), float(self.steering[slot])

    def _decide(self, cars: Ints, now_ns: int, signals: SignalTable, *, stop: bool) -> None:
        find_cells(self._heard, now_ns)

        def part(cars: Ints, room: Scratch) -> None:
            decide(
                self.streets.ways,
                self._memory,
                self._heard,
                signals.told,
                room,
                cars,
                self._poses,
                self._commands,
                now_ns,
                bool(stop),
                self._seed,
                self.horizon,
                self._warnings.warned,
            )

        if self.threads == 1 or len(cars) < WORTH_THREADS:
            part(cars, self._rooms[0])
            return
        if self._pool is None or len(self._rooms) != self.threads:
            self._pool = ThreadPoolExecutor(self.threads)
            self._rooms = [scratch() for _ in range(self.threads)]
        for _ in self._pool.map(part, np.array_split(cars, self.threads), self._rooms):
            pass

    def _number(self, lane: str) -> int:
        number = self.streets.numbers.get(lane)
        if number is None:
            self.streets.roads.successors(lane)  # says what is wrong
            msg = f"no lane {lane!r}"
            raise MapError(msg)
        return number

    def _lay(self, numbers: list[int], slot: int) -> int:
        """Put a route among all routes; return where it begins."""
        self._memory.ints[slot, m.COUNT] = 0
        if self._routes_used + len(numbers) > len(self._memory.routes):
            self._pack(len(numbers))
        at = self._routes_used
        self._memory.routes[at : at + len(numbers)] = numbers
        self._routes_used += len(numbers)
        return at

    def _pack(self, more: int) -> None:
        """Drop the routes that nobody drives any more, and make room for more lanes."""
        ints, before = self._memory.ints, self._memory.routes
        slots = np.flatnonzero(ints[:, m.COUNT])
        kept = [before[ints[k, m.ROUTE] : ints[k, m.ROUTE] + ints[k, m.COUNT]] for k in slots]
        used = sum(len(route) for route in kept)
        routes = np.zeros(
            max(64 if self.capacity < 64 else PACKED_FROM, 2 * (used + more)), np.int64
        )
        self._routes_used = 0
        for slot, route in zip(slots, kept, strict=True):
            at = self._routes_used
            routes[at : at + len(route)] = route
            ints[slot, m.ROUTE] = at
            self._routes_used += len(route)
        self._memory = self._memory._replace(routes=routes)
