"""The map that a car makes of its surroundings: square cells, as in ROS's OccupancyGrid."""

from typing import ClassVar, Literal

from scm.records.fields import TNs, VehicleName
from scm.v2x import grid_payload
from scm.v2x.message import Message
from scm.v2x.messages.autonomy_plan import PlannedPose


class OccupancyMap(Message, kw_only=True, frozen=True):
    """What is free, occupied and unknown by now, in the car's own map frame.

    Attributes:
        rows, columns: Of cells; row 0 is the lowest, column 0 the leftmost.
        cell_m: Edge of a cell.
        x_m, y_m: Lower left corner of cell (0, 0).
        car_x_m, car_y_m, car_yaw_rad: Where the car is on it.
        state, reason: What the car does, as in `AutonomyStatus`.
        path: Poses of the rear axle up to where it looks round next: x [m], y [m], yaw [rad].
        compression: Of the payload.
        payload: int8, a cell each, row by row: 0 free, 100 occupied, -1 unknown.
    """

    KEY: ClassVar[str] = "v/{vehicle}/map"
    RATE_HZ: ClassVar[float | None] = 1.0

    vehicle: VehicleName
    t_ns: TNs
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
    path: tuple[PlannedPose, ...] = ()
    compression: Literal["none", "zlib"] = "none"
    payload: bytes

    @property
    def cells(self) -> bytes:
        """The cells, int8.

        Raises:
            MessageError: when they are not rows x columns.
        """
        unpack = grid_payload.checked if self.compression == "none" else grid_payload.unpacked
        return unpack(self.payload, self.rows, self.columns)


MESSAGE = OccupancyMap
