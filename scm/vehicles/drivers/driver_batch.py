"""Any number of drivers on one map: where each car is, where it was sent, and its commands.

A car is a vehicle index below the capacity. Some are driven here; others, which have drivers of
their own, are known only from their CAMs.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from scm.arrays import AnyArray, Bools, Floats, Ints
from scm.geometry import Pose2
from scm.maps.border import BEYOND
from scm.maps.segments import wall_segments
from scm.records.city_map import RadioChannel
from scm.v2x.etsi.cam_spatem import SpatemBody
from scm.v2x.etsi.denm import DenmBody
from scm.v2x.messages.handover_request import HandedDriver
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers import driver_state as col
from scm.vehicles.drivers.cars_ahead import Scratch, new_scratch
from scm.vehicles.drivers.channel import channel_of, history_length
from scm.vehicles.drivers.controller import decide
from scm.vehicles.drivers.green_light import HORIZON
from scm.vehicles.drivers.hazards import HazardTable
from scm.vehicles.drivers.lane_graph import LaneGraph
from scm.vehicles.drivers.lane_tracking import fill_window
from scm.vehicles.drivers.received_cams import no_cams, store_cams, update_cells
from scm.vehicles.drivers.return_to_lane import MAX_RETURN_M, NO_WALL, distance_to_wall, walls_near
from scm.vehicles.drivers.signal_table import SignalTable
from scm.vehicles.drivers.waiting_order import note_standing

MIN_ROUTE_ENTRIES = 4096  # size of the route table before it grows, so that it seldom does
MIN_CARS_FOR_THREADS = 256  # fewer cars are decided faster by one thread


class DriverBatch:
    """The drivers of many cars.

    Args:
        lane_graph: The lanes of the map.
        capacity: Number of vehicle indices.
        seed: Decides which radio frames are lost.
        radio: The radio channel; None: an ideal one.

    Attributes:
        throttle: (capacity,) last commands, -1 to 1; likewise `steering`, + = left.
        channel: The radio channel from all senders to these drivers.
        signals: The received signal states.
        threads: Number of threads for large batches; results do not depend on it.
        horizon: Distance before a line at which speed is chosen for its next green [m]; 0: never.
        limit: (capacity,) highest speed that is allowed beside all rules [m/s]; write here.
    """

    def __init__(
        self,
        lane_graph: LaneGraph,
        capacity: int,
        *,
        seed: int = 0,
        radio: RadioChannel | None = None,
    ) -> None:
        city_map = lane_graph.roads.city_map
        self.lane_graph = lane_graph
        self.capacity = capacity
        self._seed = seed
        self._state = col.empty_state(capacity)
        radio = radio or RadioChannel()
        self._walls = wall_segments(city_map)
        self.channel = channel_of(
            radio, radio.range_m or city_map.radio_range_m, capacity, self._walls
        )
        history = history_length(radio)
        self._received = no_cams(city_map, capacity, history, self.channel)
        self.signals = SignalTable(city_map, history, self.channel)
        self._hazards = HazardTable(self.channel)
        self.threads = 1
        self.horizon = HORIZON if city_map.speed_advice else 0.0
        self._scratch = [new_scratch()]
        self._pool: ThreadPoolExecutor | None = None
        self._poses = self.channel.poses
        self._commands = np.zeros((2, capacity))
        self._kinds: dict[CarLimits, int] = {}
        self._entered = np.zeros(capacity, np.bool_)
        self._sent = np.zeros(capacity, np.bool_)
        self._requested = np.full(capacity, np.inf)
        self._routes_used = 0
        self.limit: Floats = np.full(capacity, np.inf)
        self.throttle: Floats = self._commands[0]
        self.steering: Floats = self._commands[1]

    def warm_up(self) -> None:
        """Compile or load all that driving needs; call it before the first car enters."""
        no_cars: Ints = np.zeros(0, np.int64)
        none: Floats = np.zeros(0)
        self._decide(no_cars, 0, self.signals, stop=False)
        self.receive_cams(no_cars, 0, none, none, none, none, none)
        if self.capacity and self.lane_graph.names:
            fill_window(self.lane_graph.arrays, self._state, 0, 0)
            self._state.lane_window[0] = -1
            kinds = np.zeros((1, col.SPEEDS + col.MAX_SPEEDS))
            alone = replace(col.empty_state(1), kinds=kinds, routes=np.zeros(1, np.int64))
            alone.lane_window[0, col.HERE] = 0
            distance_to_wall(
                self.lane_graph.arrays, alone, self._scratch[0], np.zeros((0, 4)), 0.0, 0.0, 0.0
            )

    @property
    def sizes(self) -> Floats:
        """Length and width of each car's outline [m], (capacity, 2); 0: no car."""
        return self._received.size

    @property
    def lane(self) -> Ints:
        """Lane of each car, as an index into `lane_graph.names`; -1 before it was sent."""
        return self._state.lane_window[:, col.HERE]

    @property
    def s(self) -> Floats:
        """Distance of each rear axle along its lane [m]."""
        return self._state.floats[:, col.S]

    @property
    def cross_track(self) -> Floats:
        """Lateral offset of each rear axle from its lane's centre line [m], + = left."""
        return self._state.floats[:, col.BESIDE]

    @property
    def done_m(self) -> Floats:
        """Distance that each car has driven since it was sent [m]."""
        return self._state.floats[:, col.DONE]

    @property
    def arrived(self) -> Bools:
        """Whether each car's route is done; never true of a car that circulates."""
        return self._state.ints[:, col.ARRIVED] > 0

    @property
    def waiting(self) -> Ints:
        """What each car at rest waits for, as an index into `driver_state.WAITING_FOR`."""
        return self._state.ints[:, col.WAITING]

    @property
    def at_signals(self) -> Ints:
        """What each car, moving or not, waits for at the signals ahead; see `waiting`."""
        return self._state.ints[:, col.AT_SIGNALS]

    @property
    def turn(self) -> Ints:
        """Direction of each car's next turn: 1 left, -1 right, 0 neither."""
        return self._state.ints[:, col.TURN]

    @property
    def passed(self) -> Ints:
        """Number of lanes that each car has passed since it was sent."""
        return self._state.ints[:, col.INDEX]

    def enter(self, index: int, limits: CarLimits, seed: int = 0) -> None:
        """Give a car a driver; it stands until it is sent.

        Args:
            index: The vehicle index.
            limits: The car's limits.
            seed: Decides where it turns while it circulates.
        """
        self.leave(index)
        self.use_limits(index, limits)
        ints = self._state.ints[index]
        ints[col.SEED], ints[col.LAST_NS] = seed, col.NEVER_NS
        self._state.floats[index] = 0.0
        self._entered[index] = True
        self.show(index, limits.length, limits.width)

    def use_limits(self, index: int, limits: CarLimits) -> None:
        """Drive a car by other limits from now on, wherever it is on its way."""
        if limits not in self._kinds:
            row = col.kind_row(limits, self.lane_graph.sharpest_change(limits.wheelbase))
            kinds = np.vstack([self._state.kinds, row])
            self._state = replace(self._state, kinds=kinds)
            self._kinds[limits] = len(kinds) - 1
        self._state.ints[index, col.KIND] = self._kinds[limits]

    def show(self, index: int, length: float, width: float) -> None:
        """Show a car to the others as an outline of this size [m], once it sends CAMs."""
        self._received.size[index] = length, width

    def leave(self, index: int) -> None:
        """Remove a car with its driver and its outline."""
        self._entered[index] = self._sent[index] = False
        self._received.size[index] = 0.0
        self._received.number[:, index] = -1
        self._state.stood[index] = col.NEVER_NS
        self._state.lane_window[index] = -1
        self._state.ints[index, col.COUNT] = 0
        self._commands[:, index] = 0.0

    def memory(self, index: int) -> tuple[AnyArray, ...]:
        """Return views of all that a driver remembers, except its route and what it receives."""
        state, sent, at = self._state, self._sent[index : index + 1], col.ROUTE
        ints = state.ints[index]
        return (
            state.floats[index], ints[:at], ints[at + 1 :], state.lane_window[index],
            self._commands[:, index], sent,
        )  # fmt: skip

    def route(self, index: int) -> Ints:
        """Return the numbers of the lanes of a car's route."""
        at, count = self._state.ints[index, [col.ROUTE, col.COUNT]].tolist()
        return self._state.routes[at : at + count].copy()

    def follow(self, index: int, route: Ints) -> None:
        """Give a car whose `memory` was written the route that belongs to it."""
        at = self._store_route(route.tolist(), index)
        self._state.ints[index, [col.ROUTE, col.COUNT]] = at, len(route)

    def look_at(self, near: Bools) -> None:
        """Limit the cars that these drivers look at, by vehicle index: those elsewhere are far."""
        self._received.near[:] = near

    def send(
        self,
        index: int,
        lanes: Sequence[str],
        s: float,
        after: str = "stop",
        speed: float | None = None,
        first: int = 0,
    ) -> None:
        """Send a car along lanes, without a jerk if it drives already.

        Args:
            index: The vehicle index.
            lanes: In driving order.
            s: Approximate place of the rear axle on its lane [m].
            after: After the last lane: `stop` at its end, `loop` to the first one, or
                `circulate` on any lane that follows.
            speed: On free road [m/s]; None: what lanes and curves allow.
            first: Which of the lanes the car is on.

        Raises:
            MapError: when there is no such lane.
        """
        numbers = [self._number(name) for name in lanes]
        if after == "stop":  # a route to the border goes on beyond it
            numbers += self.lane_graph.beyond(numbers[-1])
        ints, floats = self._state.ints[index], self._state.floats[index]
        at = self._store_route(numbers, index)
        ints[col.ROUTE], ints[col.COUNT], ints[col.INDEX] = at, len(numbers), first
        ints[col.AFTER] = col.AFTERS.index(after)
        ints[col.GOAL] = col.NO_GOAL if after == "loop" else len(numbers) - 1
        ints[col.GOING_LINE], ints[col.RULE_LINE], ints[col.ARRIVED] = -1, -1, 0
        floats[col.S], floats[col.DONE] = s, 0.0
        self._requested[index] = np.inf if speed is None else speed
        fill_window(self.lane_graph.arrays, self._state, index, numbers[first])
        self._sent[index] = True

    def wall_ahead(
        self,
        index: int,
        lanes: Sequence[str],
        s: float,
        pose: Pose2,
        after: str = "stop",
        speed: float | None = None,
    ) -> float | None:
        """Return how far a car would get before it hits a wall beside its lane [m], or None.

        Changes nothing. The arguments are those of `send`, and the pose of the car's rear axle.

        Raises:
            MapError: when there is no such lane.
        """
        numbers = [self._number(name) for name in lanes]
        state, route = col.empty_state(1), np.array(numbers, np.int64)
        state = replace(state, kinds=self._state.kinds, routes=route)
        state.ints[0], state.floats[0] = self._state.ints[index], self._state.floats[index]
        ints, floats = state.ints[0], state.floats[0]
        ints[col.ROUTE], ints[col.COUNT], ints[col.INDEX] = 0, len(numbers), 0
        ints[col.AFTER] = col.AFTERS.index(after)
        floats[col.S], floats[col.REQUESTED_SPEED] = s, np.inf if speed is None else speed
        fill_window(self.lane_graph.arrays, state, 0, numbers[0])
        x, y, yaw = pose
        kind = state.kinds[ints[col.KIND]]
        walls = walls_near(self._walls, x, y, MAX_RETURN_M + kind[col.FRONT] + kind[col.REAR])
        distance = distance_to_wall(
            self.lane_graph.arrays, state, self._scratch[0], walls, x, y, yaw
        )
        return None if distance == NO_WALL else distance

    def circulate(
        self, index: int, lane: str, s: float, speed: float | None = None
    ) -> tuple[str, ...]:
        """Let a car circulate without end; its seed chooses the branch at each junction.

        Returns:
            The first lanes of its route; all lanes of the loop where there is no choice.

        Raises:
            MapError: when there is no such lane, or it leads nowhere.
        """
        number = self._number(lane)
        if not self.lane_graph.goes_round[number]:
            self.lane_graph.roads.loop(lane)  # raises with the reason
        self.send(index, (lane,), s, "circulate", speed)
        return self.go_on(index)

    def go_on(self, index: int) -> tuple[str, ...]:
        """Let a car circulate from where it is and return its lanes, as `circulate` does."""
        self._state.ints[index, col.GOAL] = col.NO_GOAL
        self._state.ints[index, col.ARRIVED] = 0
        self._state.floats[index, col.DONE] = 0.0
        if self._state.ints[index, col.AFTER] != col.CIRCULATE:
            raise ValueError(f"vehicle index {index} was not sent to circulate")
        lane = self.lane_graph.names[self.lane[index]]
        return self.lane_graph.round_from(lane) or self.planned_lanes(index)

    def halt(self, index: int) -> None:
        """End a car's route; it is not driven until it is sent again."""
        self._sent[index] = False

    def planned_lanes(self, index: int) -> tuple[str, ...]:
        """Return a car's lanes from the current one on, as far as they are chosen."""
        window = self._state.lane_window[index, col.HERE :]
        names = (self.lane_graph.names[n] for n in window if n >= 0)
        return tuple(name for name in names if not name.endswith(BEYOND))

    def handed(self, index: int, now_ns: int) -> HandedDriver:
        """Return what a driver remembers that does not depend on the map."""
        ints, floats = self._state.ints[index], self._state.floats[index]
        speed = float(self._requested[index])
        return HandedDriver(
            wheels_rad=float(floats[col.ANGLE]),
            commanded_rad=float(floats[col.STEER]),
            setpoint_mps=float(floats[col.SPEED_SETPOINT]),
            integral=float(floats[col.INTEGRAL]),
            decided_ns=now_ns - int(ints[col.LAST_NS]),
            seed=int(ints[col.SEED]),
            speed_mps=speed if np.isfinite(speed) else None,
            then="stop" if ints[col.AFTER] == col.STOP else "circulate",
        )

    def continue_from(self, index: int, driver: HandedDriver, now_ns: int) -> None:
        """Let a car's driver continue from what another one remembers."""
        ints, floats = self._state.ints[index], self._state.floats[index]
        floats[col.ANGLE], floats[col.STEER] = driver.wheels_rad, driver.commanded_rad
        floats[col.SPEED_SETPOINT], floats[col.INTEGRAL] = driver.setpoint_mps, driver.integral
        ints[col.LAST_NS], ints[col.SEED] = now_ns - driver.decided_ns, driver.seed

    def is_in_junction(self, indices: Ints) -> Bools:
        """Return which of some cars (k,) have their centre where stopping is forbidden."""
        s, lanes = self.s[indices], self.lane[indices]
        kinds = self._state.kinds[self._state.ints[indices, col.KIND]]
        middle = s + 0.5 * (kinds[:, col.FRONT] - kinds[:, col.REAR])
        within = self.lane_graph.forbidden[lanes]
        at = middle[:, None]
        inside: Bools = ((within[:, :, 0] <= at) & (at <= within[:, :, 1])).any(axis=1)
        return inside & (lanes >= 0)

    def receive_cams(
        self,
        indices: Ints,
        now_ns: int,
        x: Floats,
        y: Floats,
        yaw: Floats,
        speed: Floats,
        yaw_rate: Floats,
    ) -> None:
        """Store CAMs sent now, shape (k,): columns of the middle of each front bumper."""
        cams = np.column_stack((x, y, yaw, speed, yaw_rate))
        stations = np.asarray(indices, np.int64)
        note_standing(self._state.stood, self._state.stood_at, stations, now_ns, cams)
        store_cams(self._received, stations, now_ns, cams)

    def receive_spatem(self, body: SpatemBody, now_ns: int) -> None:
        """Store a SPATEM that is sent now."""
        self.signals.receive_spatem(body, now_ns)

    def receive_denm(self, body: DenmBody, now_ns: int) -> None:
        """Store a warning that is sent now."""
        self._hazards.receive(body, now_ns)

    def receive_monitor_status(self, status: MonitorStatus) -> None:
        """Store a junction's fault state."""
        self.signals.receive_monitor_status(status)

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
        """Compute new commands for the cars that are `driven`; the others keep theirs.

        Args:
            now_ns: The present time [ns].
            x: Of each rear axle, map frame, by vehicle index; likewise `y` and `yaw`.
            y: See `x`.
            yaw: See `x`.
            speed: Along each body [m/s].
            driven: Which cars to drive, by vehicle index; cars that were never sent are skipped.
            stop: Whether all must come to rest in their lanes, wherever they are.
        """
        poses = self._poses
        poses[:, 0], poses[:, 1], poses[:, 2], poses[:, 3] = x, y, yaw, speed
        cars = np.flatnonzero(driven & self._sent)
        self._decide(cars, now_ns, self.signals, stop=stop)

    def decide_one(
        self,
        index: int,
        now_ns: int,
        pose: tuple[float, float, float, float],
        signals: SignalTable,
        *,
        stop: bool,
    ) -> tuple[float, float]:
        """Return (throttle, steering) of one car, by the signals that this car received.

        Args:
            index: The vehicle index.
            now_ns: The present time [ns].
            pose: x, y, yaw of its rear axle and speed along its body.
            signals: As this car received them.
            stop: Whether it must come to rest.
        """
        self._poses[index] = pose
        self._decide(np.array([index], np.int64), now_ns, signals, stop=stop)
        return float(self.throttle[index]), float(self.steering[index])

    def _decide(self, cars: Ints, now_ns: int, signals: SignalTable, *, stop: bool) -> None:
        update_cells(self._received, now_ns)
        allowed = np.minimum(self._requested[cars], self.limit[cars])
        self._state.floats[cars, col.REQUESTED_SPEED] = allowed

        def part(cars: Ints, scratch: Scratch) -> None:
            decide(
                self.lane_graph.arrays,
                self._state,
                self._received,
                signals.received,
                scratch,
                cars,
                self._poses,
                self._commands,
                now_ns,
                bool(stop),
                self._seed,
                self.horizon,
                self._hazards.hazards,
            )

        if self.threads == 1 or len(cars) < MIN_CARS_FOR_THREADS:
            part(cars, self._scratch[0])
            return
        if self._pool is None or len(self._scratch) != self.threads:
            self._pool = ThreadPoolExecutor(self.threads)
            self._scratch = [new_scratch() for _ in range(self.threads)]
        list(self._pool.map(part, np.array_split(cars, self.threads), self._scratch))

    def _number(self, lane: str) -> int:
        if lane not in self.lane_graph.numbers:
            self.lane_graph.roads.check_lane(lane)  # raises with the reason
        return self.lane_graph.numbers[lane]

    def _store_route(self, numbers: list[int], index: int) -> int:
        """Append a route to the route table and return where it begins."""
        self._state.ints[index, col.COUNT] = 0
        if self._routes_used + len(numbers) > len(self._state.routes):
            self._compact_routes(len(numbers))
        at = self._routes_used
        self._state.routes[at : at + len(numbers)] = numbers
        self._routes_used += len(numbers)
        return at

    def _compact_routes(self, more: int) -> None:
        """Drop unused routes and make room for more lanes."""
        ints, before = self._state.ints, self._state.routes
        indices = np.flatnonzero(ints[:, col.COUNT])
        in_use = [
            before[ints[k, col.ROUTE] : ints[k, col.ROUTE] + ints[k, col.COUNT]] for k in indices
        ]
        used = sum(len(route) for route in in_use)
        least = 64 if self.capacity < 64 else MIN_ROUTE_ENTRIES
        routes = np.zeros(max(least, 2 * (used + more)), np.int64)
        self._routes_used = 0
        for index, route in zip(indices, in_use, strict=True):
            at = self._routes_used
            routes[at : at + len(route)] = route
            ints[index, col.ROUTE] = at
            self._routes_used += len(route)
        self._state = replace(self._state, routes=routes)
