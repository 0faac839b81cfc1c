"""The way that cars of a task drive: where they begin, and how far they come from there.

AlongLanes    from anywhere on the lanes, along them without end
ToGoal        from one of some places of the map to one of others
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from scm.arrays import Floats, Ints
from scm.errors import MapError
from scm.gym.task import PlaceStart, Start
from scm.maps.route import roads_of
from scm.records.city_map import CityMap
from scm.vehicles.drivers.course import DONE_M, Course
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import array_kernel
from scm.vehicles.lane_math import sin_cos

# Columns of what is known of each car's goal: its place and direction seen from the car, how far
# away it is, and how far the car is turned from it.
AHEAD_M, LEFT_M, COS_TURN, SIN_TURN, AWAY_M, TURNED_RAD = range(6)
COLUMNS = 6
# Columns of an episode's draws, uniform from 0 to 1.
WHERE, AHEAD_DRAW, TURNED_DRAW, GOAL_DRAW, SPEED_DRAW, LEFT_DRAW = range(6)
BRANCHES, GAP_DRAW = 3, 5  # on lanes
DRAWS = 6


class Way(Protocol):
    """Where cars begin, and how far they come from there, rows of them."""

    def begin(self, rows: Ints, draws: Floats) -> Floats:
        """Let cars begin; return x, y and yaw of their rear axles, map frame, (n, 3) [m, rad].

        Args:
            rows: Which, (n,).
            draws: Of their episodes, 0 to 1, (n, 6).
        """

    def look_at_start(self, fleet: Fleet, rows: Ints) -> None:
        """Find where cars (n,) are that begin: they have not moved."""

    def look(self, fleet: Fleet) -> None:
        """Find where all cars are after a step."""


class AlongLanes:
    """Cars that drive along lanes, without end.

    Args:
        city_map: With its lanes.
        cars: Rows of each world's, (worlds, cars); agents' rows are the first of all.
        agents: How many rows are agents'.
        start: Where on a lane they begin.
        lanes: By name, that they begin on; none: any from which one can go on.

    Attributes:
        course: Where all cars are along their lanes.
        known: Of the agents' cars, see `Course`, (agents, columns).
        moved_m: How far each of them came along its lanes in this step, (agents,).

    Raises:
        MapError: There is no such lane, or none from which one can go on.
    """

    def __init__(
        self, city_map: CityMap, cars: Ints, agents: int, start: Start, lanes: Sequence[str] = ()
    ) -> None:
        self.course = Course(city_map, cars.size, lanes)
        self.known = self.course.known[:agents]
        self.moved_m, self._done_m = np.zeros((2, agents))
        self._start, self._cars = start, cars.shape[1]

    @property
    def half_width(self) -> Floats:
        """Of each agent's lane [m]."""
        return self.course.half_width[: len(self.known)]

    def begin(self, rows: Ints, draws: Floats) -> Floats:
        """Let cars begin anywhere along the lanes, or one behind the other; see `Way`."""
        start, ahead = self._start, None
        if start.gap_m is not None:
            of_world = draws.reshape(-1, self._cars, draws.shape[1])
            of_world[:, :, [WHERE, BRANCHES]] = of_world[:, :1, [WHERE, BRANCHES]]
            ahead = _one_behind_the_other(of_world[:, :, GAP_DRAW], start)
        return self.course.begin(rows, draws, start.beside_m, start.turned_rad, ahead)

    def look_at_start(self, fleet: Fleet, rows: Ints) -> None:
        """Find where cars (n,) are that begin: they have not moved."""
        self.course.follow(fleet.x, fleet.y, fleet.yaw, rows)
        own = rows[rows < len(self.known)]
        self.moved_m[own], self._done_m[own] = 0.0, self.known[own, DONE_M]

    def look(self, fleet: Fleet) -> None:
        """Find where all cars are after a step."""
        self.course.follow(fleet.x, fleet.y, fleet.yaw)
        done = self.known[:, DONE_M]
        np.subtract(done, self._done_m, out=self.moved_m)
        self._done_m[:] = done


