"""Scans of a LIDAR."""

import msgspec

from scm.records.fields import XM, YM, AgeS, TNs, VehicleName, YawRad


class ScanRow(msgspec.Struct, kw_only=True, frozen=True):
    """One turn of a car's LIDAR, and where the car stood when it ended.

    Attributes:
        t_ns: When the last beam looked, world's clock.
        age_s: How long ago it reached us.
        range_min_m: Nearer than this it sees nothing [m].
        range_max_m: Farther than this it sees nothing [m].
        scanner_x_m: Where the scanner sits on the car, forward of its pose; likewise `y`, left.
        scanner_y_m: Where the scanner sits on the car, + = left [m].
        bearing_first_rad: Where beam 0 looks, 0 is ahead, + = left.
        bearing_step_rad: From each beam to the next, counter-clockwise.
        ranges_m: One a beam; None: nothing within `range_max_m`.
        x_m: The car's pose at `t_ns` in the map frame; None with `y_m`, `yaw_rad`: not known.
    """

    vehicle: VehicleName
    t_ns: TNs
    age_s: AgeS
    range_min_m: float
    range_max_m: float
    scanner_x_m: float
    scanner_y_m: float
    bearing_first_rad: float
    bearing_step_rad: float
    ranges_m: tuple[float | None, ...]
    x_m: XM | None
    y_m: YM | None
    yaw_rad: YawRad | None
