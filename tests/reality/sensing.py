"""What camera, encoders and IMU make of a drive, and what is wrong with them."""

import math

import numpy as np

from tests.reality.changing import at, over
from tests.reality.motion import ROW, ROW_S

POSE_STD = {"nigel": 0.002, "f1tenth": 0.005}
YAW_STD = 0.0087
FIRST_POSE_S, FRAME_S, JITTER_S, LOST = 0.2, 1.0 / 30.0, 0.002, 0.015

# What a fault of measurement may add, with the value at which it does nothing.
FAULTS = {
    "delay": 0.0, "scale": 1.0, "tilt_x": 0.0, "tilt_y": 0.0, "point_x": 0.0, "point_y": 0.0,
    "heading": 0.0, "clock_offset": 0.0, "clock_rate": 0.0, "gyro_bias": 0.0, "gyro_scale": 1.0,
    "accel_x": 0.0, "accel_y": 0.0, "imu_angle": 0.0, "lost_counts": 0.0,
    "gyro_unit": 1.0, "accel_unit": 1.0, "gyro_per_accel": 0.0, "scale_per_x": 0.0,
}  # fmt: skip
COLUMN = {name: k for k, name in enumerate(ROW)}


def column(rows, name, t):
    """Return one quantity of the drive at times `t`, between its rows."""
    at = np.clip(np.asarray(t) / ROW_S - 1.0, 0.0, len(rows) - 1.0)
    low = np.minimum(at.astype(int), len(rows) - 2)
    part, values = at - low, rows[:, COLUMN[name]]
    return values[low] * (1.0 - part) + values[low + 1] * part


class Camera:
    """The overhead camera: when it sees, and what it says the pose is."""

    def __init__(self, faults, car, duration, rng):
        frames = np.arange(int((duration - FIRST_POSE_S) / FRAME_S))
        times = FIRST_POSE_S + FRAME_S * frames + rng.uniform(-JITTER_S, JITTER_S, len(frames))
        self.t = times[rng.random(len(times)) >= LOST]
        std = POSE_STD[car]
        self.noise = rng.standard_normal((len(self.t), 3)) * (std, std, YAW_STD)
        self.faults, self.next, self.poses = faults, 0, np.empty((len(self.t), 3))

    def look(self, rows, start, until):
        """Return (stamp, pose) of the frames before `until`, each frame once."""
        found = []
        while self.next < len(self.t) and self.t[self.next] <= until:
            f = at(self.faults, self.t[self.next])
            t = max(self.t[self.next] - f["delay"], 0.0)
            x, y, yaw = (
                start
                if len(rows) < 2
                else (float(column(rows, name, t)) for name in ("x", "y", "yaw"))
            )
            cos, sin = math.cos(yaw), math.sin(yaw)
            x += cos * f["point_x"] - sin * f["point_y"]
            y += sin * f["point_x"] + cos * f["point_y"]
            depth = (1.0 + f["tilt_x"] * x + f["tilt_y"] * y) / f["scale"]
            depth /= 1.0 + f["scale_per_x"] * abs(x)
            pose = np.array((x / depth, y / depth, yaw + f["heading"])) + self.noise[self.next]
            self.poses[self.next] = pose
            found.append((self.t[self.next], pose))
            self.next += 1
        return found

    def table(self):
        """Return stamps and poses as recorded, heading in -pi..pi, columns t, x, y, yaw."""
        t, poses = self.t[: self.next], self.poses[: self.next]
        offset, rate = (over(self.faults, f"clock_{name}", t) for name in ("offset", "rate"))
        stamps = t + offset + rate * (t - t[0])
        yaw = np.arctan2(np.sin(poses[:, 2]), np.cos(poses[:, 2]))
        return np.column_stack((stamps, poses[:, :2], yaw))


def encoders(rows, faults, counts, duration):
    """Return cumulative counts of the rear wheels at 50 Hz, columns t, left, right."""
    t = np.arange(5, int(duration * 50)) / 50.0
    per_rad = counts / (2.0 * math.pi) * (1.0 - over(faults, "lost_counts", t))
    sides = [np.floor(_counted(per_rad, column(rows, side, t))) for side in ("left", "right")]
    return np.column_stack((t, *(side - side[0] for side in sides)))


def _counted(per_rad, turned):
    if np.ptp(per_rad) == 0.0:
        return per_rad * turned
    return np.cumsum(per_rad * np.diff(turned, prepend=0.0))


def inertial(rows, faults, noise, duration, rng):
    """Return accelerations of the centre of gravity and yaw rate at 100 Hz, t, ax, ay, gz."""
    t = np.arange(10, int(duration * 100)) / 100.0
    along, across, gyro = (column(rows, name, t) for name in ("push", "side", "yaw_rate"))
    f = {name: over(faults, name, t) for name in FAULTS}
    cos, sin = np.cos(f["imu_angle"]), np.sin(f["imu_angle"])
    a_x = cos * along + sin * across + f["accel_x"]
    a_y = cos * across - sin * along + f["accel_y"]
    gyro = f["gyro_scale"] * gyro + f["gyro_bias"] + f["gyro_per_accel"] * along
    a_x, a_y = (a + noise[0] * rng.standard_normal(len(t)) for a in (a_x, a_y))
    gyro = gyro + noise[1] * rng.standard_normal(len(t))
    unit = f["accel_unit"]
    return np.column_stack((t, a_x * unit, a_y * unit, gyro * f["gyro_unit"]))
