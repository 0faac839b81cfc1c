"""Local planner: model predictive path integral control over the car file's own compiled cars.

Hundreds of cars of the file start from where the car is, each with its own throttle and steering
over the next seconds. Those that get on along the path without touching anything count most in the
mean, which is the next plan:

    V_k = U + noise_k                           commands at knots, between them linear
    S_k = cost of the drive that V_k leads to   (`mppi_cost`)
    U  <- sum w_k V_k,  w_k = exp(-(S_k - min S) / temperature) / sum

The noise is that of the knots: commands change steadily. U begins from the last plan, moved on by
the time since. Some of the V_k are drawn round the path's own commands instead, one stands still.

A car starts with pose, speed and steering angle as they are measured; it rolls without slip, on its
springs at rest. What commands on their way and lags do, a car says that is driven by the commands
as they were sent, and placed where the real one is at each plan.

Holds: as the car file; a level, even floor and a full battery.
Source: Williams, Drews, Goldfain, Rehg, Theodorou, "Information-theoretic model predictive control:
theory and applications to autonomous driving", IEEE Transactions on Robotics 34, 2018; samples
round other controllers: Trevisan, Alonso-Mora, "Biased-MPPI", IEEE RA-L 9, 2024.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_S
from scm.errors import PathError, RunError
from scm.geometry import Pose2
from scm.vehicles.car import Car
from scm.vehicles.fleet import SUBSTEP_S, Fleet
from scm.vehicles.vehicle_status import VehicleStatus
from vehicle_agent.autonomy.band import PASSED_M, ahead_of, apart
from vehicle_agent.autonomy.control import Command
from vehicle_agent.autonomy.elastic_band import discs_of
from vehicle_agent.autonomy.grid_map import GridMap
from vehicle_agent.autonomy.mppi_cost import WEIGHTS, Task, Weights, costs_of, rooms_of
from vehicle_agent.autonomy.outline import outline_clearance, scene_of
from vehicle_agent.autonomy.plan import CarLimits, Path, Trajectory, timed
from vehicle_agent.autonomy.response import Response

Sent = Iterable[tuple[int, Command, float]]
"""Commands as they were sent: when [ns], the command, and the speed that it is for [m/s]."""

STEP_S = 0.1  # of a drive, with one command
GUIDED = 4  # one of so many samples is drawn round the path's own commands
NARROWER = 0.5  # noise of a round over that of the round before
MARGIN_M, LEAST_MARGIN_M = 0.03, 0.011  # wanted, and needed, beside the car
SLACK_M = 0.002  # less than the car has at the beginning
SENT_STEP_S, FORGOTTEN_S = 0.01, 1.0
SEARCH_M = 0.4  # along the path, for the pose beside the car
AT_CUSP_M, STUB_M = 0.015, 0.15
STANDS_MPS = 0.02
READY_RAD = 0.05  # of wheels that need not be turned at rest
AHEAD_M = 0.05  # whose curvature wheels are turned to at rest
VARIABLES = ("x", "y", "yaw", "speed", "steer_angle")


@dataclass(frozen=True, slots=True)
class Settings:
    """How many cars are driven how far.

    Attributes:
        cars: Of one round; `rounds`: of a plan.
        horizon_s: That a car drives; `substep_s`: of its integration.
        knot_s: From one of the commands that are drawn to the next.
        std: Of throttle and steering at a knot, in the first round.
        temperature: Cost by which a drive counts e times less.
        seed: Of the noise.
        weights: Of the costs.

    Raises:
        RunError: when a number cannot be.
    """

    cars: int = 127
    rounds: int = 4
    horizon_s: float = 4.0
    substep_s: float = 0.01
    knot_s: float = 0.4
    std: tuple[float, float] = (0.2, 0.3)
    temperature: float = 0.02
    seed: int = 0
    weights: Weights = WEIGHTS

    def __post_init__(self) -> None:
        """Check the numbers."""
        least = {
            "cars": GUIDED, "rounds": 1, "horizon_s": STEP_S, "substep_s": 1e-4, "knot_s": STEP_S,
            "temperature": 1e-6, "seed": 0,
        }  # fmt: skip
        for name, low in least.items():
            value = getattr(self, name)
            if not low <= value < math.inf:
                msg = f"settings of the local planner: {name}: expected at least {low}, got {value}"
                raise RunError(msg)


class ModelCars:
    """Cars of one file that start alike, and one that is driven as the real one is."""

    def __init__(self, car: Car, count: int, step_s: float) -> None:
        self._fleet, self._step_s = Fleet(car, count + 1), step_s
        self._own, self._t_s = count, -math.inf
        for _ in range(count + 1):
            self._fleet.add(Pose2(0.0, 0.0, 0.0))
        self._fleet.advance_rows(self._own, self._own + 1, SUBSTEP_S)
        self._trim_rad = float(self._fleet.steer_angle[self._own])

    def follow(self, sent: Sent, t_s: float) -> None:
        """Drive the own car by what was sent since the last call; after a gap it stood."""
        fleet, own = self._fleet, self._own
        if not 0.0 <= t_s - self._t_s < FORGOTTEN_S:
            self._t_s = t_s
            fleet.place(own, Pose2(0.0, 0.0, 0.0))
            return
        commands = [(t_ns / NS_PER_S, command) for t_ns, command, _ in sent]
        times = np.array([t for t, _ in commands])
        while self._t_s + SENT_STEP_S <= t_s:
            number = int(np.searchsorted(times, self._t_s + 0.5 * SENT_STEP_S)) - 1
            if number >= 0:
                command = commands[number][1]
                fleet.throttle[own], fleet.steering[own] = command.throttle, command.steering
            fleet.advance_rows(own, own + 1, SENT_STEP_S)
            self._t_s += SENT_STEP_S

    def begin(self, pose: Pose2, speed_mps: float, steering_rad: float, yaw_rate: float) -> None:
        """Place the own car where the real one is."""
        fleet, own = self._fleet, self._own
        command = float(fleet.throttle[own]), float(fleet.steering[own])
        fleet.place(
            own, pose, speed_mps, 0.0, yaw_rate, steering_rad - self._trim_rad,
            keep_actuators=True,
        )  # fmt: skip
        fleet.throttle[own], fleet.steering[own] = command

    def drive(self, commands: Floats) -> tuple[Floats, Floats]:
        """Return x, y, yaw, speed and steering angle (T, 5, n), and which cars drove (n,).

        Args:
            commands: (T, n, 2) throttle and steering of each car in each step.
        """
        fleet, count = self._fleet, commands.shape[1]
        fleet.copy_row(self._own, slice(0, self._own))
        fleet.alive[count:] = False
        given = np.zeros((2, len(commands), fleet.capacity))
        given[:, :, :count] = np.moveaxis(commands, 2, 0)
        out = fleet.rollout(given[0], given[1], STEP_S, VARIABLES, self._step_s)
        fleet.alive[self._own] = True
        drove = fleet.status[:count] == VehicleStatus.OK
        return np.stack([out[name][:, :count] for name in VARIABLES], axis=1), drove


class PathIntegral:
    """Plans again and again along a path, each time from the plan before.

    Attributes:
        candidates: Empty, as no classes of drives are compared; the elastic band has some.
    """

    candidates: tuple[Trajectory, ...] = ()

    def __init__(
        self,
        car: Car,
        limits: CarLimits,
        response: Response,
        sent: Sent = (),
        settings: Settings = Settings(),
    ) -> None:
        """Set up without a path.

        Args:
            car: Its file.
            limits: Of the car.
            response: How it answers to commands.
            sent: The commands of the last second; the caller goes on writing there.
            settings: How many cars are driven how far.
        """
        self._limits, self._response, self._sent = limits, response, sent
        self._settings = settings
        self._cars = ModelCars(car, settings.cars, settings.substep_s)
        self._rng = np.random.default_rng(settings.seed)
        self._discs_m = discs_of(limits)
        self._outline = np.array((limits.rear_m, limits.front_m, limits.right_m, limits.left_m))
        self._steps_s = STEP_S * np.arange(round(settings.horizon_s / STEP_S))
        count = math.ceil(settings.horizon_s / settings.knot_s) + 1
        self._knots = settings.knot_s * np.arange(count)
        self._path: Path | None = None
        self._plan: Floats | None = None  # commands at the knots, (m, 2)
        self._t_s = 0.0
        self._at, self._ends = 0, list[int]()

    def plan(
        self,
        grid: GridMap,
        path: Path,
        pose: Pose2,
        speed_mps: float,
        steering_rad: float,
        moving: Floats,
        t_s: float,
    ) -> Trajectory:
        """Return how to drive on along a path; arguments as those of `ElasticBand.plan`.

        Up to the horizon it is the drive of a compiled car, to the next cusp at most; beyond, and
        where no drive gets on, it is the path.

        Raises:
            PathError: when pose, speed or steering are no numbers.
        """
        start = np.array((*pose, speed_mps, steering_rad))
        if not np.isfinite(start).all():
            raise PathError(f"local plan: expected a pose, speed and steering angle, got {start}")
        if path is not self._path:
            self._path, self._plan, self._at = path, None, 0
            self._ends = [*(np.flatnonzero(np.diff(path.gears[1:])) + 1), len(path.poses) - 1]
        self._pass(path, start)
        wheels_rad, wait_s = self._turned(path, start)
        task = self._task(grid, path, pose, moving, wait_s)
        self._cars.follow(self._sent, t_s)
        yaw_rate = speed_mps * math.tan(steering_rad) / self._limits.wheelbase_m
        self._cars.begin(pose, speed_mps, wheels_rad, yaw_rate)
        guide = self._guide(path, start, task)
        plan = guide if self._plan is None else self._moved_on(self._plan, t_s - self._t_s)
        for number in range(self._settings.rounds):
            plan = self._improved(plan, guide, task, NARROWER**number)
        plan, states = self._best(np.stack((plan, guide, plan * (0.0, 1.0))), task)
        self._plan, self._t_s = plan, t_s
        return self._trajectory(path, start, wheels_rad, wait_s, states, task)

    def _pass(self, path: Path, start: Floats) -> None:
        """Leave behind what the car has passed of the path, and a cusp where it stands."""
        end = self._ends[0]
        past = ahead_of(start, path.poses[end : end + 1], int(path.gears[end]))[0] < AT_CUSP_M
        near = math.hypot(*(path.poses[end, :2] - start[:2])) < STUB_M
        if len(self._ends) > 1 and past and near and abs(start[3]) < STANDS_MPS:
            self._at, self._plan = self._ends.pop(0), None
        some = path.poses[self._at : self._ends[0] + 1]
        some = some[_along(some) < SEARCH_M]
        self._at += int(np.argmin(apart(some, start)))

    def _turned(self, path: Path, start: Floats) -> tuple[float, float]:
        """Return the wheels' angle with which the car sets out, and how long it turns them."""
        if abs(start[3]) > STANDS_MPS:
            return float(start[4]), 0.0
        some = slice(min(self._at + 1, self._ends[0]), self._ends[0] + 1)
        near = _along(path.poses[some]) < AHEAD_M
        angle = math.atan(self._limits.wheelbase_m * float(path.curvatures[some][near].mean()))
        angle = max(-self._limits.steering_rad, min(self._limits.steering_rad, angle))
        turn = abs(angle - float(start[4]))
        if turn < READY_RAD:
            return float(start[4]), 0.0
        return angle, turn / self._limits.steering_rate_radps

    def _task(self, grid: GridMap, path: Path, pose: Pose2, moving: Floats, wait_s: float) -> Task:
        """Return what the drives are for: where the path has less room than wanted, so may they."""
        limits, scene = self._limits, scene_of(grid, self._limits)
        poses = np.ascontiguousarray(path.poses[self._at : self._ends[0] + 1])
        gear = float(path.gears[self._ends[0]])
        rooms = rooms_of(scene, self._discs_m, poses)
        wanted = np.where(rooms < LEAST_MARGIN_M, MARGIN_M, np.minimum(rooms, MARGIN_M))
        margin = min(LEAST_MARGIN_M, outline_clearance(scene, pose) - SLACK_M)
        return Task(
            scene, self._discs_m, self._outline,
            np.ascontiguousarray(moving, dtype=np.float64).reshape(-1, 5), wait_s,
            poses, _along(poses), wanted, gear,
            limits.speed_mps if gear > 0.0 else limits.reverse_mps, limits.accel_mps2, margin,
            STEP_S, self._settings.weights,
        )  # fmt: skip

    def _guide(self, path: Path, start: Floats, task: Task) -> Floats:
        """Return the path's own commands at the knots, (m, 2), from the speed of now."""
        some = slice(self._at, self._ends[0] + 1)
        speed, way, commands = abs(start[3]), 0.0, []
        for _ in self._knots:
            ahead = way + speed * self._settings.knot_s
            bend = float(np.interp(ahead, task.along_m, path.curvatures[some]))
            left = max(task.along_m[-1] - way, 0.0)
            more = speed + task.accel_mps2 * self._settings.knot_s
            speed = min(more, task.speed_mps, math.sqrt(2.0 * task.accel_mps2 * left))
            way += speed * self._settings.knot_s
            angle = math.atan(self._limits.wheelbase_m * bend)
            commands.append(
                (self._response.throttle_for(task.gear * speed), self._response.steering_for(angle))
            )
        return np.array(commands)

    def _moved_on(self, plan: Floats, elapsed_s: float) -> Floats:
        """Return a plan's commands at the knots so much later; its last ones stay."""
        times = self._knots + elapsed_s
        return np.column_stack([np.interp(times, self._knots, one) for one in plan.T])

    def _improved(self, plan: Floats, guide: Floats, task: Task, scale: float) -> Floats:
        """Return the weighted mean of commands drawn round a plan, and round the path's own."""
        settings = self._settings
        noise = self._rng.standard_normal((settings.cars, *plan.shape))
        drawn = plan + scale * noise * settings.std
        drawn[::GUIDED] += guide - plan
        drawn[:3] = plan, guide, plan * (0.0, 1.0)
        drawn = self._within(drawn, task)
        costs, _ = self._driven(drawn, task)
        weights = np.exp((costs.min() - costs) / settings.temperature)
        mean: Floats = np.einsum("n,nmc->mc", weights / weights.sum(), drawn)
        return mean

    def _best(self, plans: Floats, task: Task) -> tuple[Floats, Floats]:
        """Return the plan (m, 2) of several that costs least, and its states (T, 5)."""
        costs, states = self._driven(plans, task)
        best = int(np.argmin(costs))
        return plans[best], states[:, :, best]

    def _driven(self, plans: Floats, task: Task) -> tuple[Floats, Floats]:
        """Return costs (n,) and states (T, 5, n) of the drives that plans (n, m, 2) lead to."""
        apart_s = np.abs(self._steps_s[:, None] - self._knots)
        share = np.clip(1.0 - apart_s / self._settings.knot_s, 0.0, 1.0)
        commands = np.einsum("tm,nmc->tnc", share, plans)
        states, drove = self._cars.drive(commands)
        return np.where(drove, costs_of(task, states, commands), math.inf), states

    def _within(self, plans: Floats, task: Task) -> Floats:
        """Return plans with commands that the car takes, in the piece's gear."""
        top = abs(self._response.throttle_for(task.gear * task.speed_mps))
        plans[..., 0] = task.gear * np.clip(task.gear * plans[..., 0], 0.0, top)
        plans[..., 1] = np.clip(plans[..., 1], -1.0, 1.0)
        return plans

    def _trajectory(
        self, path: Path, start: Floats, wheels_rad: float, wait_s: float, states: Floats,
        task: Task,
    ) -> Trajectory:  # fmt: skip
        """Return a drive up to where it stands, and the rest of the path.

        A car that turns its wheels first stands at the first two poses.
        """
        moves = np.flatnonzero(np.abs(states[:, 3]) > STANDS_MPS)
        driven = states[: moves[-1] + 1 if len(moves) else 0]
        times = np.asarray(wait_s + STEP_S * np.arange(len(driven) + 1), dtype=np.float64)
        rows: Floats = np.vstack((start, driven))
        if wait_s > 0.0:
            turned = [*start[:4], wheels_rad]
            rows, times = np.vstack((start, turned, driven)), np.concatenate(((0.0,), times))
        end = rows[-1]
        ahead = ahead_of(end, task.poses, int(task.gear)) > PASSED_M
        ahead[: np.argmin(apart(task.poses, end))] = False
        first = self._at + (int(np.argmax(ahead)) if ahead.any() else len(ahead))
        if first < len(path.poses):
            gears = np.concatenate((path.gears[first : first + 1], path.gears[first:]))
            bends = np.concatenate((path.curvatures[first : first + 1], path.curvatures[first:]))
            rest = timed(Path(np.vstack((end[:3], path.poses[first:])), gears, bends), self._limits)
            more = np.column_stack((rest.poses, rest.speeds_mps, rest.steering_rad))
            rows = np.vstack((rows, more[1:]))
            times = np.concatenate((times, times[-1] + rest.times_s[1:]))
        return Trajectory(times, rows[:, :3].copy(), rows[:, 3].copy(), rows[:, 4].copy())


def _along(poses: Floats) -> Floats:
    """Return the way to each pose from the first, (n,) [m]."""
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    return np.concatenate(((0.0,), np.cumsum(steps)))
