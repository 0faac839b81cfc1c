"""Maps an unknown room: where to look next, and the drive there.

A frontier is free floor beside unknown: groups of such cells, the nearest large one first. The car
looks all round, so it only has to come near: to the place near a group's middle with the most room.
Done when no group is left that is large enough and can be reached.
Source: Yamauchi, "A frontier-based approach for autonomous exploration", CIRA 1997.
"""

import math
from collections.abc import Sequence

import cv2
import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_S
from scm.errors import PathError
from scm.geometry import Pose2
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import Car
from vehicle_agent.autonomy.control import Command
from vehicle_agent.autonomy.grid_map import FREE, UNKNOWN, GridMap
from vehicle_agent.autonomy.mapping import Mapper
from vehicle_agent.autonomy.navigation import Navigator
from vehicle_agent.autonomy.odometry import CHECK_MOUNT, CONTRARY_WORDS, OdometryFilter, mount_of
from vehicle_agent.autonomy.outline import room, scene_of
from vehicle_agent.autonomy.parking import Report
from vehicle_agent.autonomy.perception import Whereabouts
from vehicle_agent.autonomy.plan import CarLimits, Path
from vehicle_agent.autonomy.sweep import sweep_of

LEAST_M = 0.15  # length of a frontier that is worth the way
NEAR_M = 0.6  # from its middle, where the car goes
SAME_M = 0.3  # two middles of the same frontier
HEADINGS = 8
TRIED = 6  # places near one frontier
MARGIN_M = 0.05  # of these places
LOOK_NS = 1 * NS_PER_S  # that it stands and looks, before it goes on
SILENT_NS = 1 * NS_PER_S
FIRST_SWEEPS, GRID_EVERY = 3, 4


class Exploration:
    """Maps the room about one car.

    Args:
        car: Its file.

    Attributes:
        mapper: Makes the map; its frame is the car's pose at the first sweep.
        navigator: Drives.
        report: What the car does.
        grid: The map as it was last drawn; None before a sweep.

    Raises:
        CarError: when the car file lacks what is needed.
    """

    def __init__(self, car: Car) -> None:
        self.mapper, self.navigator = Mapper(mount_of(car)), Navigator(car)
        self.report = Report("map", "looks round")
        self._odometry = OdometryFilter(car)
        self._pose: Pose2 | None = None
        self._at_sweep: Pose2 | None = None
        self.grid: GridMap | None = None
        self._steering_rad = 0.0
        self._visited: list[Floats] = []
        self._sweeps = 0
        self._begun_ns: int | None = None
        self._scan_ns: int | None = None
        self._stands_ns: int | None = None

    def sensors(self, measured: VehicleSensors) -> None:
        """Take what the car's other sensors measured."""
        self._odometry.sensors(measured)
        if measured.steering_rad is not None:
            self._steering_rad = measured.steering_rad

    def scan(self, message: LidarScan, now_ns: int) -> None:
        """Take a sweep.

        Raises:
            MessageError: when the message is damaged.
        """
        self._odometry.scan(message)
        moved = self._odometry.at_sweep
        if moved is None or moved.t_ns != message.t_ns:
            return
        self._pose = self.mapper.add(sweep_of(message), moved.pose)
        self._at_sweep, self._scan_ns = moved.pose, now_ns
        self._sweeps += 1
        if self.grid is None or self._sweeps % GRID_EVERY == 0:
            self.grid = self.mapper.grid()

    def step(self, now_ns: int) -> Command:
        """Return the command for now."""
        here, grid = self.here(), self.grid
        self.check_scans(now_ns)
        if here is None or grid is None:
            return Command(0.0, 0.0)
        if self.report.state == "map":
            self._explore(now_ns, here, grid)
        return self.navigator.command(now_ns, here, self._steering_rad)

    def check_scans(self, now_ns: int) -> None:
        """Stand and say so where no scans come; go on when they do. Give up on wrong ones."""
        if self._begun_ns is None:
            self._begun_ns = now_ns
        silent_ns = now_ns - (self._begun_ns if self._scan_ns is None else self._scan_ns)
        if self.report.state == "idle":
            return
        if self._odometry.is_contrary:
            self.report = Report("failed", f"{CONTRARY_WORDS}: {CHECK_MOUNT}")
            self.navigator.stop()
        elif silent_ns > SILENT_NS:
            self.report = Report("recover", f"no LIDAR scan for {silent_ns // NS_PER_S} s")
            self.navigator.stop()
        elif self.report.state == "recover":
            self.report = Report("map", "looks round")

    def here(self) -> Whereabouts | None:
        """Return where the car is now on its own map; None before a sweep."""
        odometry = self._odometry.now()
        if odometry is None or self._pose is None or self._at_sweep is None:
            return None
        pose = self._pose @ (self._at_sweep.inverse() @ odometry.pose)
        twist = odometry.twist
        return Whereabouts(
            odometry.t_ns, pose, twist.along_mps, twist.yaw_rate_radps, is_known=True
        )

    def _explore(self, now_ns: int, here: Whereabouts, grid: GridMap) -> None:
        if not self.navigator.is_done:
            if self.navigator.is_blocked(grid):
                self.navigator.stop()
            elif self._scan_ns == now_ns:
                self.navigator.replan(grid, here, self._steering_rad)
            return
        if self._stands_ns is None:
            self._stands_ns = now_ns
        if now_ns - self._stands_ns < LOOK_NS or self._sweeps < FIRST_SWEEPS:
            return
        self.grid = grid = self.mapper.grid()
        self._stands_ns = None
        found = next_view(grid, self.navigator, here.pose, self._visited)
        if found is None:
            seen = f"{(grid.cells == FREE).sum() * grid.cell_m**2:.2f} m2 of free floor"
            self.report = Report("idle", f"mapped all that can be reached, {seen}")
            return
        path, middle = found
        self._visited.append(middle)
        self.report = Report("map", f"goes on {path.length_m:.1f} m to see more")
        self.navigator.follow(path, grid, here, self._steering_rad)


