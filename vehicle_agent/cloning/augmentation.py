"""Frames as they would look from beside the way, in other light, or in a mirror.

A car that only ever saw its way from the middle does not know how to come back to it. The floor is
a plane, so the picture from another place on it is the frame under a homography; what stands on the
floor is distorted a little. The command that belongs to such a picture leads back:

    curvature = that of the demonstration - 2 offset / way^2 - 2 heading / way

which is pure pursuit of a point on the lane, `way` ahead.
Frames: the car's body frame, x ahead, y left, z up; OpenCV's camera axes.
Source: Bojarski et al., 2016, has shifted and turned views; the homography of the floor and the
command by pure pursuit are ours.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.camera.optics import Optics
from vehicle_agent.autonomy.plan import CarLimits

TO_CAMERA = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
SHADE = (0.35, 0.9)  # light that is left in a shadow


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How far frames are changed.

    Attributes:
        offset_std_m, heading_std_rad: Of the car beside its way.
        way_m: In which it comes back.
        mirrored: Share of frames; 0 where left and right differ, as in traffic of two lanes.
        light: Factors on the light, least and greatest.
        tint: Standard deviation of a factor on each colour.
        shadow: Share of frames with a shadow across them.
    """

    offset_std_m: float = 0.03
    heading_std_rad: float = 0.08
    way_m: float = 0.5
    mirrored: float = 0.5
    light: tuple[float, float] = (0.35, 1.8)
    tint: float = 0.05
    shadow: float = 0.3


class Augmenter:
    """Changes frames of one camera, and the steering that belongs to them.

    Args:
        optics: Of the camera that took the frames.
        limits: Of the car that was driven.
        size_px: Width and height of the frames, which may have been made smaller.
        how: How far.
        rng: Of all that is drawn.
    """

    def __init__(
        self, optics: Optics, limits: CarLimits, size_px: tuple[int, int], how: Augmentation,
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        self._optics, self._limits, self._size, self._how = optics, limits, size_px, how
        self._rng = rng
        self._to_floor = np.linalg.inv(self._from_floor(0.0, 0.0))

    def __call__(self, frames: Sequence[Image], steering: float) -> tuple[list[Image], float]:
        """Return frames (h, w, 3), changed alike, and the steering command that belongs to them."""
        how, rng = self._how, self._rng
        offset_m, heading_rad = rng.standard_normal(2) * (how.offset_std_m, how.heading_std_rad)
        changed = [self.seen_from(frame, offset_m, heading_rad) for frame in frames]
        steering = self.steering_back(steering, offset_m, heading_rad)
        if rng.random() < how.mirrored:
            changed, steering = [frame[:, ::-1].copy() for frame in changed], -steering
        factors = rng.uniform(*how.light) * (1.0 + how.tint * rng.standard_normal(3))
        shadow = self._shadow() if rng.random() < how.shadow else None
        return [_lit(frame, factors, shadow) for frame in changed], steering

    def seen_from(self, frame: Image, offset_m: float, heading_rad: float) -> Image:
        """Return a frame as seen from so far to the left, turned so far to the left."""
        moved = self._from_floor(offset_m, heading_rad) @ self._to_floor
        return np.asarray(
            cv2.warpPerspective(frame, moved, self._size, borderMode=cv2.BORDER_REPLICATE)
        )

    def steering_back(self, steering: float, offset_m: float, heading_rad: float) -> float:
        """Return the command, -1 to 1, of a car so far left of its way, turned so far left."""
        limits, way_m = self._limits, self._how.way_m
        curvature = math.tan(steering * limits.steering_rad) / limits.wheelbase_m
        curvature -= 2.0 * offset_m / way_m**2 + 2.0 * heading_rad / way_m
        angle = math.atan(curvature * limits.wheelbase_m)
        return float(np.clip(angle / limits.steering_rad, -1.0, 1.0))

    def _from_floor(self, offset_m: float, heading_rad: float) -> Floats:
        """Return the homography from the floor about the car that drove to a moved car's frame."""
        optics, (width, height) = self._optics, self._size
        focal = optics.focal_px * np.array((width / optics.width_px, height / optics.height_px))
        camera = np.array(
            [
                [focal[0], 0.0, 0.5 * (width - 1)],
                [0.0, focal[1], 0.5 * (height - 1)],
                [0.0, 0.0, 1.0],
            ]
        )
        c, s = math.cos(optics.pitch_down), math.sin(optics.pitch_down)
        pitched = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
        x, y, z = optics.position
        seen = np.array([[1.0, 0.0, -x], [0.0, 1.0, -y], [0.0, 0.0, -z]])
        c, s = math.cos(heading_rad), math.sin(heading_rad)
        body = np.array([[c, s, -s * offset_m], [-s, c, -c * offset_m], [0.0, 0.0, 1.0]])
        floor: Floats = camera @ pitched @ TO_CAMERA @ seen @ body
        return floor

    def _shadow(self) -> tuple[Image, float]:
        """Return the mask (h, w) of a shadow from the top to the bottom, and the light in it."""
        width, height = self._size
        ends = np.sort(self._rng.uniform(-0.2, 1.2, (2, 2)), axis=1) * width
        corners = ((ends[0, 0], 0), (ends[0, 1], 0), (ends[1, 1], height), (ends[1, 0], height))
        mask = np.zeros((height, width), np.uint8)
        cv2.fillConvexPoly(mask, np.round(corners).astype(np.int32), 255)
        return mask, float(self._rng.uniform(*SHADE))


def _lit(frame: Image, factors: Floats, shadow: tuple[Image, float] | None) -> Image:
    """Return a frame (h, w, 3) whose colours are multiplied by factors (3,), and a shadow on it."""
    lit: Image = np.asarray(cv2.LUT(frame, _table(factors)), dtype=np.uint8)
    if shadow is not None:
        mask, light = shadow
        cv2.copyTo(cv2.LUT(frame, _table(light * factors)), mask, lit)
    return lit


def _table(factors: Floats) -> Image:
    """Return what each value of each colour becomes (1, 256, 3)."""
    values: Floats = np.clip(np.arange(256.0)[:, None] * factors, 0.0, 255.0)
    return values[None].astype(np.uint8)
