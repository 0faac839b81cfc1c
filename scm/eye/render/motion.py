"""Cars that move while a frame is exposed: motion blur and rolling shutter."""

import math
from dataclasses import dataclass

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats, Image
from scm.eye.camera import CameraModel
from scm.eye.render.car import LaidOut, lay_out, paint_car, tag_on_roof
from scm.geometry import Pose2
from scm.scenery.tags import PRINT_SCALE
from scm.v2x.messages.world_snapshot import SnapshotVehicle

STILL_PX = 0.12
"""Cars that move less during the exposure are drawn once."""
STEP_PX = 0.5
MAX_STEPS = 64  # of one exposure
MARGIN_PX = 4
Gathered = NDArray[np.float32]
Rect = tuple[int, int, int, int]
"""Left, top, right, bottom; right and bottom are the first outside."""


@dataclass(frozen=True, slots=True)
class Driven:
    """A car and how it moves.

    Attributes:
        car: At the middle of the exposure of the middle row; speed along its x.
        yaw_rate_rad_s: + = turns left.
    """

    car: SnapshotVehicle
    yaw_rate_rad_s: float = 0.0

    @property
    def pose(self) -> Pose2:
        """Of the rear axle's middle, map frame."""
        return Pose2(self.car.x_m, self.car.y_m, self.car.yaw_rad)

    def after(self, dt_s: float) -> SnapshotVehicle:
        """Return the car at another time, at constant speed and yaw rate."""
        if dt_s == 0.0:
            return self.car
        turn, gone = self.yaw_rate_rad_s * dt_s, self.car.speed_mps * dt_s
        chord = gone * (math.sin(turn / 2.0) / (turn / 2.0) if abs(turn) > 1e-9 else 1.0)
        x, y, yaw = self.pose
        return msgspec.structs.replace(
            self.car,
            x_m=x + chord * math.cos(yaw + turn / 2.0),
            y_m=y + chord * math.sin(yaw + turn / 2.0),
            yaw_rad=yaw + turn,
        )


@dataclass(frozen=True, slots=True)
class Shutter:
    """When rows are exposed: for `exposure_s`, around a time that advances from row to row.

    Attributes:
        exposure_s: Exposure of each row.
        rolling_s: From the first row to the last; 0: all at once.
        height_px: Number of rows.
    """

    exposure_s: float
    rolling_s: float
    height_px: int

    def late(self, row: Floats | float) -> Floats:
        """Return the delay of a row's exposure relative to the middle row [s]."""
        last = max(self.height_px - 1, 1)
        inside = np.clip(np.asarray(row, dtype=np.float64), 0.0, last)
        found: Floats = (inside / last - 0.5) * self.rolling_s
        return found


def seen_at(model: CameraModel, driven: Driven, shutter: Shutter, at: Floats) -> Floats:
    """Return where points of a car appear, each at the middle of its own row's exposure.

    Args:
        model: The camera.
        driven: The car.
        shutter: Of the camera.
        at: Points on the car at the frame's time, map frame, (n, 3) [m].

    Returns:
        (n, 2) [px].
    """
    pixels = model.project(at)
    if shutter.rolling_s == 0.0:
        return pixels
    for _ in range(4):
        when = shutter.late(pixels[:, 1])
        moved = [_carried(driven, point, t) for point, t in zip(at, when, strict=True)]
        pixels = model.project(np.array(moved))
    return pixels


def _carried(driven: Driven, point: Floats, dt_s: float) -> tuple[float, float, float]:
    there = driven.after(float(dt_s))
    step = Pose2(there.x_m, there.y_m, there.yaw_rad) @ driven.pose.inverse()
    x, y = step.apply(float(point[0]), float(point[1]))
    return x, y, float(point[2])


def gathered(times: Floats, middles: Floats, exposure_s: float) -> Floats:
    """Return each row's weight of each sample, (rows, samples); each row sums to 1.

    Between samples the scene is assumed to change linearly; rows outside use the nearest.

    Args:
        times: Of the samples, evenly spaced, (samples,) [s].
        middles: Of the rows' exposures, (rows,) [s].
        exposure_s: Duration of each.
    """
    step = times[1] - times[0]
    half = max(exposure_s / step, 1e-6) / 2.0
    most = len(times) - 1.0 - half
    place = np.clip((middles - times[0]) / step, half, max(half, most))
    number = np.arange(len(times))
    low, high = (place - half)[:, None] - number, (place + half)[:, None] - number
    weights = _under_hat(high) - _under_hat(low)
    found: Floats = weights / weights.sum(axis=1, keepdims=True)
    return found


def _under_hat(u: Floats) -> Floats:
    """Return the area under a hat of height 1 from -1 to 1, from its left foot to `u`."""
    inside = np.clip(u, -1.0, 1.0)
    return np.where(inside < 0.0, 0.5 * (1.0 + inside) ** 2, 1.0 - 0.5 * (1.0 - inside) ** 2)


