"""A car's sensor readings in AutoDRIVE's conventions, for its scripts and recordings."""

import math

import numpy as np

from scm.arrays import Floats
from scm.v2x.messages.lidar_scan import LidarScan

G = 9.80665
BEAMS = 360

Three = tuple[float, float, float]


def without_gravity(accel_mps2: Three, rpy_rad: Three) -> Three:
    """Return an accelerometer's reading without gravity.

    Args:
        accel_mps2: Its reading in the body frame: x forward, y left, z up.
        rpy_rad: Roll, pitch and yaw of the body.
    """
    (roll, pitch, _), (x, y, z) = rpy_rad, accel_mps2
    up = math.cos(pitch)
    return (
        x + G * math.sin(pitch),
        y - G * up * math.sin(roll),
        z - G * up * math.cos(roll),
    )


def ranges_of(scan: LidarScan) -> Floats:
    """Return 360 ranges [m] at steps of 1 degree from straight ahead, counter-clockwise.

    Each is that of the nearest beam; infinite without a beam or a hit.
    """
    payload = scan.payload[: len(scan.payload) // 4 * 4]
    ranges = np.frombuffer(payload, "<f4")[: scan.beams].astype(np.float64)
    step = scan.bearing_step_rad or math.tau / max(1, scan.beams)
    wanted = np.arange(BEAMS) * math.tau / BEAMS
    turn = (math.copysign(1.0, step) * (wanted - scan.bearing_first_rad)) % math.tau
    beam = np.rint(turn / abs(step)).astype(np.int64) % max(round(math.tau / abs(step)), 1)
    seen = beam < len(ranges)
    found = np.full(BEAMS, np.inf)
    found[seen] = ranges[beam[seen]]
    return found
