"""Steering along a path: feed-forward with preview, and feedback on the two errors.

    kappa = kappa_path - (w^2 e + 2 z w psi)           delta = atan(wheelbase * kappa)

e is the lateral error of the rear axle, psi the yaw error; for a car that rolls without slip the
error then follows e'' + 2 z w e' + w^2 e = 0 over the distance driven, at every speed.
The path's curvature jumps where a straight meets an arc, but a servo takes its time. So kappa_path
and the yaw psi refers to are means over the stretch that the car covers while the servo makes the
path's largest swing, centred on the axle: a way that the car can really follow, at most 3 mm
beside the true one. And e and psi are those the car will have when the servo has swung back from
where it is now: without that look ahead a slow servo turns a large error into a weave.

Holds: small slip angles, |e| below a car's width.   Source: Frenet kinematics of a bicycle; ours.
"""

import math

import numpy as np

from scm.clock import seconds
from scm.geometry import Pose2
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.track import STEP, Track

STIFFNESS = 8.0
DAMPING = 0.8
LATERAL_LIMIT = 0.05


class Steering:
    """Steers one car along the way it was told to `follow`."""

    def __init__(self, limits: CarLimits) -> None:
        self._limits = limits
        self._track: Track
        self._angle = self._wished = self._swing_s = 0.0
        self._last_ns: int | None = None

    def follow(self, track: Track) -> None:
        """Steer along another way from now on."""
        self._track = track
        angle = np.arctan(self._limits.wheelbase * np.diff(track.yaw) / np.diff(track.s))
        jumps = np.abs(angle - np.roll(angle, 2))
        largest = float(jumps.max() if track.closed else jumps[2:].max(initial=0.0))
        self._swing_s = largest / self._limits.steer_rate

    def command(self, s: float, lateral: float, pose: Pose2, speed: float, now_ns: int) -> float:
        """Return the steering command, -1 to 1, + = left.

        Args:
            s: Where the rear axle is along the way [m].
            lateral: Rear axle beside it [m], + = left.
            pose: Of the rear axle.
            speed: Forward [m/s].
            now_ns: The present time [ns].
        """
        self._follow_servo(now_ns)
        half = max(STEP, 0.5 * speed * self._swing_s)
        heading = self._track.heading
        before, here, after = heading(s - half), heading(s), heading(s + half)
        quarters = heading(s - 0.5 * half) + heading(s + 0.5 * half)
        mean_yaw = (before + 4.0 * quarters + 2.0 * here + after) / 12.0
        path_curvature = (after - before) / (2.0 * half)
        feedback = self._feedback(lateral, math.sin(pose.yaw - mean_yaw), path_curvature, speed)
        limit = self._limits.steer_limit
        angle = math.atan(self._limits.wheelbase * (path_curvature + feedback))
        self._wished = max(-limit, min(limit, angle))
        return self._wished / limit

    def _feedback(self, lateral: float, yaw: float, path_curvature: float, speed: float) -> float:
        """Return the curvature [1/m] against the errors the car has once the servo swung back."""
        off = self._angle - math.atan(self._limits.wheelbase * path_curvature)
        way = speed * abs(off) / self._limits.steer_rate
        off_curvature = off / self._limits.wheelbase
        lateral += way * yaw + off_curvature * way**2 / 3.0
        yaw += off_curvature * way / 2.0
        bounded = max(-LATERAL_LIMIT, min(LATERAL_LIMIT, lateral))
        return -(STIFFNESS**2) * bounded - 2.0 * DAMPING * STIFFNESS * yaw

    def _follow_servo(self, now_ns: int) -> None:
        """Move the guess of the road wheels' angle towards the last command."""
        passed = 0.0 if self._last_ns is None else seconds(now_ns - self._last_ns)
        self._last_ns = now_ns
        step = self._limits.steer_rate * passed
        self._angle += max(-step, min(step, self._wished - self._angle))