class CarLayer:
    """Draws a moving car by itself: once on black and once on white.

    The two give its colour and its transparency, shadow included; a row's light is then an average
    of that picture along the car's path.
    """

    def __init__(self, width: int, height: int) -> None:
        self._black: Image = np.zeros((height, width, 3), dtype=np.uint8)
        self._white: Image = np.full((height, width, 3), 255, dtype=np.uint8)

    def cut_out(self, placed: LaidOut, gain: float, rect: Rect) -> Image:
        """Return blue, green, red and transparency, (h, w, 4)."""
        left, top, right, bottom = rect
        parts = []
        for sheet, empty in ((self._black, 0), (self._white, 255)):
            window = sheet[top:bottom, left:right]
            paint_car(sheet, placed, gain)
            parts.append(window.copy())
            window[:] = empty
        ground = cv2.subtract(parts[1], parts[0])[..., 1]
        return np.dstack((parts[0], ground))


def paint_moving(
    frame: Image,
    car_layer: CarLayer,
    model: CameraModel,
    driven: Driven,
    shutter: Shutter,
    gain: float,
) -> tuple[Rect, LaidOut] | None:
    """Paint a moving car as a sensor records it; return its window, None if outside the frame.

    Args:
        frame: (height, width, 3); changed.
        car_layer: Of the same size.
        model: The camera.
        driven: The car.
        shutter: Of the camera.
        gain: Brightness of the light there.
    """
    roof = tag_on_roof(driven.car, PRINT_SCALE)
    middle = seen_at(model, driven, shutter, roof.mean(axis=0, keepdims=True))[0]
    now = float(shutter.late(float(middle[1])))
    placed = lay_out(model, driven.after(now))
    whole = np.concatenate((placed.solid, placed.shade, placed.tag))
    low, high = whole[:, 1].min(), whole[:, 1].max()
    half = shutter.exposure_s / 2.0
    first, last = float(shutter.late(low)) - half, float(shutter.late(high)) + half
    ends = [model.project(tag_on_roof(driven.after(t), PRINT_SCALE)) for t in (first, last)]
    way_px = float(np.abs(np.hypot(*(ends[1] - ends[0]).T)).max())
    margin = 24 if way_px < STILL_PX else 24 + MARGIN_PX + math.ceil(way_px)
    rect = _clipped(whole, margin, frame)
    if rect is None:
        return None
    if way_px < STILL_PX:
        paint_car(frame, placed, gain)
        return rect, placed
    times = np.linspace(first, last, min(MAX_STEPS, 2 + math.ceil(way_px / STEP_PX)))
    layer = car_layer.cut_out(placed, gain, rect)
    rows = shutter.late(np.arange(rect[1], rect[3], dtype=np.float64))
    weights = gathered(times, rows, shutter.exposure_s)
    total = _averaged(layer, [_shift(model, driven, placed, t, rect) for t in times], weights)
    window = frame[rect[1] : rect[3], rect[0] : rect[2]]
    mixed = window * (total[..., 3:] / 255.0) + total[..., :3]
    window[:] = np.clip(np.rint(mixed), 0.0, 255.0).astype(np.uint8)
    return rect, placed


def _clipped(pixels: Floats, margin: int, frame: Image) -> Rect | None:
    height, width = frame.shape[:2]
    low = np.floor(pixels.min(axis=0)).astype(int) - margin
    high = np.ceil(pixels.max(axis=0)).astype(int) + margin + 1
    left, top = max(0, int(low[0])), max(0, int(low[1]))
    right, bottom = min(width, int(high[0])), min(height, int(high[1]))
    return None if right <= left or bottom <= top else (left, top, right, bottom)


def _shift(model: CameraModel, driven: Driven, placed: LaidOut, t_s: float, rect: Rect) -> Floats:
    """Return the transform of the cut-out to another time, by its tag: (2, 3), rect's pixels."""
    corner = np.array(rect[:2], dtype=np.float64)
    there = model.project(tag_on_roof(driven.after(float(t_s)), PRINT_SCALE)) - corner
    here = np.column_stack((placed.tag - corner, np.ones(4)))
    solved, *_ = np.linalg.lstsq(here, there, rcond=None)
    return np.asarray(solved.T, dtype=np.float64)


def _averaged(layer: Image, shifts: list[Floats], weights: Floats) -> Gathered:
    width = layer.shape[1]
    total = np.zeros(layer.shape, dtype=np.float32)
    for number, shift in enumerate(shifts):
        share = weights[:, number].astype(np.float32)
        used = np.flatnonzero(share > 0.0)
        if len(used) == 0:
            continue
        top, bottom = int(used[0]), int(used[-1]) + 1
        raised = shift - np.array([[0.0, 0.0, 0.0], [0.0, 0.0, top]])
        warped = cv2.warpAffine(
            layer, raised, (width, bottom - top), flags=cv2.INTER_CUBIC,
            borderMode=cv2.BORDER_REPLICATE,
        )  # fmt: skip
        total[top:bottom] += warped * share[top:bottom, None, None]
    return total
