"""Pictures of tags on a grey floor whose corners are known exactly, for the tests of the finder."""

import math

import cv2
import numpy as np

from scm.scenery.tags import CORNERS, PRINT_SCALE, tag_picture

FINER = 8
FLOOR, INK, PAPER = 90, 26, 236


def corners_at(x, y, side, turn=0.0, squeeze=1.0):
    """Corners of a tag (4, 2) [px]; its top turned counter-clockwise from the picture's."""
    c, s = math.cos(turn), math.sin(turn)
    flat = CORNERS * side * np.array([1.0, squeeze])
    upward = flat @ np.array([[c, s], [-s, c]])
    return np.array([x, y]) + upward * np.array([1.0, -1.0])


def picture(tags, size=(480, 640), rng=None, sigma=2.0):
    """Grey picture of tags: pairs of id and corners; each pixel is the mean over its area."""
    page = np.full(size, FLOOR, dtype=np.float64)
    for tag_id, corners in tags:
        _paint(page, tag_id, corners)
    if rng is not None:
        page += rng.normal(0.0, sigma, size)
    return np.clip(np.rint(page), 0, 255).astype(np.uint8)


def _paint(page, tag_id, corners):
    low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 16, 0)
    high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 16, page.shape[::-1])
    window = page[low[1] : high[1], low[0] : high[0]]
    fine = cv2.resize(window, None, fx=FINER, fy=FINER, interpolation=cv2.INTER_NEAREST)
    print_ = INK + (PAPER - INK) / 255.0 * tag_picture(tag_id, 32).astype(np.float64)
    edge = len(print_) * (0.5 + CORNERS / PRINT_SCALE * np.array([1.0, -1.0])) - 0.5
    target = (corners - low + 0.5) * FINER - 0.5
    onto = cv2.getPerspectiveTransform(edge.astype(np.float32), target.astype(np.float32))
    cv2.warpPerspective(print_, onto, fine.shape[::-1], dst=fine, borderMode=cv2.BORDER_TRANSPARENT)
    small = cv2.resize(fine, window.shape[::-1], interpolation=cv2.INTER_AREA)
    window[:] = small


def many(rng, count=40, side=(38.0, 48.0), size=(1080, 1920)):
    """Ids and corners of tags that stand apart in a frame, turned and a little squeezed."""
    height, width = size
    apart = max(120, round(2.1 * side[1]))
    columns, rows = range(90, width - 90, apart), range(90, height - 90, apart)
    slots = [(x, y) for x in columns for y in rows]
    chosen = rng.permutation(len(slots))[:count]
    ids = rng.permutation(587)[:count]
    tags = []
    for tag_id, slot in zip(ids, chosen, strict=True):
        x, y = slots[slot] + rng.uniform(-15.0, 15.0, 2)
        turn, squeeze = rng.uniform(-math.pi, math.pi), rng.uniform(0.85, 1.0)
        tags.append((int(tag_id), corners_at(x, y, rng.uniform(*side), turn, squeeze)))
    return tags


def smeared(grey, length, turn):
    """The picture as a camera sees it that moves `length` pixels while it exposes."""
    half = math.ceil(length / 2) + 1
    size = 2 * half + 1
    fine = np.zeros((size * 10, size * 10), dtype=np.float32)
    for along in np.linspace(-length / 2, length / 2, 200):
        x = int((half + along * math.cos(turn)) * 10)
        y = int((half + along * math.sin(turn)) * 10)
        fine[y : y + 10, x : x + 10] += 1.0
    kernel = cv2.resize(fine, (size, size), interpolation=cv2.INTER_AREA)
    out = cv2.filter2D(grey.astype(np.float32), -1, kernel / kernel.sum())
    return np.clip(np.rint(out), 0, 255).astype(np.uint8)


def dim_and_noisy(grey, rng, dim=0.3, sigma=8.0):
    """The picture with corners darker by `dim`, and sensor noise."""
    height, width = grey.shape
    y, x = np.mgrid[:height, :width]
    off = ((x / width - 0.5) ** 2 + (y / height - 0.5) ** 2) / 0.5
    noisy = grey * (1.0 - dim * off) + rng.normal(0.0, sigma, grey.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
