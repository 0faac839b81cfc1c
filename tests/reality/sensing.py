"""What camera, encoders and IMU make of a drive, and what is wrong with them."""

import math

import numpy as np

from tests.reality.changing import at, over
from tests.reality.family import USUAL
from tests.reality.motion import ROW, ROW_S

POSE_STD = {"nigel": 0.002, "f1tenth": 0.005}
YAW_STD = 0.0087
FIRST_POSE_S = 0.2
NOISE_STD = {"correlated": 0.5}
"""Of noise shapes, relative to the others: errors that last cannot be averaged out."""
FREEDOM = 4.0  # of Student's t
FINE = 0.8  # noise before rounding

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


def seen(f, x, y, yaw):
    """Return a pose as a camera and a tag with faults show it, but for the camera's delay."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    x += cos * f["point_x"] - sin * f["point_y"]
    y += sin * f["point_x"] + cos * f["point_y"]
    depth = (1.0 + f["tilt_x"] * x + f["tilt_y"] * y) / f["scale"]
    depth /= 1.0 + f["scale_per_x"] * abs(x)
    return x / depth, y / depth, yaw + f["heading"]


class Camera:
    """The overhead camera: when it sees, and what it says the pose is."""

    def __init__(self, faults, car, duration, rng, family=USUAL):
        frame_s, jitter = 1.0 / family.pose_hz, family.jitter_s
        frames = np.arange(int((duration - FIRST_POSE_S) / frame_s))
        times = FIRST_POSE_S + frame_s * frames + rng.uniform(-jitter, jitter, len(frames))
        self.t = times[rng.random(len(times)) >= family.lost]
        std = family.pose_noise * np.array((POSE_STD[car], POSE_STD[car], YAW_STD))
        noise, self.rounded = shaped_noise(family.noise_shape, len(self.t), family.pose_hz, rng)
        self.noise, self.rounded = noise * std, self.rounded * std
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
            pose = np.array(seen(f, x, y, yaw)) + self.noise[self.next]
            if self.rounded[0] > 0.0:
                pose = self.rounded * np.round(pose / self.rounded)
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


def stated_std(family):
    """Return the standard deviation of the noise of poses, relative to the usual one."""
    return family.pose_noise * NOISE_STD.get(family.noise_shape, 1.0)


def shaped_noise(shape, count, hz, rng):
    """Return noise of poses, (count, 3), and to what they are rounded, in standard deviations."""
    if shape == "student_t":
        return rng.standard_t(FREEDOM, (count, 3)) / math.sqrt(FREEDOM / (FREEDOM - 2.0)), 0.0
    noise = rng.standard_normal((count, 3))
    if shape == "quantised":
        return FINE * noise, math.sqrt(12.0 * (1.0 - FINE**2))
    if shape == "correlated":
        stays = math.exp(-1.0 / (hz * rng.uniform(0.05, 0.5)))
        for k in range(1, count):
            noise[k] = stays * noise[k - 1] + math.sqrt(1.0 - stays**2) * noise[k]
        return NOISE_STD[shape] * noise, 0.0
    return noise, 0.0


def encoders(rows, faults, counts, duration, hz=50):
    """Return cumulative counts of the rear wheels, columns t, left, right."""
    t = np.arange(round(0.1 * hz), int(duration * hz)) / hz
    per_rad = counts / (2.0 * math.pi) * (1.0 - over(faults, "lost_counts", t))
    sides = [np.floor(_counted(per_rad, column(rows, side, t))) for side in ("left", "right")]
    return np.column_stack((t, *(side - side[0] for side in sides)))


def _counted(per_rad, turned):
    if np.ptp(per_rad) == 0.0:
        return per_rad * turned
    return np.cumsum(per_rad * np.diff(turned, prepend=0.0))


def inertial(rows, faults, noise, duration, rng, hz=100):
    """Return accelerations of the centre of gravity and yaw rate, columns t, ax, ay, gz."""
    t = np.arange(round(0.1 * hz), int(duration * hz)) / hz
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
