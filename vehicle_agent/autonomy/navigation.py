"""Drives a car along paths on a map that changes: plans globally and locally, follows, and stops.

The same for parking and for looking round an unknown room. Planner and controller can be replaced:
`PUBLISHED` is the stack of the AutoDRIVE paper.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from scm.clock import NS_PER_S
from scm.errors import PathError, RunError
from scm.geometry import Pose2
from scm.vehicles.car import Car
from scm.vehicles.driver import Other
from scm.vehicles.parked import TOLERANCE_M, TOLERANCE_RAD
from vehicle_agent.autonomy import astar, hybrid_astar
from vehicle_agent.autonomy.control import Command, Tracker
from vehicle_agent.autonomy.elastic_band import ElasticBand
from vehicle_agent.autonomy.grid_map import GridMap
from vehicle_agent.autonomy.moving import comes_near, discs_of
from vehicle_agent.autonomy.mppi import PathIntegral
from vehicle_agent.autonomy.outline import outline_clearance, room, scene_of
from vehicle_agent.autonomy.perception import Whereabouts
from vehicle_agent.autonomy.plan import CarLimits, Path, Trajectory, limits_of
from vehicle_agent.autonomy.response import Response, response_of
from vehicle_agent.autonomy.trajectory_check import sampled

MARGINS_M = (0.05, 0.03, 0.01)  # that paths leave, the first that there is a path with
WANTED_M = 0.04  # of the band, where there is room
STOP_M = 0.01  # clearance of the way ahead, below which the car stops
SLACK_M = 0.005  # less than where the path begins, which it may leave
ROUNDED, QUIET_M = 0.4, 0.025  # part of a range's noise by which corners recede, above so much
LOOK_AHEAD_S = 1.5
LATEST_S = 0.2  # for which a pose is extrapolated

Planner = Callable[[GridMap, CarLimits, Pose2, Pose2, float], Path]
"""From a grid, the car's limits, start, goal and margin [m] to a path; raises PathError."""


def _hybrid(grid: GridMap, limits: CarLimits, start: Pose2, goal: Pose2, margin_m: float) -> Path:
    return hybrid_astar.plan(grid, limits, start, goal, margin_m=margin_m)


def _points(grid: GridMap, limits: CarLimits, start: Pose2, goal: Pose2, margin_m: float) -> Path:
    del margin_m  # its inflation takes the place of one
    return astar.plan(grid, limits, start, goal)


@dataclass(frozen=True, slots=True)
class Stack:
    """Which planner and controller a car drives with.

    Attributes:
        planner: Of paths.
        controller: A key of `scm`'s `CONTROLLERS`.
        local: The local planner: `band` or `mppi`.
        tolerance_m, tolerance_rad: From the goal, within which the car stays.
        steering_share: Of the steering angle, to plan with: the rest is for control.
    """

    planner: Planner = _hybrid
    controller: str = "lqr"
    local: str = "band"
    tolerance_m: float = TOLERANCE_M
    tolerance_rad: float = TOLERANCE_RAD
    steering_share: float = 0.95


OWN = Stack()
MPPI = Stack(local="mppi")
"""The local planner drives the car file's own compiled cars ahead."""
PUBLISHED = Stack(_points, "paper", tolerance_m=0.05, tolerance_rad=0.0873, steering_share=1.0)
"""A* on a grid of 0.05 m and two constant gains at 5 Hz, as the AutoDRIVE paper has them."""
STACKS = {"own": OWN, "mppi": MPPI, "published": PUBLISHED}


def stack_named(name: str) -> Stack:
    """Return a stack of `STACKS`.

    Raises:
        RunError: when there is none of this name.
    """
    if name not in STACKS:
        raise RunError(f"stack: expected one of {', '.join(STACKS)}, got {name!r}")
    return STACKS[name]


