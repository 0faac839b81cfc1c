"""What the sensors would have recorded of a simulated motion, faults of measurement included.

The pose is integrated from simulated body speeds along the measured heading, so a heading error of
the simulator does not turn the whole path; it shows in the yaw itself.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from scm.arrays import Floats
from scm.mismatch.drive import STEP_S, WHEELS, Drive, Stream
from scm.mismatch.rollouts import Motions, Numbers

# Faults of measurement by the key that their library parameter has, and their neutral values.
POSE_CLOCK = "clock.pose_s"  # poses are stamped so much later than the other sensors
NEUTRAL: Mapping[str, float] = {
    POSE_CLOCK: 0.0, "measure.pose_delay_s": 0.0, "measure.clock_offset_s": 0.0,
    "measure.clock_rate": 0.0, "measure.pose_scale": 1.0, "measure.camera_tilt_x_per_m": 0.0,
    "measure.camera_tilt_y_per_m": 0.0, "measure.pose_point_x_m": 0.0,
    "measure.pose_point_y_m": 0.0, "measure.pose_heading_rad": 0.0, "measure.encoder_loss": 0.0,
    "measure.gyro_bias_rad_s": 0.0, "measure.gyro_scale": 1.0, "measure.accel_bias_x_m_s2": 0.0,
    "measure.accel_bias_y_m_s2": 0.0, "measure.imu_angle_rad": 0.0,
}  # fmt: skip


_LATE = (POSE_CLOCK, "measure.pose_delay_s", "measure.clock_offset_s")
_POSE = (*_LATE, "measure.clock_rate", "measure.pose_scale", "measure.camera_tilt_x_per_m",
         "measure.camera_tilt_y_per_m", "measure.pose_heading_rad")  # fmt: skip


class _Taps:
    """Takes signals given on a grid at a stream's sample times, by straight lines between."""

    def __init__(self, stream: Stream, edges: Floats) -> None:
        at = (stream.taps - edges[0]) / (edges[1] - edges[0])
        self._row = np.clip(at.astype(np.int64), 0, len(edges) - 2)
        self._share = (at - self._row)[:, :, None]

    def __call__(self, signal: Floats) -> Floats:
        """Return means over the taps of a signal (edges, sets): (samples, sets)."""
        before: Floats = signal[self._row]
        before += self._share * (signal[self._row + 1] - before)
        return before[:, 0] if before.shape[1] == 1 else np.mean(before, axis=1)


