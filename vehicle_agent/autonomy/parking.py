"""Drives a car to a goal and stands there: states, and when to plan again.

    localise    it stands until the scans say where it is
    plan        a path is looked for
    drive       it follows the path; a path that is blocked is planned anew
    recover     it stands: it lost its place, gets no scans, or its way is blocked
    parked      it stands within the tolerances of the goal
    failed      it stands and says why; a new goal begins anew

Pure: it has no bus and no clock. It knows the map, and what its car measures.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import PathError
from scm.geometry import Pose2
from scm.records.city_map import CityMap
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import Car
from scm.vehicles.parked import STANDS_MPS, is_parked
from vehicle_agent.autonomy.control import Command
from vehicle_agent.autonomy.grid_map import FREE, grid_of_cells, grid_of_city
from vehicle_agent.autonomy.navigation import OWN, Navigator, Stack
from vehicle_agent.autonomy.particle_filter import Localised
from vehicle_agent.autonomy.perception import Perception, Whereabouts

State = Literal["idle", "map", "localise", "plan", "drive", "recover", "parked", "failed"]

SILENT_NS = 1_000 * NS_PER_MS  # without a scan
LOCALISE_NS = 1_500 * NS_PER_MS  # until a pose must be known
PLAN_AGAIN_NS = 1 * NS_PER_S
BLOCKED_NS = 20 * NS_PER_S  # until a blocked car gives up
ANOTHER_ROOM = "is it the map of this room, and does nothing hide its walls?"
AMBIGUOUS_NS = 3 * NS_PER_S  # that two places may fit
UNFIT_NS = 20 * NS_PER_S  # that the scans may not fit the map, before it gives up
SWEEP_NS = 140 * NS_PER_MS  # of the sweeps that `prepare` makes up
ATTEMPTS = 40  # drives to a goal


@dataclass(frozen=True, slots=True)
class Report:
    """What the car does and why.

    Attributes:
        reason: In words; empty where there is nothing to say.
    """

    state: State
    reason: str = ""


class Parking:
    """Parks one car.

    Args:
        car: Its file.
        city_map: Where it is.
        goal: Of the rear axle, map frame.
        start: Where it roughly stands; None: it looks for itself.
        seed: Of the particles.
        stack: Planner and controller.

    Attributes:
        navigator: Drives.
        perception: Senses.

    Raises:
        ScmError: when the car file or the map lacks what is needed.
    """

    def __init__(
        self,
        car: Car,
        city_map: CityMap,
        goal: Pose2,
        start: Pose2 | None = None,
        seed: int = 0,
        stack: Stack = OWN,
    ) -> None:
        self.navigator, self._stack = Navigator(car, stack), stack
        self._map = grid_of_city(city_map)
        self.perception = Perception(car, self._map, seed)
        self.perception.begin(start)
        self.goal = goal
        self.report = Report("localise")
        self._is_new_scan = False
        self._since_ns: int | None = None
        self._scan_ns: int | None = None
        self._planned_ns: int | None = None
        self._blocked_ns: int | None = None
        self.attempts = 0

    def turn_to(self, goal: Pose2) -> None:
        """Park at another goal from now on."""
        self.goal, self.report, self.attempts = goal, Report("plan"), 0
        self._blocked_ns = self._planned_ns = None
        self.navigator.stop()

    def sensors(self, measured: VehicleSensors) -> None:
        """Take what the car's other sensors measured."""
        self.perception.sensors(measured)

    def scan(self, message: LidarScan, now_ns: int) -> None:
        """Take a sweep.

        Raises:
            MessageError: when the message is damaged.
        """
        self.perception.scan(message)
        self.navigator.noise_m = self.perception.noise_m
        self._scan_ns, self._is_new_scan = now_ns, True

    def step(self, now_ns: int) -> Command:
        """Return the command for now."""
        if self._since_ns is None:
            self._since_ns = now_ns
        if self._scan_ns is None:
            self._scan_ns = now_ns
        here, silent_ns = self.perception.now(), now_ns - self._scan_ns
        if self.report.state in ("parked", "failed"):
            pass
        elif silent_ns > SILENT_NS:
            self._stand("recover", f"no LIDAR scan for {silent_ns // NS_PER_S} s", now_ns)
        elif self.perception.mounting_problem:
            self._stand("failed", self.perception.mounting_problem, now_ns)
        elif here is None or not here.is_known:
            self._lose(here, now_ns)
        elif self.report.state != "drive":
            self._plan(here, now_ns)
        else:
            self._check(here, now_ns)
        if here is None:
            return Command(0.0, 0.0)
        return self.navigator.command(now_ns, here, self.perception.steering_rad)

    def _stand(self, state: State, reason: str, now_ns: int) -> None:
        if (state, reason) != (self.report.state, self.report.reason):
            if state != self.report.state:
                self._since_ns = now_ns
            self.report = Report(state, reason)
        self.navigator.stop()

    def _lose(self, here: Whereabouts | None, now_ns: int) -> None:
        """Stand until the pose is known again."""
        found, jump_s = self.perception.localised, self.perception.clock_jump_s
        state: State = "localise" if self.report.state == "localise" else "recover"
        if self.report.state != state:
            self._since_ns = now_ns
        lost_ns = now_ns - (self._since_ns or 0)
        reason = "waits for a scan"
        if found is None or here is None:
            if jump_s is not None:
                reason = f"the clock of its sensors jumped by {jump_s:+.0f} s: {reason}"
        elif found.alternative is not None:
            one, other = sorted((found.pose, found.alternative))
            reason = f"two places fit the scans, {_words(one)} and {_words(other)}"
            if lost_ns > AMBIGUOUS_NS:
                self._stand("failed", f"{reason}: give --start, or --eye", now_ns)
                return
        else:
            reason = _uncertainty(found)
        if lost_ns > LOCALISE_NS and state == "localise":
            if found is not None and found.is_lost:
                reason = f"the scans do not fit the map: {reason}; {ANOTHER_ROOM}"
                state = "failed" if lost_ns > UNFIT_NS else state
            else:
                reason = f"does not know where it is: {reason}"
        self._stand(state, reason, now_ns)

    def _plan(self, here: Whereabouts, now_ns: int) -> None:
        """Look for a path, from where the car stands."""
        if abs(here.speed_mps) > STANDS_MPS:
            return
        if self._planned_ns is not None and now_ns - self._planned_ns < PLAN_AGAIN_NS:
            return
        if self._is_parked(here):
            self._stand("parked", "", now_ns)
            return
        self._planned_ns = now_ns
        if self.attempts >= ATTEMPTS:
            self._stand("failed", f"not at the goal after {ATTEMPTS} attempts", now_ns)
            return
        grid = self.perception.obstacles.grid
        try:
            path = self.navigator.path_to(grid, here.pose, self.goal)
        except PathError as cause:
            self._blocked(here, str(cause), now_ns)
            return
        self._blocked_ns, self.attempts = None, self.attempts + 1
        self.report, self._is_new_scan = Report("drive"), False
        self.navigator.follow(path, grid, here, self.perception.steering_rad)

    def _blocked(self, here: Whereabouts, problem: str, now_ns: int) -> None:
        """Wait for what blocks the way to leave; give up where the map alone blocks it.

        Not the first time: sweeps may still tell that a wall stands elsewhere.
        """
        if self._blocked_ns is None:
            self._blocked_ns = now_ns
        else:
            try:
                self.navigator.path_to(self._map, here.pose, self.goal)
            except PathError as cause:
                self._stand("failed", str(cause), now_ns)
                return
        if now_ns - self._blocked_ns > BLOCKED_NS:
            self._stand("failed", problem, now_ns)
        else:
            self._stand("recover", f"waits: {problem}", now_ns)

    def _check(self, here: Whereabouts, now_ns: int) -> None:
        """Plan again where the path ended, or is blocked."""
        grid = self.perception.obstacles.grid
        if self.navigator.is_done:
            self._planned_ns = None
            self.report = Report("plan")
            self._plan(here, now_ns)
        elif self.navigator.is_blocked(grid):
            self._planned_ns = now_ns
            self._stand("plan", "something stands in the way", now_ns)
        elif self._is_new_scan:
            self._is_new_scan = False
            self.navigator.replan(grid, here, self.perception.steering_rad)

    def _is_parked(self, here: Whereabouts) -> bool:
        off, stack = self.goal.inverse() @ here.pose, self._stack
        away_m = math.hypot(off.x, off.y)
        within = stack.tolerance_m, stack.tolerance_rad
        return bool(is_parked(away_m, off.yaw, here.speed_mps, *within))


