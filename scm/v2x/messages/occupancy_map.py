"""The map that a car makes of its surroundings: square cells, as in ROS's OccupancyGrid."""

from typing import ClassVar

from scm.v2x.message import Message


class OccupancyMap(Message, kw_only=True, frozen=True):
    """What is free, occupied and unknown by now, in the car's own map frame.

    Attributes:
        rows, columns: Of cells; row 0 is the lowest, column 0 the leftmost.
        cell_m: Edge of a cell.
        x_m, y_m: Lower left corner of cell (0, 0).
        car_x_m, car_y_m, car_yaw_rad: Where the car is on it.
        state, reason: What the car does, as in `AutonomyStatus`.
        payload: int8, a cell each, row by row: 0 free, 100 occupied, -1 unknown.
    """

    KEY: ClassVar[str] = "v/{vehicle}/map"
    RATE_HZ: ClassVar[float | None] = 1.0

    vehicle: str
    t_ns: int
    rows: int
    columns: int
    cell_m: float
    x_m: float
    y_m: float
    car_x_m: float
    car_y_m: float
    car_yaw_rad: float
    state: str
    reason: str = ""
    payload: bytes


MESSAGE = OccupancyMap
