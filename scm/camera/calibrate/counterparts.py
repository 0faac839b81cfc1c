"""Rendered frames from places that look like those where real frames were taken.

Nobody knows the poses of real frames. So many places on the lanes are rendered small, and each real
frame gets the one whose floor correlates with its own: brightness and contrast do not matter there.
"""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.camera.daylight import Daylight
from scm.camera.floor import horizon_rows
from scm.camera.lens import Lens
from scm.camera.optics import Optics
from scm.camera.studio import Studio
from scm.errors import EyeError
from scm.geometry import Pose2
from scm.maps.route import LanePath
from scm.records.city_map import CityMap
from scm.v2x.messages.world_snapshot import SnapshotVehicle

PLACES = 500
BESIDE_M, TURNED_RAD = 0.02, 0.07
WIDTH_PX = 160
"""Of a small frame: noise and the lens's softness are gone in it, colours are not."""
_WIDTH_TO_COMPARE_PX = 64
_BELOW_HORIZON = 0.03  # of the height


class Counterparts:
    """Renders what one camera sees of an empty city.

    Args:
        city_map: Where the real frames were taken.
        optics: Of the camera; how it looks does not matter.
        camera: Its name.
        seed: Of places, grain and noise.

    Raises:
        EyeError: when the map has no lanes, or the camera does not see the floor.
    """

    def __init__(self, city_map: CityMap, optics: Optics, camera: str, seed: int) -> None:
        self.plain = replace(
            optics, exposure=1.0, gain=1.0, white_balance=(1.0, 1.0, 1.0), gamma=1.0,
            vignetting=0.0, blur_px=0.0, read_noise=0.0, shot_noise=0.0,
        )  # fmt: skip
        self._camera = camera
        self._studio = Studio(city_map, Daylight(), seed)
        self._places = _places(city_map, np.random.default_rng([seed, *b"places"]))
        lens = Lens(self.plain)
        level = lens.view(np.eye(3), np.zeros(3))
        horizon = max(horizon_rows(lens, level, optics.width_px)) / optics.height_px
        self.floor = max(0.0, horizon + _BELOW_HORIZON)
        if self.floor > 0.8:
            raise EyeError(f"camera {camera}: hardly sees the floor, which colours are fitted to")
        scale = WIDTH_PX / optics.width_px
        small = replace(
            self.plain, width_px=WIDTH_PX, height_px=round(optics.height_px * scale),
            focal_px=optics.focal_px * scale,
        )  # fmt: skip
        seen = np.stack([self._picture(place, small) for place in self._places])
        self._seen = self._compared(seen)

    def places_like(self, real: Image) -> list[Pose2]:
        """Return where each small real frame may have been taken."""
        alike = self._compared(real) @ self._seen.T
        return [self._places[i] for i in alike.argmax(axis=1)]

    def frames(self, places: Sequence[Pose2], optics: Optics) -> Image:
        """Return frames, (n, height, width, 3)."""
        return np.stack([self._picture(place, optics) for place in places])

    def floor_of(self, images: Image) -> Image:
        """Return the rows of frames that lie below the horizon."""
        return images[:, int(self.floor * images.shape[1]) :]

    def _picture(self, place: Pose2, optics: Optics) -> Image:
        car = SnapshotVehicle(
            vehicle="camera", kind="hosted", car="nigel", tag_id=0, x_m=place.x, y_m=place.y,
            yaw_rad=place.yaw, speed_mps=0.0, steering_rad=0.0,
        )  # fmt: skip
        number = round(1e6 * (place.x + place.y))  # of the noise
        return self._studio.picture(optics, car, (), {}, self._camera, number).copy()

    def _compared(self, images: Image) -> Floats:
        """Return the grey of the floor with mean 0 and length 1, (n, pixels)."""
        size = (_WIDTH_TO_COMPARE_PX, _height(images, _WIDTH_TO_COMPARE_PX))
        smaller = np.stack([cv2.resize(one, size, interpolation=cv2.INTER_AREA) for one in images])
        flat = self.floor_of(smaller).mean(axis=3).reshape(len(images), -1)
        flat -= flat.mean(axis=1, keepdims=True)
        compared: Floats = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-9)
        return compared


def small(images: Image) -> Image:
    """Return frames made small."""
    size = (WIDTH_PX, _height(images, WIDTH_PX))
    return np.stack([cv2.resize(one, size, interpolation=cv2.INTER_AREA) for one in images])


def _height(images: Image, width: int) -> int:
    """Return the height of frames that are made so wide."""
    height, old = images.shape[1:3]
    wanted: int = round(width * height / old)
    return wanted


def _places(city_map: CityMap, rng: np.random.Generator) -> list[Pose2]:
    """Return places on the lanes, as often as a lane is long."""
    lanes = [LanePath(lane) for lane in city_map.lanes]
    if not lanes:
        raise EyeError(f"map {city_map.name}: has no lanes, expected those that the car drove")
    lengths = np.array([lane.length_m for lane in lanes])
    places = []
    for i in rng.choice(len(lanes), PLACES, p=lengths / lengths.sum()):
        beside, turned = rng.standard_normal(2) * (BESIDE_M, TURNED_RAD)
        at = lanes[i].at(float(rng.uniform(0.0, lengths[i])))
        places.append(at @ Pose2(0.0, float(beside), float(turned)))
    return places
