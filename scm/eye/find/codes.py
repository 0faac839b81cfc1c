"""The cells of the tags of the family tag36h11: 8 x 8 each, with the black border."""

from functools import cache

import numpy as np

from scm.arrays import Bools
from scm.scenery.tags import CELLS, MARGIN_CELLS, TAG_COUNT, tag_picture


@cache
def tag_cells() -> Bools:
    """Return which cells of each tag are white, (587, 8, 8): id, row from the bottom, column."""
    cells = np.empty((TAG_COUNT, CELLS, CELLS), dtype=np.bool_)
    inside = slice(MARGIN_CELLS, MARGIN_CELLS + CELLS)
    for tag_id in range(TAG_COUNT):
        cells[tag_id] = tag_picture.__wrapped__(tag_id, 1)[inside, inside][::-1] > 127
    cells.setflags(write=False)
    return cells