def _one_behind_the_other(draws: Floats, start: Start) -> Floats:
    """Return how far ahead of its world's last each car begins, (worlds * cars,) [m].

    The first `start.behind` of the cars after the agent's follow it, the others lead.
    """
    low, high = start.gap_m or (0.0, 0.0)
    ahead = np.cumsum(low + (high - low) * draws, axis=1)
    order = np.arange(draws.shape[1])
    order[: start.behind + 1] = [start.behind, *range(start.behind)]
    found: Floats = ahead[:, order].ravel()
    return found


class ToGoal:
    """Cars that begin at drawn places of the map; each has a drawn goal.

    Args:
        city_map: With the places.
        rows: How many cars.
        start: Which places, and how far from them they begin.

    Attributes:
        goals: x, y and yaw of each car's, map frame, (rows, 3) [m, rad].
        known: Of each car, the columns above, (rows, 6).
        nearer: How much less than a step ago each is away [m] and turned [rad], (rows, 2).

    Raises:
        MapError: There is no such place.
    """

    def __init__(self, city_map: CityMap, rows: int, start: PlaceStart) -> None:
        roads, name = roads_of(city_map), city_map.name
        goals = start.goals.get(name) or tuple(bay.name for bay in city_map.bays)
        places = start.places.get(name) or tuple(one.name for one in city_map.spawns)
        if not goals or not places:
            raise MapError(f"map {name}: expected bays, and spawns to begin at")
        if start.is_paired and len(goals) != len(places):
            msg = f"map {name}: expected a goal for each of {len(places)} places, got {len(goals)}"
            raise MapError(msg)
        self._choice = np.array([roads.spawn_pose(one) for one in goals])
        self._places = np.array([roads.spawn_pose(one) for one in places])
        self._start, self._every = start, np.arange(rows)
        self.goals, self.known = np.zeros((rows, 3)), np.zeros((rows, COLUMNS))
        self.nearer: Floats = np.zeros((rows, 2))

    def begin(self, rows: Ints, draws: Floats) -> Floats:
        """Let cars begin near one of the places each, with a goal; see `Way`."""
        where = (draws[:, WHERE] * len(self._places)).astype(np.int64)
        chosen = (draws[:, GOAL_DRAW] * len(self._choice)).astype(np.int64)
        self.goals[rows] = self._choice[where if self._start.is_paired else chosen]
        most = (self._start.aside_m, self._start.aside_m, self._start.turned_rad)
        offsets = 2.0 * draws[:, [AHEAD_DRAW, LEFT_DRAW, TURNED_DRAW]] - 1.0
        found: Floats = self._places[where] + np.array(most) * offsets
        return found

    def look_at_start(self, fleet: Fleet, rows: Ints) -> None:
        """Find where cars (n,) are that begin: they have not moved."""
        see(self.goals, fleet.x, fleet.y, fleet.yaw, rows, self.known)
        self.nearer[rows] = 0.0

    def look(self, fleet: Fleet) -> None:
        """Find where all cars are after a step."""
        before = self.known[:, AWAY_M:].copy()
        see(self.goals, fleet.x, fleet.y, fleet.yaw, self._every, self.known)
        np.subtract(before, self.known[:, AWAY_M:], out=self.nearer)


@array_kernel
def see(goals: Floats, x: Floats, y: Floats, yaw: Floats, rows: Ints, known: Floats) -> None:
    """Find where goals are, seen from some cars (n,); all else is of all cars, (rows, ...)."""
    for n in range(len(rows)):
        row = rows[n]
        dx, dy = goals[row, 0] - x[row], goals[row, 1] - y[row]
        s, c = sin_cos(yaw[row])
        goal_s, goal_c = sin_cos(goals[row, 2])
        known[row, AHEAD_M], known[row, LEFT_M] = c * dx + s * dy, c * dy - s * dx
        turn_c, turn_s = goal_c * c + goal_s * s, goal_s * c - goal_c * s
        known[row, COS_TURN], known[row, SIN_TURN] = turn_c, turn_s
        known[row, AWAY_M] = np.sqrt(dx * dx + dy * dy)
        known[row, TURNED_RAD] = abs(np.arctan2(turn_s, turn_c))
