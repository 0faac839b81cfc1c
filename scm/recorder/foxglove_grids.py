"""Converts grids that cars send for Foxglove: cells in colours, with their values."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scm.geometry import Pose2
from scm.recorder import foxglove_messages as fox
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.occupancy_map import OccupancyMap

UINT8, INT8 = 1, 2
CLEAR = (0, 0, 0, 0)
FREE, OCCUPIED = (96, 196, 255, 70), (208, 255, 64, 255)
FAR_M = 0.3  # from obstacles, where the colour of a costmap ends
OBSTACLE = (94, 10, 84, 170)
HEAT = ((214, 40, 57, 125), (247, 127, 0, 100), (252, 211, 77, 60), (252, 237, 160, 0))
"""From half of the car's width to `FAR_M`, as on the dashboard."""
HEIGHT_M = 0.002  # over the roads

Colours = NDArray[np.uint8]


def map_frame(vehicle: str) -> str:
    """Return the name of the frame of the map that a car makes."""
    return f"{vehicle}/map"


def map_grid(room: OccupancyMap, at: fox.Time) -> fox.Grid:
    """Return the map that a car makes; the field `occupancy` has the cells' values.

    Raises:
        MessageError: when its payload is damaged.
    """
    colours = np.zeros((256, 4), np.uint8)
    colours[0], colours[100] = FREE, OCCUPIED
    cells = np.frombuffer(room.cells, np.uint8)
    value = fox.PackedField(name="occupancy", offset=4, type=INT8)
    return _grid(room, at, map_frame(room.vehicle), (cells, colours, value))


def costmap_grid(costmap: Costmap, at: fox.Time, frame: str) -> fox.Grid:
    """Return a costmap; the field `clearance` has the cells' values, in steps of `step_m`.

    Raises:
        MessageError: when its payload is damaged.
    """
    away_m = costmap.step_m * np.arange(256)
    ends_m = np.linspace(costmap.half_width_m, max(FAR_M, costmap.half_width_m), len(HEAT))
    heat = np.array(HEAT, np.float64)
    colours = np.column_stack([np.interp(away_m, ends_m, heat[:, i]) for i in range(4)])
    colours[0] = OBSTACLE
    cells = np.frombuffer(costmap.cells, np.uint8)
    value = fox.PackedField(name="clearance", offset=4, type=UINT8)
    return _grid(costmap, at, frame, (cells, colours.round().astype(np.uint8), value))


def _grid(
    sent: OccupancyMap | Costmap,
    at: fox.Time,
    frame: str,
    cells: tuple[Colours, Colours, fox.PackedField],
) -> fox.Grid:
    """Return a grid; `cells` has its values, the colour of each value, and the values' field."""
    values, colours, field = cells
    names = ("red", "green", "blue", "alpha")
    return fox.Grid(
        timestamp=at,
        frame_id=frame,
        pose=fox.Pose(position=fox.Vector(x=sent.x_m, y=sent.y_m, z=HEIGHT_M)),
        column_count=sent.columns,
        cell_size=fox.Vector2(x=sent.cell_m, y=sent.cell_m),
        row_stride=5 * sent.columns,
        cell_stride=5,
        fields=(
            *(fox.PackedField(name=name, offset=i, type=UINT8) for i, name in enumerate(names)),
            field,
        ),
        data=np.column_stack((colours[values], values)).tobytes(),
    )


def origin_of(room: OccupancyMap, car: Pose2) -> Pose2:
    """Return where the frame of a car's map lies, by where the car is."""
    return car @ Pose2(room.car_x_m, room.car_y_m, room.car_yaw_rad).inverse()


def poses(
    at: fox.Time, frame: str, places: Sequence[tuple[float, float, float]]
) -> fox.PosesInFrame:
    """Return poses x [m], y [m], yaw [rad] of a frame."""
    return fox.PosesInFrame(
        timestamp=at,
        frame_id=frame,
        poses=tuple(
            fox.Pose(position=fox.Vector(x=x, y=y), orientation=fox.turned(yaw))
            for x, y, yaw in places
        ),
    )
