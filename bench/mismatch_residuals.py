"""What peers of the mismatch search are given: residuals of the nominal car, and named terms.

One recording becomes five regressions: drive acceleration and yaw acceleration that the nominal car
lacks at the smoothed state, gyro against the camera's yaw rate, wheels against the camera's speed,
and the camera's sideways speed. Both sides of each are smoothed by the same smoother.
"""

from dataclasses import dataclass

import numpy as np

from scm.geometry import Pose2
from scm.recording.read import Recording
from scm.replay.commands import Commands
from scm.replay.drive import Drive
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet

EVERY_S, AHEAD_S, STEP_S = 0.1, 0.1, 0.005
EDGE_S = 1.5
TARGETS = ("drive", "yaw", "gyro", "wheels", "sideways")

# term -> effects that a reader would take it for; the first is what is reported
DRIVE = {
    "1": ("rolling_resistance",), "u": ("drive_gain", "motor_gain"), "u|u|": ("drive_curve",),
    "sign(u)": ("drive_deadband",), "v": ("viscous_drag",), "v|v|": ("aero_drag",),
    "sign(v)": ("rolling_resistance",), "near 0": ("stiction",),
    "du/dt": ("drive_lag", "drive_delay"), "a": ("payload",),
    "u t": ("battery_sag",), "u heat": ("motor_fade",),
    "cos yaw": ("grade", "wind"), "sin yaw": ("grade", "wind"), "v |s|": ("corner_drag",),
    "patch": ("surface_patch",),
}  # fmt: skip
YAW = {
    "v": ("steer_trim",), "v s": ("steer_gain",), "v s|s|": ("steer_saturation",),
    "v ds/dt": ("steer_delay", "steer_lag"), "v sign(ds/dt)": ("steer_backlash",),
    "v ds/dt |ds/dt|": ("steer_rate",), "v3 s": ("understeer", "com_shift", "tyre_stiffness"),
    "v2 s|v s|": ("tyre_grip", "steer_compliance", "load_transfer"), "u": ("drive_asymmetry",),
    "a s": ("tyre_relaxation",),
}  # fmt: skip
GYRO = {"1": ("gyro_bias",), "r": ("gyro_scale",), "dr/dt": ("pose_latency", "clock_offset")}
WHEELS = {
    "v": ("wheel_radius", "encoder_loss", "pose_scale"), "v x": ("camera_tilt",),
    "v y": ("camera_tilt",), "a": ("pose_latency", "clock_offset"), "v t": ("clock_drift",),
}  # fmt: skip
SIDEWAYS = {"v": ("pose_heading",), "r": ("pose_point",)}
NAMES = dict(zip(TARGETS, (DRIVE, YAW, GYRO, WHEELS, SIDEWAYS), strict=True))


@dataclass(frozen=True)
class Residuals:
    """Terms and targets of one recording; every target has its own rows of terms.

    Attributes:
        regressors: What a Gaussian process is given, (n, 8).
    """

    terms: dict[str, np.ndarray]
    targets: dict[str, np.ndarray]
    regressors: np.ndarray


def state_terms(u, s, du, ds, v, a, r, yaw, t, heat, v_top):
    """Return the terms of the drive's and the yaw's regression, arrays (n, terms)."""
    near = np.sign(v) * np.exp(-np.square(v / (0.1 * v_top)))
    one = np.ones_like(v)
    drive = (one, u, u * np.abs(u), np.sign(u), v, v * np.abs(v), np.sign(v), near, du, a, u * t,
             u * heat, np.cos(yaw), np.sin(yaw), v * np.abs(s), 0.0 * one)  # fmt: skip
    turn = (v, v * s, v * s * np.abs(s), v * ds, v * np.sign(ds), v * ds * np.abs(ds), v**3 * s,
            v * v * s * np.abs(v * s), u, a * s)  # fmt: skip
    return np.column_stack(drive), np.column_stack(turn)


def regressors(u, s, v, r, yaw, t, x, y):
    """Return what a Gaussian process is given, (n, 8)."""
    return np.column_stack((u, s, v, r, np.cos(yaw), np.sin(yaw), x, y))


