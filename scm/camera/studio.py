"""Renders one picture of one camera: sky, floor, shadows, objects, lens, sensor."""

from collections.abc import Callable, Mapping, Sequence
from typing import Generic, TypeVar

import cv2
import msgspec
import numpy as np

from scm.arrays import Floats, Image
from scm.camera.car_mesh import car_thing, footprint
from scm.camera.daylight import Daylight
from scm.camera.floor import SHADE, Floor, horizon_rows
from scm.camera.lens import Lens, View
from scm.camera.look import Look
from scm.camera.motion import STILL, begin, doublings, smear
from scm.camera.optics import Optics
from scm.camera.painter import Painter
from scm.camera.sensor import Noise
from scm.camera.standing import (
    Ball,
    box_shadow,
    box_thing,
    light_thing,
    post_balls,
    sign_thing,
    wall_balls,
    wall_thing,
)
from scm.geometry import Pose2
from scm.records.boxes import SnapshotBox
from scm.records.city_map import Box, CityMap
from scm.scenery.bodies import car_rotation
from scm.scenery.canvas import Colour
from scm.v2x.messages.world_snapshot import SnapshotVehicle

SKY_HIGH: Colour = (226, 206, 178)
SKY_LOW: Colour = (238, 232, 224)
SKY_RAD = 0.6

S = TypeVar("S")
T = TypeVar("T")
Shown = Mapping[int, str | None]
"""Which lamp of each signal head is on, by the light's id."""


class Studio:
    """A city ready to be pictured by any number of cameras.

    Args:
        city_map: The city.
        daylight: The light in it.
        seed: Of the floor's grain and the sensors' noise.
    """

    def __init__(self, city_map: CityMap, daylight: Daylight, seed: int = 0) -> None:
        self._map = city_map
        self._daylight = daylight
        self._seed = seed
        self._floor = Floor(city_map, daylight, seed)
        self._walls = _Still(wall_balls(city_map), wall_thing)
        self._signs = _Still(post_balls(city_map.signs), sign_thing)
        self._heads = _Still(post_balls(city_map.lights), lambda light: light)
        self._kinds: dict[Optics, _Kind] = {}

    def picture(
        self,
        optics: Optics,
        car: SnapshotVehicle,
        cars: Sequence[SnapshotVehicle],
        shown: Shown,
        camera: str,
        t_ns: int,
        moved: Sequence[SnapshotBox] = (),
        motion: Pose2 = STILL,
    ) -> Image:
        """Return a frame, (height, width, 3); it is valid until the next one.

        Args:
            optics: Of the camera.
            car: The one that carries it, which it does not see.
            cars: All cars, that one included.
            shown: What the signal heads show.
            camera: Its name, and with it its noise.
            t_ns: When it is exposed.
            moved: Poses of boxes that were pushed; the others are at their place on the map.
            motion: Of the car during the exposure, half of it before `t_ns`.
        """
        kind = self._kind(optics)
        at = Pose2(car.x_m, car.y_m, car.yaw_rad)
        view = kind.lens.view(car_rotation(car), np.array([car.x_m, car.y_m, 0.0]))
        warps = doublings(kind.lens, view, at, motion)
        if warps:
            at = begin(at, motion, warps)
            car = msgspec.structs.replace(car, x_m=at.x, y_m=at.y, yaw_rad=at.yaw)
            view = kind.lens.view(car_rotation(car), np.array([at.x, at.y, 0.0]))
        canvas = kind.canvas
        self._sky(canvas, kind, view)
        self._floor.paint(canvas, kind.lens, view, self._daylight.intensity * kind.exposure)
        boxes = self._boxes(moved)
        self._shadows(canvas, kind, view, cars, boxes)
        lights = self._heads.visible(kind.painter, view)
        things = [
            *self._walls.visible(kind.painter, view),
            *self._signs.visible(kind.painter, view),
            *(box_thing(box) for box in boxes),
            *(light_thing(light, shown.get(light.light_id)) for light in lights),
            *(car_thing(other) for other in cars if other.vehicle != car.vehicle),
        ]
        kind.painter.paint(canvas, view, things)
        smear(canvas, kind.lens, view, at, motion, warps)
        frame = kind.look.apply(kind.lens.bend(canvas))
        kind.noise.add(frame, car.vehicle, camera, t_ns)
        return frame

    def _boxes(self, moved: Sequence[SnapshotBox]) -> list[Box]:
        """Return the map's boxes where they are now."""
        now = {box.name: box for box in moved}
        boxes = []
        for box in self._map.boxes:
            at = now.get(box.name)
            pose = {} if at is None else {"x_m": at.x_m, "y_m": at.y_m, "yaw_rad": at.yaw_rad}
            boxes.append(msgspec.structs.replace(box, **pose))
        return boxes

    def _kind(self, optics: Optics) -> "_Kind":
        if optics not in self._kinds:
            self._kinds[optics] = _Kind(optics, self._daylight, self._seed)
        return self._kinds[optics]

    def _sky(self, canvas: Image, kind: "_Kind", view: View) -> None:
        """Paint what is above the horizon; the floor then covers the rest."""
        height, width = canvas.shape[:2]
        rows = horizon_rows(kind.lens, view, width)
        low = int(np.clip(np.ceil(max(rows)) + 1, 0, height))
        start = np.clip(kind.horizon - round(sum(rows) / 2), 0, len(kind.sky) - low)
        canvas[:low] = kind.sky[start : start + low]

    def _shadows(
        self,
        canvas: Image,
        kind: "_Kind",
        view: View,
        cars: Sequence[SnapshotVehicle],
        boxes: Sequence[Box],
    ) -> None:
        keep = 1.0 - (1.0 - SHADE) * (1.0 - self._daylight.ambient) * 1.2
        for box in boxes:
            self._shadow(canvas, kind, view, box_shadow(box), keep)
        for car in cars:
            foot, deck = footprint(car)
            if kind.painter.sees(view, foot.mean(axis=0), 0.35):
                under = foot.mean(axis=0) + 0.96 * (foot - foot.mean(axis=0))
                self._shadow(canvas, kind, view, _raised(foot, deck), keep)
                kind.painter.shade(canvas, view, under[:, :2], 0.62)

    def _shadow(
        self, canvas: Image, kind: "_Kind", view: View, corners: Floats, keep: float
    ) -> None:
        thrown = self._daylight.shadow_of(corners).astype(np.float32)
        hull = np.asarray(cv2.convexHull(thrown), dtype=np.float64)[:, 0]
        kind.painter.shade(canvas, view, hull, keep)


