"""How often something that is no tag, or a half hidden one, is read as a tag that is not there.

A look is one patch of 96 px that holds noise, texture, floor, a square of random cells that no tag
has, or a tag partly covered. The library searches pages of such patches at full size, and each
patch is measured besides as if a tag of a random id were expected on its square.
Run: `python -m bench.eye_wrong_ids [looks] [seed]`.
"""

import sys

import cv2
import numpy as np

from bench.eye_find import HIDDEN_ID, camera
from scm.eye.detect import MEASURE_SIGMA, Settings, look
from scm.eye.find.codes import tag_cells
from scm.eye.find.finder import MAX_BORDER
from scm.eye.find.measure import BITS, BORDER, MARGIN, measure
from scm.eye.render.floor import draw_scenery
from scm.maps.load import load_map
from scm.scenery.tags import CORNERS, PRINT_SCALE, TAG_COUNT, tag_picture

PATCH, SIDE = 96, 10
SETTINGS = Settings()


def main() -> None:
    looks = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
    rng = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 0)
    scenery = draw_scenery(load_map("driving_school"), camera(1920), rng)
    floor = cv2.cvtColor(scenery.picture, cv2.COLOR_BGR2GRAY)
    wrong, right, hidden, done = 0, 0, 0, 0
    while done < looks:
        w, r, h = page(rng, floor)
        wrong, right, hidden, done = wrong + w, right + r, hidden + h, done + SIDE * SIDE
    print(
        f"{done} looks, {hidden} of them at tags partly covered: {right} of those read, "
        f"{wrong} wrong ids (none asked): {'FAIL' if wrong else 'pass'}"
    )


def page(rng, floor):
    """Return wrong ids, right ids and covered tags of one page of patches."""
    sheet = np.empty((SIDE * PATCH, SIDE * PATCH), dtype=np.uint8)
    true = np.full((SIDE, SIDE), -1)
    quads = np.empty((SIDE, SIDE, 4, 2))
    for row in range(SIDE):
        for column in range(SIDE):
            patch, true[row, column], quad = a_patch(rng, floor)
            sheet[row * PATCH : (row + 1) * PATCH, column * PATCH : (column + 1) * PATCH] = patch
            quads[row, column] = quad + np.array([column * PATCH, row * PATCH])
    found = []
    for tag in look(sheet, SETTINGS, 1.0, MEASURE_SIGMA):
        x, y = tag.centre_px
        if tag.tag_id == HIDDEN_ID:
            continue  # the floor shows the map's own tag
        found.append((tag.tag_id, true[int(y) // PATCH, int(x) // PATCH]))
    ids = rng.integers(0, TAG_COUNT, SIDE * SIDE)
    _, verdict = measure(sheet, quads.reshape(-1, 4, 2), tag_cells()[ids])
    good = (
        (verdict[:, BITS] <= SETTINGS.max_hamming)
        & (verdict[:, BORDER] <= MAX_BORDER)
        & (verdict[:, MARGIN] >= SETTINGS.min_margin)
    )
    found += list(zip(ids[good], true.ravel()[good], strict=True))
    right = sum(seen == there for seen, there in found)
    return len(found) - right, right, int((true >= 0).sum())


def a_patch(rng, floor):
    """Return a patch, the id of the tag in it or -1, and where a tag would be."""
    kind = rng.integers(5)
    side, turn = rng.uniform(30.0, 52.0), rng.uniform(0.0, 2.0 * np.pi)
    c, s = np.cos(turn), np.sin(turn)
    quad = CORNERS * side * [1.0, -1.0] @ np.array([[c, s], [-s, c]])
    quad += PATCH / 2 + rng.uniform(-2.0, 2.0, (4, 2))
    if kind == 0:
        return rng.integers(0, 256, (PATCH, PATCH), dtype=np.uint8), -1, quad
    if kind == 1:
        soft = cv2.GaussianBlur(rng.normal(0.0, 1.0, (PATCH, PATCH)), (0, 0), rng.uniform(0.8, 6.0))
        return np.clip(128 + 70 * soft / soft.std(), 0, 255).astype(np.uint8), -1, quad
    y, x = (rng.integers(0, size - PATCH) for size in floor.shape)
    patch = floor[y : y + PATCH, x : x + PATCH].copy()
    if kind == 2:
        return patch, -1, quad
    tag_id = int(rng.integers(TAG_COUNT)) if kind == 4 else -1
    lay(patch, quad, print_of(rng, tag_id))
    if tag_id >= 0:
        cover(rng, patch)
    noisy = patch + rng.normal(0.0, rng.choice([1.0, 4.0, 8.0]), patch.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8), tag_id, quad


def print_of(rng, tag_id):
    """The print of a tag, or of random cells within a tag's border and margin."""
    if tag_id >= 0:
        return tag_picture.__wrapped__(tag_id, 16)
    cells = np.zeros((10, 10), dtype=np.uint8)
    cells[[0, -1]] = 255
    cells[:, [0, -1]] = 255
    cells[2:8, 2:8] = 255 * (rng.random((6, 6)) < rng.uniform(0.2, 0.8))
    return np.kron(cells, np.ones((16, 16), dtype=np.uint8))


def lay(patch, quad, print_):
    edge = len(print_) * (0.5 + CORNERS / PRINT_SCALE * [1.0, -1.0]) - 0.5
    fine = cv2.resize(patch, None, fx=4, fy=4, interpolation=cv2.INTER_NEAREST)
    target = (quad + 0.5) * 4 - 0.5
    onto = cv2.getPerspectiveTransform(edge.astype(np.float32), target.astype(np.float32))
    inked = (26 + print_ * (210.0 / 255.0)).astype(np.uint8)
    size = fine.shape[::-1]
    cv2.warpPerspective(inked, onto, size, dst=fine, borderMode=cv2.BORDER_TRANSPARENT)
    patch[:] = cv2.resize(fine, patch.shape[::-1], interpolation=cv2.INTER_AREA)


def cover(rng, patch):
    """A cable or a hand over part of the tag."""
    ends = rng.integers(10, PATCH - 10, (2, 2)).tolist()
    cv2.line(patch, ends[0], ends[1], int(rng.integers(0, 256)), int(rng.integers(3, 28)))


if __name__ == "__main__":
    main()
