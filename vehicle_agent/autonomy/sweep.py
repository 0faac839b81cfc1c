"""One sweep of a LIDAR: where and when each beam looked, and its echoes as points of the car.

A scanner that turns looks in one direction after another while the car moves. Each echo is taken to
where it lies at the end of the sweep, for a car in steady motion (`deskewed`).
"""

import math
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_S
from scm.errors import MessageError
from scm.geometry import TAU, Pose2
from scm.v2x.messages.lidar_scan import LidarScan
from scm.vehicles.rays.march import past_poses

RANGE_BYTES = 4
LEAST_TRIPLES = 20
MEDIAN_OF_NORMAL = 0.6745  # of |x|, in standard deviations


@dataclass(frozen=True, slots=True)
class Twist:
    """Motion of the car's origin, in the car's frame [m/s, m/s, rad/s]."""

    along_mps: float = 0.0
    across_mps: float = 0.0
    yaw_rate_radps: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """Ranges with their directions and times.

    Attributes:
        t_ns: When the last beam looked.
        bearings: (n,) evenly spaced, 0 straight ahead of the scanner, + = left [rad].
        ranges: (n,) [m]; infinity is a miss.
        ago_s: (n,) how long before `t_ns` each beam looked [s].
    """

    t_ns: int
    bearings: Floats
    ranges: Floats
    ago_s: Floats

    @property
    def step(self) -> float:
        """From each beam to the next [rad]."""
        return float(self.bearings[1] - self.bearings[0])

    @property
    def is_whole(self) -> bool:
        """Whether the beams go round the full circle."""
        return self.step * len(self.bearings) > TAU - 1e-6


def sweep_of(scan: LidarScan) -> Sweep:
    """Return a message's sweep.

    Raises:
        MessageError: when it has fewer than three beams, or other ranges than beams.
    """
    if len(scan.payload) != RANGE_BYTES * scan.beams or scan.beams < 3:
        msg = (
            f"{scan.vehicle}: LidarScan: expected 4 bytes for each of its {scan.beams} beams, at "
            f"least 3, got {len(scan.payload)} bytes"
        )
        raise MessageError(msg)
    ranges = np.frombuffer(scan.payload, "<f4").astype(np.float64)
    step = scan.bearing_step_rad if scan.bearing_step_rad is not None else TAU / scan.beams
    number = np.arange(scan.beams)
    since_first = number[::-1] if scan.clockwise else number
    ago_s = (scan.beams - 1 - since_first) * (scan.beam_ns / NS_PER_S)
    seen = np.isfinite(ranges) & (ranges >= scan.range_min_m) & (ranges <= scan.range_max_m)
    return Sweep(
        t_ns=scan.t_ns,
        bearings=np.asarray(scan.bearing_first_rad + step * number, dtype=np.float64),
        ranges=np.where(seen, ranges, np.inf),
        ago_s=np.asarray(ago_s, dtype=np.float64),
    )


def deskewed(sweep: Sweep, mount: Pose2, twist: Twist) -> Floats:
    """Return the echoes as they lie at the end of the sweep, (m, 2), car frame [m].

    Args:
        sweep: Its misses are left out.
        mount: Of the scanner on the car.
        twist: Of the car during the sweep.
    """
    seen = np.isfinite(sweep.ranges)
    motion = np.array([[twist.along_mps, twist.across_mps, twist.yaw_rate_radps]])
    x, y, yaw = past_poses(np.zeros((1, 3)), motion, sweep.ago_s[seen])[0].T
    c, s = np.cos(yaw), np.sin(yaw)
    look = yaw + mount.yaw + sweep.bearings[seen]
    return np.column_stack((
        x + c * mount.x - s * mount.y + sweep.ranges[seen] * np.cos(look),
        y + s * mount.x + c * mount.y + sweep.ranges[seen] * np.sin(look),
    ))  # fmt: skip


def noise_of(sweep: Sweep) -> float | None:
    """Return the standard deviation of a range, by how ranges of neighbours scatter [m].

    Second differences are free of walls, which bend little from beam to beam. None: fewer than
    `LEAST_TRIPLES` beams with neighbours had an echo.
    """
    seen = np.isfinite(sweep.ranges)
    three = seen[:-2] & seen[1:-1] & seen[2:]
    bends = np.abs(np.diff(np.where(seen, sweep.ranges, 0.0), 2)[three])
    if len(bends) < LEAST_TRIPLES:
        return None
    return float(np.median(bends)) / MEDIAN_OF_NORMAL / math.sqrt(6.0)


def twist_of(motion: Pose2, duration_s: float) -> Twist:
    """Return the steady motion that takes a car's origin by `motion`, in its frame at first."""
    half = 0.5 * motion.yaw
    way = duration_s * float(np.sinc(half / np.pi))
    x, y = Pose2(0.0, 0.0, -half).apply(motion.x, motion.y)
    return Twist(x / way, y / way, motion.yaw / duration_s)
