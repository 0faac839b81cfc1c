"""Which cars of many worlds touch a wall, or another car of their own world."""

from itertools import combinations

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.records.city_map import CityMap
from scm.vehicles.car import Car
from scm.world.broad_phase import (
    LEEWAY_M,
    LOOK_AHEAD_S,
    has_strayed,
    mark,
    obstacles_of,
    walls_near,
)
from scm.world.solids import hull_of, obstacle_boxes, outline_of

NO_BOXES = 2**31  # every body is a car


class Touching:
    """Finds who touches something.

    Args:
        city_map: Its walls and boxes never move, whatever hits them.
        car: What all cars are.
        cars: Rows of each world's, (worlds, cars).
        agents: How many of each world's are agents'; what others touch of each other is not found.
    """

    def __init__(self, city_map: CityMap, car: Car, cars: Ints, agents: int) -> None:
        self._obstacles = obstacles_of(obstacle_boxes(city_map))
        rows = cars.size
        self._outlines = np.tile(np.array(outline_of(hull_of(car))), (rows, 1))
        pairs = [pair for pair in combinations(range(cars.shape[1]), 2) if pair[0] < agents]
        within = np.array(pairs, np.int64).reshape(-1, 2)
        self._pairs: Ints = cars[:, within].reshape(-1, 2)
        self._rows = np.arange(rows)
        self._from, self._leeway = np.full((rows, 2), np.inf), np.zeros(rows)
        self._walls: Ints = np.zeros((0, 2), np.int64)

    def find(self, motion: Floats, *, present: Bools) -> Bools:
        """Return which cars touch something now, (rows,); those that are not there, only walls.

        Args:
            motion: x, y, yaw and their rates of centres of gravity, map frame, (rows, 6).
            present: Which cars are there at all.
        """
        if has_strayed(self._rows, self._rows, self._from, self._leeway, motion):
            self._list_walls(motion)
        pairs, marks = self._pairs, np.zeros(len(motion), np.bool_)
        if len(pairs) and not present.all():
            pairs = pairs[present[pairs].all(axis=1)]
        boxes = self._obstacles.boxes
        mark(marks, pairs, self._walls, motion, self._outlines, boxes, NO_BOXES)
        return marks

    def _list_walls(self, motion: Floats) -> None:
        self._from = motion[:, :2].copy()
        self._leeway = LEEWAY_M + LOOK_AHEAD_S * np.hypot(motion[:, 3], motion[:, 4])
        reach = self._outlines[:, 4] + self._leeway
        self._walls = walls_near(motion, reach, self._obstacles)
