"""What the front cameras of many worlds' cars see: small grey pictures, five a second."""

from itertools import pairwise

import numpy as np

from scm.arrays import Ints
from scm.camera.batch import BatchCamera, Grey
from scm.camera.optics import cameras_of, optics_of
from scm.errors import CarError
from scm.gym.worlds import Worlds
from scm.scenery.bodies import car_body
from scm.vehicles.fleet_rows import pool

WIDTH_PX, RATE_HZ = 48, 5.0


class FrontCameras:
    """The front camera of each agent's car.

    Args:
        worlds: Of the cars.

    Attributes:
        names: Of the pixels, row by row from the top.

    Raises:
        CarError: The car file has no front camera.
    """

    def __init__(self, worlds: Worlds) -> None:
        if "front" not in cameras_of(worlds.car):
            raise CarError(f"{worlds.car.name}: expected a front camera, camera.position_m")
        self._worlds = worlds
        optics, body = optics_of(worlds.car, "front"), car_body(worlds.car.name)
        self._camera = BatchCamera(worlds.city_map, optics, body, WIDTH_PX)
        height, width = self._camera.height_px, self._camera.width_px
        self.names = tuple(
            f"grey_{row}_{column}" for row in range(height) for column in range(width)
        )
        self._newest: Grey = np.zeros((worlds.rows, height * width), np.float32)
        self._every = max(1, round(1.0 / (RATE_HZ * worlds.task.period_s)))

    def read(self) -> Grey:
        """Return the newest picture of each car, (rows, pixels), grey 0 to 1."""
        is_due = self._worlds.present & (self._worlds.row_steps % self._every == 0)
        self._expose(np.flatnonzero(is_due))
        return self._newest

    def _expose(self, cars: Ints) -> None:
        worlds, fleet = self._worlds, self._worlds.fleet
        poses = np.column_stack((fleet.x, fleet.y, fleet.yaw))
        others = worlds.cars[cars // worlds.agents]
        parts = max(1, min(fleet.threads, len(cars)))
        cuts = [len(cars) * k // parts for k in range(parts + 1)]

        def render(first: int, last: int) -> None:
            these = slice(first, last)
            self._camera.render(cars[these], others[these], poses, fleet.alive, self._newest)

        work = [
            pool(fleet.threads).submit(render, first, last) for first, last in pairwise(cuts[1:])
        ]
        render(0, cuts[1])
        for part in work:
            part.result()
