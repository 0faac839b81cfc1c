"""Many worlds of one task, side by side: their cars are rows of one fleet.

World after world, each with its agents' cars one after the other; then those that rules drive. A
step is one call of the physics for all of them, and one of each compiled look at what came of it.
An episode's draws follow from the world's seed and the episode's number alone, so that a world is
the same bit by bit however many there are.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.errors import MapError
from scm.gym.actions import names_of, reach_of
from scm.gym.junctions import Junctions
from scm.gym.radio import Radio
from scm.gym.randomise import Randomise, Ranges, with_effects
from scm.gym.signals import Signals
from scm.gym.task import PlaceStart, Start, Task
from scm.gym.touching import Touching
from scm.gym.traffic import RuleDrivenCars
from scm.gym.ways import DRAWS, SPEED_DRAW, WHERE, AlongLanes, ToGoal, Way
from scm.maps.load import load_map
from scm.records.policy import SPEED_CURVATURE
from scm.vehicles.car import load_car
from scm.vehicles.drivers.course import Course
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.drivers.speed_curvature import SpeedCurvatureController
from scm.vehicles.fleet import Fleet
from scm.vehicles.noise import Keys, bases_of, uniforms
from scm.vehicles.vehicle_status import VehicleStatus
from scm.world.solids import hull_of, outline_of

SEEDS, CARS, READINGS, LIGHTS = (
    np.uint64(n) for n in (0x5CA1AB1E5EEDED01, 0xCA25CA25CA25CA25, 0x5E4504, 0x11647)
)
"""Constants that keep draws of different purpose apart."""
CARS_STEP_S = 0.05  # of cars that rules drive, where junctions choose more seldom
TRIES, MARGIN_M = 8, 0.05  # places drawn until cars stand apart, and by how much more than touching


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What may differ from a task.

    Attributes:
        car: A car file, by name or path, such as one that `scm mismatch` found; None: the task's.
        randomise: For each episode, every number that the car file gives a standard deviation is
            drawn anew, from so many times that.
        action: What agents choose: `throttle_steering`, or `speed_curvature`, which the controller
            of the city's cars turns into commands.
        observations: What agents see, names of `scm.gym.observations`; None: what the task says.
        ranges: Likewise, further numbers by `section.key`, evenly from low to high; an effect that
            the car lacks is added to it.
    """

    car: str | None = None
    action: str = "throttle_steering"
    observations: Sequence[str] | None = None
    randomise: float = 0.0
    ranges: Ranges = field(default_factory=dict)


