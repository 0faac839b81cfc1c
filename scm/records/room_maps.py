"""Maps that cars make of unknown rooms."""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.records.fields import XM, YM, TNs, VehicleName, YawRad


class RoomMapRow(msgspec.Struct, kw_only=True, frozen=True):
    """The map that a car makes by its LIDAR, by now: square cells in a frame of the car's own.

    Attributes:
        state: What the car does.
        reason: Why, in words; empty where there is nothing to say.
        rows: Of cells; row 0 is the lowest.
        columns: Of cells; column 0 is the leftmost.
        cell_m: Edge of a cell.
        x_m: Lower left corner of cell (0, 0); likewise `y_m`.
        y_m: Lower left corner of cell (0, 0).
        car_x_m: Where the car is on it; likewise `car_y_m`, `car_yaw_rad`.
        car_y_m: Where the car is on it.
        car_yaw_rad: Where the car heads on it.
        path: Poses of the rear axle up to where it looks round next: x [m], y [m], yaw [rad].
        origin_x_m: Where the map's frame lies in the city's, by where the car was then; null with
            `origin_y_m`, `origin_yaw_rad`: not known.
        origin_y_m: Likewise.
        origin_yaw_rad: Likewise.
        cells: int8, a cell each, row by row, compressed by zlib: 0 free, 100 occupied, -1 unknown.
    """

    vehicle: VehicleName
    t_ns: TNs
    state: Annotated[str, Meta(examples=["map"])]
    reason: Annotated[str, Meta(examples=["goes on 0.9 m to see more"])]
    rows: int
    columns: int
    cell_m: float
    x_m: float
    y_m: float
    car_x_m: float
    car_y_m: float
    car_yaw_rad: float
    path: tuple[tuple[float, float, float], ...]
    origin_x_m: XM | None
    origin_y_m: YM | None
    origin_yaw_rad: YawRad | None
    cells: Annotated[bytes, Meta(examples=["eAFjYAUAAAcABg=="])]