def frontiers(grid: GridMap) -> list[Floats]:
    """Return the middles (2,) [m] of groups of free cells beside unknown ones."""
    unknown = (grid.cells == UNKNOWN).astype(np.uint8)
    beside = cv2.dilate(unknown, np.ones((3, 3), np.uint8))
    edge = ((grid.cells == FREE) & (beside > 0)).astype(np.uint8)
    count, _, stats, middles = cv2.connectedComponentsWithStats(edge, connectivity=8)
    least, corner = LEAST_M / grid.cell_m, np.array((grid.x_m, grid.y_m))
    return [
        corner + (middles[n] + 0.5) * grid.cell_m
        for n in range(1, count)
        if stats[n, cv2.CC_STAT_AREA] >= least
    ]


def next_view(
    grid: GridMap, navigator: Navigator, here: Pose2, visited: Sequence[Floats]
) -> tuple[Path, Floats] | None:
    """Return the path to the next place to look from, and the middle of the frontier it is for.

    None: nothing is left to see.

    Args:
        grid: What is known by now.
        navigator: Of the car.
        here: Where it stands.
        visited: Middles of frontiers that it has looked at from near: what is still unknown there
            cannot be seen.
    """
    new = [one for one in frontiers(grid) if all(math.dist(one, old) > SAME_M for old in visited)]
    near = sorted(new, key=lambda one: math.hypot(one[0] - here.x, one[1] - here.y))
    for middle in near:
        for goal in _places(grid, navigator.limits, middle, here):
            try:
                return navigator.path_to(grid, here, goal), middle
            except PathError:
                continue
    return None


def _places(grid: GridMap, limits: CarLimits, middle: Floats, here: Pose2) -> list[Pose2]:
    """Return poses near a frontier, those with the most room first."""
    reach = np.arange(-NEAR_M, NEAR_M + 1e-9, 0.1)
    x, y, yaw = np.meshgrid(
        middle[0] + reach, middle[1] + reach,
        here.yaw + np.arange(HEADINGS) * (math.tau / HEADINGS), indexing="ij",
    )  # fmt: skip
    poses = np.column_stack((x.ravel(), y.ravel(), yaw.ravel()))
    poses = poses[np.hypot(poses[:, 0] - middle[0], poses[:, 1] - middle[1]) < NEAR_M]
    free = room(scene_of(grid, limits), poses, MARGIN_M)
    best = np.argsort(-free, kind="stable")[:TRIED]
    return [Pose2(*map(float, poses[i])) for i in best if free[i] > -math.inf]