def residuals(recording: Recording, car: Car) -> Residuals:
    """Return what the nominal car leaves unexplained of a recording."""
    drive, commands = Drive(recording, car), Commands(recording, car)
    sm = drive.smoothed
    t = np.arange(drive.edges[0] + EDGE_S, drive.edges[-1] - EDGE_S, EVERY_S)
    seen, later = _motion(sm, t), _motion(sm, t + AHEAD_S)
    after = _ahead(car, commands, t, seen)
    u, s = commands.at(t)
    u0, s0 = commands.at(t - 0.2)
    x, y, yaw, v, side, r = seen
    a, turn = (later[3] - v) / AHEAD_S, (later[5] - r) / AHEAD_S
    load = np.cumsum(u * u) * EVERY_S
    heat = load - np.convolve(load, np.ones(600) / 600.0)[: len(load)]
    top = np.percentile(np.abs(v), 95)
    drives, turns = state_terms(u, s, (u - u0) / 0.2, (s - s0) / 0.2, v, a, r, yaw, t, heat, top)
    centre = _worst_spot(x, y, (later[3] - after[0]) / AHEAD_S)
    drives[:, -1] = np.sign(v) * np.exp(-((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / 0.1)
    targets = {"drive": (later[3] - after[0]) / AHEAD_S, "yaw": (later[5] - after[1]) / AHEAD_S,
               "sideways": side - drive.point[0] * r}  # fmt: skip
    terms = {"drive": drives, "yaw": turns, "sideways": np.column_stack((v, r))}
    if "imu.gyro_z" in drive.names:
        targets["gyro"] = np.interp(t, drive.stream("imu.gyro_z").t, _soft(drive, "imu.gyro_z")) - r
        terms["gyro"] = np.column_stack((np.ones_like(v), r, turn))
    if "encoder.left" in drive.names:
        targets["wheels"] = _wheel_speed(drive, car, t) - v
        terms["wheels"] = np.column_stack((v, v * x, v * y, a, v * t))
    return Residuals(terms, targets, regressors(u, s, v, r, yaw, t, x, y))


def _motion(sm, t):
    x, y, yaw = (sm[f"pose.{n}"] for n in ("x", "y", "yaw"))
    vx, vy, psi = x.rate_at(t), y.rate_at(t), yaw.at(t)
    c, s = np.cos(psi), np.sin(psi)
    return x.at(t), y.at(t), psi, c * vx + s * vy, c * vy - s * vx, yaw.rate_at(t)


def _ahead(car, commands, t, seen):
    """Return speed and yaw rate of the nominal car a moment after each smoothed state."""
    fleet, (x, y, yaw, v, _, r) = Fleet(car, len(t)), seen
    for pose in zip(x, y, yaw, strict=True):
        fleet.add(Pose2(*map(float, pose)))

    def go(begin, span):
        for k in range(round(span / STEP_S)):
            fleet.throttle[:], fleet.steering[:] = commands.at(begin + k * STEP_S)
            fleet.advance(STEP_S)

    go(t - 1.0, 1.0)
    for row in range(len(t)):
        pose = Pose2(float(x[row]), float(y[row]), float(yaw[row]))
        fleet.place(row, pose, float(v[row]), 0.0, float(r[row]), keep_actuators=True)
    go(t, AHEAD_S)
    return fleet.speed.copy(), fleet.yaw_rate.copy()


def _soft(drive, name):
    values = drive.stream(name).values
    return np.convolve(np.pad(values, 4, mode="edge"), np.ones(9) / 9.0, mode="valid")


def _wheel_speed(drive, car, t):
    """Return the driven wheels' mean speed over 0.4 s [m/s]."""
    per = car.value("encoder.counts_per_revolution") / (2.0 * np.pi * car.value("wheel.radius_m"))
    sides = [drive.stream(f"encoder.{side}") for side in ("left", "right")]
    means = [np.interp(t + 0.2, s.t, s.values) - np.interp(t - 0.2, s.t, s.values) for s in sides]
    return 0.5 * (means[0] + means[1]) / (0.4 * per)


def _worst_spot(x, y, left):
    """Return the cell of the floor that brakes most."""
    columns, rows = (np.digitize(c, np.linspace(c.min(), c.max(), 6)[1:-1]) for c in (x, y))
    worst = max(
        ((i, j) for i in range(5) for j in range(5) if ((columns == i) & (rows == j)).sum() > 4),
        key=lambda cell: abs(left[(columns == cell[0]) & (rows == cell[1])].mean()),
    )
    here = (columns == worst[0]) & (rows == worst[1])
    return x[here].mean(), y[here].mean()