def _raised(foot: Floats, height: float) -> Floats:
    """Return a foot and the same at a height."""
    top = foot.copy()
    top[:, 2] += height
    return np.concatenate((foot, top))


class _Still(Generic[S, T]):
    """What never moves: the visible part is found at once, and only that is ever built."""

    def __init__(self, balls: Sequence[Ball[S]], make: Callable[[S], T]) -> None:
        self._balls = balls
        self._make = make
        self._made: dict[int, T] = {}
        self._middles = np.array([ball.middle for ball in balls]).reshape(-1, 3)
        self._radii = np.array([ball.radius for ball in balls])

    def visible(self, painter: Painter, view: View) -> list[T]:
        """Return what can be in the picture."""
        mask = painter.visible(view, self._middles, self._radii)
        found: list[int] = np.flatnonzero(mask).tolist()
        for i in found:
            if i not in self._made:
                self._made[i] = self._make(self._balls[i].of)
        return [self._made[i] for i in found]


class _Kind:
    """What all cameras of equal optics share."""

    def __init__(self, optics: Optics, daylight: Daylight, seed: int) -> None:
        self.lens = Lens(optics)
        self.exposure = optics.exposure * optics.gain
        self.painter = Painter(self.lens, daylight, self.exposure)
        self.look = Look(optics)
        self.noise = Noise(optics, seed)
        width, height = self.lens.canvas_size
        self.canvas: Image = np.zeros((height, width, 3), dtype=np.uint8)
        rows = round(SKY_RAD * optics.focal_px)
        self.horizon = height + rows
        share = np.clip((rows - np.arange(2 * height + rows)[:, None]) / rows + height / rows, 0, 1)
        colours = np.array(SKY_LOW) + share * (np.array(SKY_HIGH, dtype=np.float64) - SKY_LOW)
        lit = colours * daylight.intensity * self.exposure
        shown = lit.clip(0.0, 255.0).round().astype(np.uint8)
        self.sky: Image = np.ascontiguousarray(np.repeat(shown[:, None], width, axis=1))
