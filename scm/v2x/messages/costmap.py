"""What a car's planners avoid: how far each place is from the nearest obstacle."""

from typing import Annotated, ClassVar

from msgspec import Meta

from scm.records.fields import TNs, VehicleName
from scm.v2x import grid_payload
from scm.v2x.message import Message


class Costmap(Message, kw_only=True, frozen=True):
    """Clearance on the map, corrected by what the car sees; sent only while somebody subscribes.

    Attributes:
        rows, columns: Of cells; row 0 is the lowest, column 0 the leftmost.
        cell_m: Edge of a cell.
        x_m, y_m: Lower left corner of cell (0, 0), map frame.
        step_m: What 1 stands for in the payload.
        half_width_m: Half of the car's width: its middle line stays at least so far from obstacles.
        payload: uint8, a cell each, row by row, compressed by zlib: how far the cell's nearest
            place is from the nearest obstacle, rounded down; 0 in an obstacle, 255 so far or
            farther.
    """

    KEY: ClassVar[str] = "v/{vehicle}/costmap"
    RATE_HZ: ClassVar[float | None] = 1.0

    vehicle: VehicleName
    t_ns: TNs
    rows: int
    columns: int
    cell_m: float
    x_m: float
    y_m: float
    step_m: float
    half_width_m: float
    payload: Annotated[bytes, Meta(examples=["eAFjYAUAAAcABg=="])]

    @property
    def cells(self) -> bytes:
        """The cells, uint8.

        Raises:
            MessageError: when they are not rows x columns.
        """
        return grid_payload.unpacked(self.payload, self.rows, self.columns)


MESSAGE = Costmap
