import tracemalloc
import zlib

import pytest

from scm.errors import MessageError
from scm.v2x.grid_payload import packed, unpacked
from scm.v2x.messages.occupancy_map import OccupancyMap

CELLS = bytes((0, 100, 255, 0, 0, 100))
ROOM = OccupancyMap(
    vehicle="n1", t_ns=0, rows=2, columns=3, cell_m=0.05, x_m=0.0, y_m=0.0, car_x_m=0.0,
    car_y_m=0.0, car_yaw_rad=0.0, state="map", payload=CELLS,
)  # fmt: skip


def test_cells_are_those_that_were_packed():
    assert unpacked(packed(CELLS), 2, 3) == CELLS


@pytest.mark.parametrize(
    ("payload", "rows", "problem"),
    [
        (packed(CELLS), 3, "expected 3 x 3 cells of a byte, got 6"),
        (packed(CELLS), 1, "expected 1 x 3 cells of a byte, got more"),
        (packed(CELLS), -1, "expected 0 or more, got -1, 3"),
        (b"not zlib", 2, "expected cells compressed by zlib"),
    ],
)
def test_damaged_payload_is_an_error_in_words(payload, rows, problem):
    with pytest.raises(MessageError, match=problem):
        unpacked(payload, rows, 3)


def test_map_has_its_cells_as_they_are_or_compressed():
    fields = {name: getattr(ROOM, name) for name in ROOM.__struct_fields__}
    compressed = fields | {"compression": "zlib", "payload": zlib.compress(CELLS)}
    assert OccupancyMap(**compressed).cells == ROOM.cells == CELLS
    with pytest.raises(MessageError, match="got 5"):
        _ = OccupancyMap(**fields | {"payload": CELLS[1:]}).cells


def test_payload_of_far_more_cells_is_not_unpacked_whole():
    payload = packed(bytes(50_000_000))
    tracemalloc.start()
    with pytest.raises(MessageError, match="got more"):
        unpacked(payload, 2, 3)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000
