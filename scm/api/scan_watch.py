"""LIDAR scans as pages show them."""

from functools import lru_cache

import numpy as np

from scm.api.picture import Held
from scm.geometry import Pose2
from scm.records.scans import ScanRow
from scm.v2x.messages.lidar_scan import LidarScan
from scm.vehicles.car import car_names, load_car

FULL_CIRCLE_RAD = 2.0 * np.pi
DEFAULT_CAR = "nigel"


@lru_cache(maxsize=64)
def scanner_of(car: str) -> tuple[float, float] | None:
    """Return where the LIDAR of a car of that file sits [m], x forward, y left; None: it has none.

    A file that is not ours is a Nigel's.
    """
    model = load_car(car if car in car_names() else DEFAULT_CAR)
    if not model.has("lidar.position_m"):
        return None
    x_m, y_m, _ = model.vector("lidar.position_m")
    return x_m, y_m


def scan_row(
    held: Held[LidarScan], pose: Pose2 | None, scanner: tuple[float, float], now_ns: int
) -> ScanRow:
    """Return a scan as it is shown; `pose` is the car's at the scan's time, if it is known."""
    scan = held.message
    ranges = np.frombuffer(scan.payload, "<f4")
    misses = ~np.isfinite(ranges)
    shown = np.round(ranges.astype(np.float64), 3).astype(object)
    shown[misses] = None
    step = scan.bearing_step_rad
    return ScanRow(
        vehicle=scan.vehicle,
        t_ns=scan.t_ns,
        age_s=round(held.age_s(now_ns), 3),
        range_min_m=scan.range_min_m,
        range_max_m=scan.range_max_m,
        scanner_x_m=scanner[0],
        scanner_y_m=scanner[1],
        bearing_first_rad=scan.bearing_first_rad,
        bearing_step_rad=FULL_CIRCLE_RAD / max(1, scan.beams) if step is None else step,
        ranges_m=tuple(shown.tolist()),
        x_m=None if pose is None else round(pose.x, 4),
        y_m=None if pose is None else round(pose.y, 4),
        yaw_rad=None if pose is None else round(pose.yaw, 4),
    )
