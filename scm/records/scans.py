"""Scans of a LIDAR."""

import msgspec


class ScanRow(msgspec.Struct, kw_only=True, frozen=True):
    """One turn of a car's LIDAR, and where the car stood when it ended.

    Attributes:
        t_ns: When the last beam looked, world's clock.
        age_s: How long ago it reached us.
        scanner_x_m: Where the scanner sits on the car, forward of its pose; likewise `y`, left.
        bearing_first_rad: Where beam 0 looks, 0 is ahead, + = left.
        bearing_step_rad: From each beam to the next, counter-clockwise.
        ranges_m: One a beam; None: nothing within `range_max_m`.
        x_m: The car's pose at `t_ns` in the map frame; None with `y_m`, `yaw_rad`: not known.
    """

    vehicle: str
    t_ns: int
    age_s: float
    range_min_m: float
    range_max_m: float
    scanner_x_m: float
    scanner_y_m: float
    bearing_first_rad: float
    bearing_step_rad: float
    ranges_m: tuple[float | None, ...]
    x_m: float | None
    y_m: float | None
    yaw_rad: float | None