class Worlds:
    """Worlds of a task.

    Args:
        task: What is to be learned.
        map_name: Where, by name or path.
        worlds: How many.
        options: What may differ from the task.
        threads: For the physics.

    Attributes:
        rows: How many cars are agents'. What follows is of these (rows,), but for the fleet.
        fleet: All cars; row `world * agents + agent`, then those that rules drive.
        cars: Rows of each world's, agents' first, (worlds, cars).
        way: How its cars drive: along lanes, or to goals.
        traffic: What drives those that are no agents'; None: there are none.
        radio: What they know of each other; None: the task has no radio.
        signals: The lights; None: the task has none.
        junctions: Those that are agents, with the lights that they choose; None: cars are agents.
        steps: Of each world, since its episode began, (worlds,).
        present: Which cars take part, (rows,); the others are out, until the next episode.
        touched: Which touch a wall or another car now, (rows,).
        actions: In force, -1 to 1, throttle and steering, (rows, 2); `before`: of the step before.
        action_names: Of the two columns of what an agent chooses.
        reach: Its largest action, (2,).

    Raises:
        gymnasium.error.Error: There is no such kind of action.
        ScmError: There is no such map or car, or it does not suit the task.
    """

    def __init__(
        self, task: Task, map_name: str, worlds: int, options: Options, threads: int = 1
    ) -> None:
        if options.observations is not None:
            task = replace(task, observations=tuple(options.observations))
        self.task, self.count, self.agents = task, worlds, task.agents
        self.action_names = names_of(task, options.action)
        rows = self.rows = worlds * task.agents
        more = task.traffic.cars if task.traffic is not None else 0
        own = np.arange(0 if task.of_junctions else rows)
        self._own, driven = len(own), len(own) // worlds
        others = self._own + np.arange(worlds * more)
        self.cars: Ints = np.hstack((own.reshape(worlds, -1), others.reshape(worlds, more)))
        self.city_map = load_map(map_name)
        self.car = with_effects(load_car(options.car or task.car), options.ranges)
        self.fleet = Fleet(self.car, self.cars.size)
        self._randomise = Randomise(self.fleet, options.randomise, options.ranges)
        self.fleet.threads = threads
        self.reach = reach_of(self.car, self.action_names)
        self._controller = (
            SpeedCurvatureController(limits_of(self.car), rows)
            if self.action_names == SPEED_CURVATURE
            else None
        )
        self.fleet.alive[:] = True
        lanes = task.lanes.get(self.city_map.name, ())
        self.way: Way = (
            ToGoal(self.city_map, rows, task.start)
            if isinstance(task.start, PlaceStart)
            else AlongLanes(self.city_map, self.cars, self._own, task.start, lanes)
        )
        self.junctions = self._junctions() if task.of_junctions else None
        self._substeps = round(task.period_s / CARS_STEP_S) if task.of_junctions else 1
        self.traffic = (
            RuleDrivenCars(self.course, self.cars, driven, self.car, task.traffic)
            if task.traffic is not None
            else None
        )
        if self.traffic is not None and self.junctions is not None:
            self.traffic.green = self.junctions.green
        self._touching = Touching(self.city_map, self.car, self.cars, driven)
        self.radio = (
            Radio(self.city_map, worlds, task.agents) if "others" in task.observations else None
        )
        front_m = limits_of(self.car).front
        self.signals = (
            Signals(self.city_map, rows, front_m) if "signals" in task.observations else None
        )
        is_abreast = isinstance(task.start, Start) and task.start.is_abreast
        self._apart_m = 0.0 if is_abreast else 2.0 * outline_of(hull_of(self.car))[4] + MARGIN_M
        self._every: Ints = np.arange(self.cars.size)
        self._seeds: Keys = np.zeros(worlds, np.uint64)
        self._episodes: Ints = np.full(worlds, -1, np.int64)
        self.keys: Keys = np.zeros(self.cars.size, np.uint64)
        self.steps: Ints = np.zeros(worlds, np.int64)
        self.present: Bools = np.zeros(rows, np.bool_)
        self.touched: Bools = np.zeros(rows, np.bool_)
        self.actions, self.before = np.zeros((2, rows, 2))

    def _junctions(self) -> Junctions:
        found = Junctions(self.city_map, self.count, self.task.period_s)
        if len(found.names) != self.agents:
            msg = f"map {self.city_map.name}: expected {self.agents} junctions, got {found.names}"
            raise MapError(msg)
        return found

    def seed(self, worlds: Ints, seeds: Ints) -> None:
        """Let some worlds (n,) begin anew with the first episode of seeds (n,)."""
        self._seeds[worlds] = bases_of(np.full(len(seeds), SEEDS), np.asarray(seeds, np.int64))
        self._episodes[worlds] = -1

    def begin(self, which: Bools) -> None:
        """Begin the next episode of some worlds, (worlds,)."""
        worlds = np.flatnonzero(which)
        self._episodes[worlds] += 1
        bases = bases_of(self._seeds[worlds] ^ CARS, self._episodes[worlds])
        rows, count = self.cars[worlds].ravel(), self.cars.shape[1]
        own = rows[rows < self._own]
        self.keys[rows] = bases_of(np.repeat(bases, count), np.tile(np.arange(count), len(worlds)))
        draws = uniforms(self.keys[rows], DRAWS)
        poses = self._starts(bases, rows, draws)
        low, high = self.task.start.speed_mps
        self.fleet.alive[rows] = self.present.reshape(self.count, -1)[worlds] = True
        if self._randomise.is_any:
            self._randomise.draw(rows, self.keys[rows])
        self.fleet.place_rows(rows, poses, low + (high - low) * draws[:, SPEED_DRAW])
        if self._controller is not None:
            self._controller.begin(own, self.fleet.speed[own])
        for actions in (self.actions, self.before):
            actions.reshape(self.count, self.agents, -1)[worlds] = 0.0
        self.steps[worlds] = 0
        if self.radio is not None:
            self.radio.forget(own)
        if self.signals is not None:
            self.signals.begin(own, np.repeat(uniforms(bases ^ LIGHTS, 1)[:, 0], self.agents))
        if self.junctions is not None:
            self.junctions.begin(worlds)
        if self.traffic is not None:
            self.traffic.begin(worlds, self.keys)
        self._look_at_start(worlds, rows, own)

    def _starts(self, bases: Keys, rows: Ints, draws: Floats) -> Floats:
        """Return where the cars of some worlds begin, (rows, 3): spread evenly.

        Where two would stand in each other, as where lanes cross, another place is drawn for all of
        that world.
        """
        count = self.cars.shape[1]
        cars, shares = np.arange(count), uniforms(bases, TRIES)
        poses = np.zeros((len(bases), count, 3))
        open_ = np.arange(len(bases))
        for tried in range(TRIES):
            where = shares[open_, tried, None] + cars / count
            these = (open_[:, None] * count + cars).ravel()
            draws[these, WHERE] = (where - np.floor(where)).ravel()
            begun = self.way.begin(rows[these], draws[these])
            poses[open_] = begun.reshape(-1, count, 3)
            apart = poses[open_, :, None, :2] - poses[open_, None, :, :2]
            is_near = np.hypot(apart[..., 0], apart[..., 1]) < self._apart_m
            is_near &= ~np.eye(count, dtype=bool)
            open_ = open_[is_near.any(axis=(1, 2))]
            if not len(open_):
                break
        return poses.reshape(-1, 3)

    def step(self, actions: Floats | Ints) -> None:
        """Let all worlds go on for one period; who is out stays out.

        Args:
            actions: As `action_names` says, (rows, 2); or numbers of choices, (rows,).
        """
        fleet, own = self.fleet, self._own
        if self.junctions is not None:
            self.junctions.request(actions.astype(np.int64).reshape(self.count, -1))
        else:
            given = np.array(self.task.choices)[actions] if self.task.choices else actions
            given = np.asarray(np.clip(given, -self.reach, self.reach), np.float64)
            if self._controller is not None:
                given = self._controller.commands(given, fleet.speed[:own], self.task.period_s)
            self.before[:], self.actions[:] = self.actions, given
            fleet.throttle[:own], fleet.steering[:own] = self.actions.T
        self.steps += 1
        for _ in range(self._substeps):
            if self.traffic is not None:
                fleet.throttle[own:], fleet.steering[own:] = self.traffic.commands.T
            fleet.advance(self.task.period_s / self._substeps)
            self._look()

    def rewards(self) -> Floats:
        """Return what each car gains in this step, (rows,); nothing for who is out."""
        found = np.zeros(len(self.present))
        for term in self.task.rewards:
            found += term.weight * term.function(self)
        return np.where(self.present, found, 0.0)

    def ends(self) -> Bools:
        """Return for which cars this step is the last, (rows,)."""
        found = np.zeros(len(self.present), np.bool_)
        for function in self.task.ends:
            found |= function(self)
        return found & self.present

    def remove(self, rows: Bools) -> None:
        """Let cars (rows,) take part no more, until the next episode."""
        self.present &= ~rows
        self.fleet.alive[: self._own] &= ~rows[: self._own]

    @property
    def agent_names(self) -> tuple[str, ...]:
        """Of a world's agents: its junctions, or its cars by number."""
        if self.junctions is not None:
            return self.junctions.names
        return tuple(f"car_{number}" for number in range(self.agents))

    @property
    def out_of_time(self) -> Bools:
        """Which cars still take part and have reached the time limit, (rows,)."""
        return (self.row_steps >= self.task.most_steps) & self.present

    @property
    def are_out(self) -> Bools:
        """In which worlds no car takes part any more, (worlds,)."""
        return np.asarray(~self.present.reshape(self.count, -1).any(axis=1))

    @property
    def row_steps(self) -> Ints:
        """Of each car, since its episode began, (rows,)."""
        return np.repeat(self.steps, self.agents)

    @property
    def is_wrecked(self) -> Bools:
        """Which cars rolled over, or left every physical range, (rows,)."""
        return np.asarray(self.fleet.status[: self.rows] != VehicleStatus.OK)

    @property
    def lanes(self) -> AlongLanes:
        """Where cars are along their lanes.

        Raises:
            MapError: The task's cars drive to goals.
        """
        if not isinstance(self.way, AlongLanes):
            raise MapError(f"task {self.task.name}: its cars drive to goals, not along lanes")
        return self.way

    @property
    def to_goal(self) -> ToGoal:
        """Where cars are seen from their goals.

        Raises:
            MapError: The task's cars drive along lanes.
        """
        if not isinstance(self.way, ToGoal):
            raise MapError(f"task {self.task.name}: its cars drive along lanes, not to goals")
        return self.way

    @property
    def course(self) -> Course:
        """Where cars are along their lanes; see `lanes`."""
        return self.lanes.course

    def _look(self) -> None:
        """Find out where all cars are after a step."""
        self.way.look(self.fleet)
        motion = self.fleet.planar_cogs(self._every)
        self.touched = self._touching.find(motion, present=self.fleet.alive)[: self._own]
        self._look_around(np.arange(self.count), self._every[: self._own])

    def _look_at_start(self, worlds: Ints, rows: Ints, own: Ints) -> None:
        """Find out where cars are whose episode begins: they stand apart, and have not moved."""
        self.way.look_at_start(self.fleet, rows)
        self.touched[own] = False
        self._look_around(worlds, own)

    def _look_around(self, worlds: Ints, own: Ints) -> None:
        """Find out what cars of some worlds know beside where they are; `own` are the agents'."""
        fleet, steps = self.fleet, self.row_steps
        now_s = self.task.period_s * steps.astype(float)
        if self.signals is not None:
            self.signals.look(*self.course.arrays, own, now_s, self.present)
        if self.radio is not None:
            motion = np.column_stack((fleet.x, fleet.y, fleet.yaw, fleet.speed))
            self.radio.exchange(own, motion, now_s, steps, self.keys, self.present)
        is_first, step_s = self.steps[worlds] == 0, self.task.period_s / self._substeps
        if self.junctions is not None:
            passed_s = np.where(is_first, 0.0, step_s)
            self.junctions.look(*self.course.arrays, worlds, self.cars, fleet.speed, passed_s)
        if self.traffic is not None:
            self.traffic.decide(worlds, fleet, np.where(is_first, -1.0, step_s))