def _uncertainty(found: Localised) -> str:
    """Return why a place is not believed."""
    if found.is_lost:
        tenths = round(10.0 * found.explained.mean()) if len(found.explained) else 0
        expected = f"{100 * found.expected_share:.0f} % are expected"
        return f"about {10 * tenths} % of the echoes fit, {expected}"
    std = math.sqrt(found.covariance[0, 0] + found.covariance[1, 1])
    return f"the place is known within {std:.1f} m only"


def _words(pose: Pose2) -> str:
    """Return a pose as `--start` takes it."""
    return f"{pose.x:.2f},{pose.y:.2f},{round(math.degrees(pose.yaw))}"


def prepare(car: Car, stack: Stack = OWN) -> None:
    """Compile or load everything that a drive needs, so that no step of one takes long.

    Raises:
        CarError: when the car file lacks what is needed.
    """
    start, goal = Pose2(1.0, 1.0, 0.0), Pose2(1.7, 1.3, 0.5)
    grid = grid_of_cells(np.full((250, 250), FREE, np.int8), 0.01, 0.0, 0.0)
    navigator, here = Navigator(car, stack), Whereabouts(0, start, 0.0, 0.0, is_known=True)
    navigator.follow(navigator.path_to(grid, start, goal), grid, here, 0.0)
    navigator.is_blocked(grid)
    perception = Perception(car, grid)
    for pose in (start, None):
        perception.begin(pose)
        for t_ns in (0, SWEEP_NS):
            message = LidarScan(
                vehicle=car.path.stem,
                t_ns=t_ns,
                beams=360,
                range_min_m=0.1,
                range_max_m=12.0,
                payload=np.ones(360, "<f4").tobytes(),
                sweep_ns=SWEEP_NS,
            )
            perception.scan(message)
    perception.obstacles.update(start, np.ones((3, 2)))
