"""Maps that cars make of unknown rooms, each placed in the city by where its car is."""

import logging
from collections.abc import Callable

from msgspec.structs import asdict

from scm.api.picture import Held, Picture
from scm.errors import MessageError
from scm.geometry import Pose2
from scm.log import event
from scm.records.room_maps import RoomMapRow
from scm.v2x.grid_payload import packed
from scm.v2x.messages.occupancy_map import OccupancyMap

SAME = (
    *("vehicle", "t_ns", "state", "reason", "rows", "columns", "cell_m", "x_m", "y_m", "path"),
    *("car_x_m", "car_y_m", "car_yaw_rad"),
)
TruthAt = Callable[[str, int], Pose2 | None]

_log = logging.getLogger(__name__)


class ReceivedMaps:
    """The newest map of each car; not safe between threads by itself.

    Attributes:
        newest: By car, cells compressed.
        origins: By car, where the frame of its map lies in the city.
    """

    def __init__(self) -> None:
        self.newest: dict[str, Held[OccupancyMap]] = {}
        self.origins: dict[str, Pose2] = {}
        self._unplaced: set[str] = set()

    def receive(self, room: OccupancyMap, t_ns: int) -> None:
        """Store a map; a damaged one is logged."""
        try:
            cells = room.cells
        except MessageError as cause:
            event(_log, "map_refused", level=logging.WARNING, vehicle=room.vehicle, why=str(cause))
            return
        if room.compression == "none":
            room = OccupancyMap(**asdict(room) | {"compression": "zlib", "payload": packed(cells)})
        self.newest[room.vehicle] = Held(room, t_ns)
        self._unplaced.add(room.vehicle)

    def place(self, truth_at: TruthAt) -> None:
        """Place new maps, by where their cars were at their times."""
        for vehicle in tuple(self._unplaced):
            room = self.newest[vehicle].message
            pose = truth_at(vehicle, room.t_ns)
            if pose is not None:
                on_map = Pose2(room.car_x_m, room.car_y_m, room.car_yaw_rad)
                self.origins[vehicle] = pose @ on_map.inverse()
                self._unplaced.discard(vehicle)

    def forget(self, oldest_ns: int) -> None:
        """Drop what arrived before a time."""
        for name in [n for n, held in self.newest.items() if held.arrived_ns < oldest_ns]:
            del self.newest[name]
            self.origins.pop(name, None)
            self._unplaced.discard(name)


def room_maps_of(picture: Picture) -> tuple[RoomMapRow, ...]:
    """Return the map of each car that makes one, by name."""
    return tuple(
        _row(held.message, picture.map_origins.get(name))
        for name, held in sorted(picture.room_maps.items())
    )


def _row(room: OccupancyMap, origin: Pose2 | None) -> RoomMapRow:
    return RoomMapRow(
        **{name: getattr(room, name) for name in SAME},
        origin_x_m=None if origin is None else round(origin.x, 4),
        origin_y_m=None if origin is None else round(origin.y, 4),
        origin_yaw_rad=None if origin is None else round(origin.yaw, 5),
        cells=room.payload,
    )
