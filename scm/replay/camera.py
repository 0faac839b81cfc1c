"""Converts between true poses and those recorded by a camera with faults."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.replay.drive import Drive
from scm.replay.numbers import NEUTRAL, POSE_CLOCK, Numbers
from scm.replay.smooth import Smooth

_LATE = (POSE_CLOCK, "measure.pose_delay_s", "measure.clock_offset_s")
_HALF_S, _TINY_S = 0.005, 1e-9


@dataclass(frozen=True, slots=True)
class Moved:
    """Motion of the rear axle, arrays of one shape; speeds along and across the body."""

    x: Floats
    y: Floats
    yaw: Floats
    speed: Floats
    lateral_speed: Floats
    yaw_rate: Floats


class Camera:
    """One drive's camera, with the faults that some numbers give it.

    Args:
        drive: Whose poses it took.
        numbers: By key; those that are no faults of measurement do not matter.
        smoothed: Poses in place of the drive's own smoothed ones.
    """

    def __init__(
        self, drive: Drive, numbers: Numbers, smoothed: Mapping[str, Smooth] | None = None
    ) -> None:
        now = {key: float(numbers.get(key, neutral)) for key, neutral in NEUTRAL.items()}
        self._smoothed = smoothed or drive.smoothed
        self._odometer = drive.odometer
        self._begin, self._late = float(drive.edges[0]), sum(now[key] for key in _LATE)
        self._rate, self._scale = now["measure.clock_rate"], now["measure.pose_scale"]
        self._tilt = now["measure.camera_tilt_x_per_m"], now["measure.camera_tilt_y_per_m"]
        self._heading = now["measure.pose_heading_rad"]
        self._point = (
            drive.point[0] + now["measure.pose_point_x_m"],
            drive.point[1] + now["measure.pose_point_y_m"],
        )

    def stamp(self, t: Floats) -> Floats:
        """Return the stamps of poses taken at true times."""
        return t + self._late + self._rate * (t - self._begin)

    def true_times(self, stamp: Floats) -> Floats:
        """Return the true times of stamps."""
        return self._begin + (stamp - self._late - self._begin) / (1.0 + self._rate)

    def recorded(self, stamp: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the poses x, y, yaw recorded at given stamps, smoothed."""
        x, y, yaw = (self._smoothed[f"pose.{n}"].at(stamp) for n in ("x", "y", "yaw"))
        return x, y, yaw

    def seen(self, x: Floats, y: Floats, yaw: Floats) -> tuple[Floats, Floats, Floats]:
        """Return what is recorded of a rear axle that is truly there."""
        (px, py), (tilt_x, tilt_y) = self._point, self._tilt
        c, s = np.cos(yaw), np.sin(yaw)
        at_x, at_y = x + c * px - s * py, y + s * px + c * py
        size = self._scale / (1.0 + tilt_x * at_x + tilt_y * at_y)
        return size * at_x, size * at_y, yaw + self._heading

    def truly(self, x: Floats, y: Floats, yaw: Floats) -> tuple[Floats, Floats, Floats]:
        """Return where the rear axle is of which this was recorded."""
        (px, py), (tilt_x, tilt_y) = self._point, self._tilt
        flat_x, flat_y, psi = x / self._scale, y / self._scale, yaw - self._heading
        size = 1.0 / (1.0 - tilt_x * flat_x - tilt_y * flat_y)
        c, s = np.cos(psi), np.sin(psi)
        return size * flat_x - c * px + s * py, size * flat_y - s * px - c * py, psi

    def motion(self, t: Floats) -> Moved:
        """Return how the rear axle moved at true times.

        The speed along the body is the odometer's where that is known better than the rate of the
        poses.
        """
        x, y, yaw = self.truly(*self.recorded(self.stamp(t)))
        known = [self._smoothed[name].t for name in ("pose.x", "pose.y", "pose.yaw")]
        first, last = max(one[0] for one in known), min(one[-1] for one in known)
        around = [np.clip(self.stamp(t + h), first, last) for h in (-_HALF_S, _HALF_S)]
        before, after = (self.truly(*self.recorded(stamp)) for stamp in around)
        span = np.maximum(self.true_times(around[1]) - self.true_times(around[0]), _TINY_S)
        vx, vy, rate = ((b - a) / span for a, b in zip(before, after, strict=True))
        c, s = np.cos(yaw), np.sin(yaw)
        return Moved(x, y, yaw, self._along(t, c * vx + s * vy), c * vy - s * vx, rate)

    def _along(self, t: Floats, posed: Floats) -> Floats:
        """Return the forward speed at true times, of which the poses' rate is one measurement."""
        if self._odometer is None:
            return posed
        _, _, psi = self.recorded(self.stamp(t))
        std_x, std_y = (
            np.interp(self.stamp(t), smoothed.t, smoothed.rate_std)
            for smoothed in (self._smoothed["pose.x"], self._smoothed["pose.y"])
        )
        posed_std = np.hypot(np.cos(psi) * std_x, np.sin(psi) * std_y)
        counted, std = self._odometer.at(t)
        return np.where(std < posed_std, counted / self._scale, posed)