class Navigator:
    """Drives one car.

    Args:
        car: Its file.
        stack: Planner and controller.

    Attributes:
        limits: Of the car, as it plans with them.
        others: Other cars by their own reports, now.
        noise_m: Standard deviation of a range: noise rounds the corners of what is seen.
        path: The last one found; None: none yet.
        way: The stretch of it that the car follows; None: it stands.

    Raises:
        CarError: when the car file lacks what is needed.
        RunError: when the stack's local planner is unknown.
    """

    def __init__(self, car: Car, stack: Stack = OWN) -> None:
        response = response_of(car)
        limits, self._planner = response.limited(limits_of(car)), stack.planner
        self.limits = replace(limits, steering_rad=stack.steering_share * limits.steering_rad)
        self.others: tuple[Other, ...] = ()
        self.noise_m = 0.0
        self.path: Path | None = None
        self.way: Trajectory | None = None
        self._tracker = Tracker(limits, response, stack.controller)
        self._stop_m = STOP_M
        self._local = self._local_planner(car, response, stack.local)

    def _local_planner(self, car: Car, response: Response, name: str) -> ElasticBand | PathIntegral:
        if name == "band":
            return ElasticBand(self.limits, margin_m=WANTED_M)
        if name == "mppi":
            return PathIntegral(car, self.limits, response, self._tracker.sent)
        raise RunError(f"local planner of a stack: expected 'band' or 'mppi', got {name!r}")

    @property
    def is_done(self) -> bool:
        """Whether the end of the path was reached."""
        return self._tracker.is_done

    @property
    def candidates(self) -> tuple[Trajectory, ...]:
        """Other ways to drive on that were compared when `way` was planned."""
        return () if self.way is None else self._local.candidates

    @property
    def _caution_m(self) -> float:
        return ROUNDED * max(0.0, self.noise_m - QUIET_M)

    def path_to(self, grid: GridMap, start: Pose2, goal: Pose2) -> Path:
        """Return a path with as much room beside it as there is.

        Raises:
            PathError: why there is none with the widest margin.
        """
        problem: PathError | None = None
        for margin_m in MARGINS_M:
            try:
                return self._planner(grid, self.limits, start, goal, margin_m + self._caution_m)
            except PathError as cause:
                problem = problem or cause
        raise problem or PathError("no margin to plan with")

    def follow(self, path: Path, grid: GridMap, here: Whereabouts, steering_rad: float) -> None:
        """Follow a path from now on; arguments as those of `replan`."""
        self.path = path
        room_m = outline_clearance(scene_of(grid, self.limits), here.pose)
        self._stop_m = min(STOP_M + self._caution_m, room_m - SLACK_M)
        self.replan(grid, here, steering_rad)

    def replan(self, grid: GridMap, here: Whereabouts, steering_rad: float) -> None:
        """Plan the next stretch of the path from where the car is, on the grid as it is now."""
        if self.path is not None:
            self.way = self._local.plan(
                grid, self.path, here.pose, here.speed_mps, steering_rad, discs_of(self.others),
                here.t_ns / NS_PER_S,
            )  # fmt: skip
            self._tracker.follow(self.way)

    def stop(self) -> None:
        """Stand."""
        self._tracker.stop()
        self.way = None

    def is_blocked(self, grid: GridMap) -> bool:
        """Return whether something stands or will be in the way of the next `LOOK_AHEAD_S`."""
        ahead, when_s = sampled(self.limits, *self._tracker.ahead(LOOK_AHEAD_S))
        if len(ahead) == 0:
            return False
        if comes_near(ahead, when_s, discs_of(self.others), self.limits):
            return True
        return bool(np.isinf(room(scene_of(grid, self.limits), ahead, self._stop_m)).any())

    def command(self, now_ns: int, here: Whereabouts, steering_rad: float) -> Command:
        """Return the command for now."""
        late_s = min(max(0, now_ns - here.t_ns) / NS_PER_S, LATEST_S)
        pose = here.pose @ Pose2(here.speed_mps * late_s, 0.0, here.yaw_rate_radps * late_s)
        return self._tracker.command(
            now_ns, pose, here.speed_mps, steering_rad, here.yaw_rate_radps
        )