class Prediction:
    """Predicts every stream of a drive."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        smoothed, edges = drive.smoothed, drive.edges
        self._seen = [smoothed[f"pose.{n}"].at(edges) for n in ("x", "y", "yaw")]
        self._taps = {s.name: _Taps(s, edges) for s in drive.streams}
        self._counts = 0.0
        if any(s.name.startswith("encoder.") for s in drive.streams):
            self._counts = drive.car.value("encoder.counts_per_revolution") / (2.0 * np.pi)

    def residuals(self, motions: Motions, faults: Sequence[Numbers]) -> list[Floats]:
        """Return measured minus predicted of every stream, each (samples, sets)."""
        now = {key: np.array([n.get(key, value) for n in faults]) for key, value in NEUTRAL.items()}
        path = self._path(motions, now, *self._seen)
        found = []
        for stream in self.drive.streams:
            signal = path.get(stream.name)
            signal = self.sensor(stream.name, motions, now) if signal is None else signal
            found.append(stream.values[:, None] - self._taps[stream.name](signal))
        faulty = np.any([now[key] != NEUTRAL[key] for key in _POSE], axis=0)
        for row in np.flatnonzero(faulty):
            self._faulty_pose(motions, now, int(row), found)
        return found

    def _path(
        self, motions: Motions, now: Mapping[str, Floats], x: Floats, y: Floats, yaw: Floats,
    ) -> dict[str, Floats]:  # fmt: skip
        """Return the measured point's way from its start, on the drive's edges.

        Args:
            motions: What the car did.
            now: Faults, each (sets,).
            x: Where the camera saw it, on the edges' true times, (edges,).
            y: Likewise.
            yaw: Likewise.
        """
        heading = yaw[:, None] - now["measure.pose_heading_rad"]
        c, s = np.cos(heading), np.sin(heading)
        rate = motions["yaw_rate"]
        along = motions["speed"] - rate * (self.drive.point[1] + now["measure.pose_point_y_m"])
        across = motions["lateral_speed"] + rate * (
            self.drive.point[0] + now["measure.pose_point_x_m"]
        )
        vx, vy = c * along - s * across, s * along + c * across
        tilt_x, tilt_y = now["measure.camera_tilt_x_per_m"], now["measure.camera_tilt_y_per_m"]
        if np.any(tilt_x) or np.any(tilt_y):
            size = 1.0 / (1.0 - tilt_x * x[:, None] - tilt_y * y[:, None])
            true_x, true_y = x[:, None] * size, y[:, None] * size
            depth = 1.0 + tilt_x * true_x + tilt_y * true_y
            turn = (tilt_x * vx + tilt_y * vy) / (depth * depth)
            vx, vy = vx / depth - true_x * turn, vy / depth - true_y * turn
        scale = now["measure.pose_scale"]
        return {
            "pose.x": _summed(scale * vx, STEP_S),
            "pose.y": _summed(scale * vy, STEP_S),
            "pose.yaw": _summed(rate, STEP_S),
        }

    def _faulty_pose(
        self, motions: Motions, now: Mapping[str, Floats], row: int, found: list[Floats]
    ) -> None:
        """Predict the pose of one set whose camera has faults, in its own time."""
        one = {key: values[row : row + 1] for key, values in now.items()}
        edges, smoothed = self.drive.edges, self.drive.smoothed
        late = float(sum(one[key][0] for key in _LATE))
        rate = float(one["measure.clock_rate"][0])
        seen = self._seen
        if late or rate:
            stamps = edges + late + rate * (edges - edges[0])
            seen = [smoothed[f"pose.{n}"].at(stamps) for n in ("x", "y", "yaw")]
        alone = Motions(
            {key: values[:, row : row + 1] for key, values in motions.signals.items()},
            motions.ok[row : row + 1],
        )
        path = self._path(alone, one, *seen)
        for stream, column in zip(self.drive.streams, found, strict=True):
            if stream.name in path:
                t = edges[0] + (stream.t - late - edges[0]) / (1.0 + rate)
                column[:, row] = stream.values - np.interp(t, edges, path[stream.name][:, 0])

    def sensor(self, name: str, motions: Motions, now: Mapping[str, Floats]) -> Floats:
        """Return what any other sensor reads, on the drive's edges, (edges, sets)."""
        if name == "imu.gyro_z":
            rate = motions["yaw_rate"]
            return now["measure.gyro_scale"] * rate + now["measure.gyro_bias_rad_s"]
        if name.startswith("imu.accel_"):
            ax, ay = motions["accel_x"], motions["accel_y"]
            c, s = np.cos(now["measure.imu_angle_rad"]), np.sin(now["measure.imu_angle_rad"])
            if name.endswith("x"):
                return c * ax + s * ay + now["measure.accel_bias_x_m_s2"]
            return c * ay - s * ax + now["measure.accel_bias_y_m_s2"]
        kept = 1.0 - now["measure.encoder_loss"]
        if name.startswith("encoder."):
            return kept * self._counts * motions[f"wheel_angle.{WHEELS[name]}"]
        if name.startswith("wheel_speed."):
            return kept * np.gradient(motions[f"wheel_angle.{name[-2:]}"], STEP_S, axis=0)
        plain = {"speed": "speed", "velocity.x": "speed", "velocity.y": "lateral_speed"}
        return motions[plain.get(name, "yaw_rate")]


def _summed(rate: Floats, step: float) -> Floats:
    """Return the integral of (edges, sets) from the first edge, by trapezoids."""
    total = np.zeros_like(rate)
    np.cumsum(0.5 * step * (rate[1:] + rate[:-1]), axis=0, out=total[1:])
    return total
