"""Rooms of straight walls, and what a scanner that moves in one sees."""

import numpy as np

from scm.geometry import TAU, Pose2
from vehicle_agent.autonomy.sweep import Sweep

BEAMS = 360


def outline(*corners):
    """Return the walls (n, 4) of a closed outline: x0, y0, x1, y1 [m]."""
    return np.hstack((np.array(corners, float), np.roll(np.array(corners, float), -1, axis=0)))


ROOM = np.vstack((
    outline((-1.0, -0.65), (1.2, -0.65), (1.2, 0.65), (-1.0, 0.65)),
    outline((0.7, 0.2), (1.0, 0.2), (1.0, 0.42), (0.7, 0.42)),
))  # fmt: skip
CORRIDOR = outline((-50.0, -0.5), (50.0, -0.5), (50.0, 0.5), (-50.0, 0.5))[[0, 2]]


def ranges_from(walls, pose, bearings):
    """Return the distance (n,) from a pose to the nearest wall along each bearing; inf: none."""
    look = pose.yaw + bearings
    dx, dy = np.cos(look)[:, None], np.sin(look)[:, None]
    x, y = walls[:, 0] - pose.x, walls[:, 1] - pose.y
    ex, ey = walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = dx * ey - dy * ex
        far, part = (x * ey - y * ex) / cross, (x * dy - y * dx) / cross
        return np.where((far > 0) & (part >= 0) & (part <= 1), far, np.inf).min(axis=1)


def sweep_at(walls, pose, twist=None, t_ns=0, sweep_s=0.0, noise_m=0.0, seed=0):
    """Return the sweep of a scanner that is at `pose` at its end, in steady motion."""
    bearings = np.arange(BEAMS) * TAU / BEAMS
    ago = (BEAMS - 1 - np.arange(BEAMS)) * sweep_s / BEAMS
    ranges = ranges_from(walls, pose, bearings)
    if twist is not None and sweep_s:
        ranges = np.array([
            ranges_from(walls, pose @ later(twist, -t), bearing[None])[0]
            for t, bearing in zip(ago, bearings, strict=True)
        ])  # fmt: skip
    noise = noise_m * np.random.default_rng(seed).standard_normal(BEAMS)
    return Sweep(t_ns, bearings, ranges + noise, ago)


def later(twist, t_s):
    """Return where a body in steady motion is after a time, seen from where it was."""
    v = complex(twist.along_mps, twist.across_mps)
    turn = twist.yaw_rate_radps * t_s
    part = (np.exp(1j * turn) - 1.0) / (1j * turn) if turn else 1.0
    chord = v * t_s * part
    return Pose2(chord.real, chord.imag, turn)
