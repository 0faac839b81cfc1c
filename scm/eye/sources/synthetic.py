"""The emulated overhead camera: renders what a real one would see of a snapshot of the world.

Emulated real cars are rendered at their true poses, see `scm.v2x.emulated_cars`.

Cars have height, so they shift outwards as in a real picture; tags go through the true lens; edges
are antialiased; the sensor adds Gaussian noise. The noise is a random part of a sheet drawn once:
fresh noise would cost more than the whole picture.
"""

import math

import cv2
import numpy as np

from scm.arrays import Image
from scm.clock import NS_PER_S
from scm.eye.camera import CameraModel
from scm.eye.render.car import draw_car
from scm.eye.render.floor import draw_box, draw_scenery
from scm.eye.source import Frame
from scm.geometry import Pose2
from scm.records.city_map import CityMap
from scm.runtime.part import Subscription
from scm.v2x.emulated_cars import EmulatedCars
from scm.v2x.exchange import Incoming
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

NOISE_SHEETS = 2
MIN_PERIOD_SHARE = 0.7
"""Minimum interval of pictures, as a share of the period."""


class SyntheticSource:
    """Frames of the world as `model`, the true camera, sees it.

    Attributes:
        problem: Always None: nothing can go wrong.
        subscriptions: The poses of emulated cars.
    """

    problem: str | None = None
    subscriptions = (Subscription(EmulatedPose),)

    def __init__(self, city_map: CityMap, model: CameraModel, rng: np.random.Generator) -> None:
        self._model = model
        self._rng = rng
        self._scenery = draw_scenery(city_map, model, rng)
        self._boxes = {box.name: box for box in city_map.boxes if box.mass_kg is not None}
        self._frame: Image = self._scenery.picture.copy()
        self._brighter, self._darker = self._noise()
        self._frame_ns: int | None = None
        self._emulated = EmulatedCars()

    def receive(self, item: Incoming) -> None:
        """Store the pose of an emulated car."""
        if isinstance(item.message, EmulatedPose):
            self._emulated.update(item.message)

    def read(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the picture at the snapshot's time, None if none is due."""
        del now_ns
        if light is None or not self._is_due(light.t_ns):
            return None
        self._frame_ns = light.t_ns
        return Frame(light.t_ns, self.render(self._emulated.seen(light)))

    def _is_due(self, t_ns: int) -> bool:
        """Return whether a camera of this rate takes a picture now, whenever snapshots come."""
        if self._frame_ns is None or t_ns < self._frame_ns:
            return True
        return (t_ns - self._frame_ns) * self._model.camera.rate_hz > MIN_PERIOD_SHARE * NS_PER_S

    def close(self) -> None:
        """Do nothing: no resource is held."""

    def render(self, light: WorldSnapshot) -> Image:
        """Return the picture of a snapshot, (height, width, 3); it is valid until the next one."""
        np.copyto(self._frame, self._scenery.picture)
        x, y, _ = self._model.position
        things = [*light.vehicles, *(light.boxes or self._boxes.values())]
        for thing in sorted(things, key=lambda one: -math.hypot(one.x_m - x, one.y_m - y)):
            if isinstance(thing, SnapshotVehicle):
                draw_car(self._frame, self._model, self._scenery, thing)
            elif thing.name in self._boxes:
                pose = Pose2(thing.x_m, thing.y_m, thing.yaw_rad)
                draw_box(self._frame, self._model, self._boxes[thing.name], pose)
        self._add_noise()
        return self._frame

    def _noise(self) -> tuple[Image, Image]:
        camera = self._model.camera
        count = NOISE_SHEETS * camera.width_px * camera.height_px
        noise = self._rng.standard_normal(count, dtype=np.float32) * np.float32(camera.noise_sigma)
        grey = np.rint(noise)
        both = [np.repeat(np.clip(part, 0, 255).astype(np.uint8), 3) for part in (grey, -grey)]
        return both[0], both[1]

    def _add_noise(self) -> None:
        size = self._frame.size
        start = 3 * int(self._rng.integers(0, (len(self._brighter) - size) // 3 + 1))
        shape = self._frame.shape
        cv2.add(self._frame, self._brighter[start : start + size].reshape(shape), self._frame)
        cv2.subtract(self._frame, self._darker[start : start + size].reshape(shape), self._frame)
