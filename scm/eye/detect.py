"""Finds tag36h11 tags in a grey frame, with the AprilTag library.

In two passes: tags are found in the downscaled frame, which is fast, and each is then measured in
a full-size crop of its own, which is exact (corner error 0.035 px instead of 0.055 px).

The library (pupil-apriltags 1.0.4) corrupts memory in two ways. Freeing a detector crashes the
process at any later time: so one detector lives as long as the process, is never freed, and its
settings are changed in place. A small picture does too: see `_padded`.
"""

import atexit
import math
import threading
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pupil_apriltags

from scm.arrays import Floats, Image
from scm.eye.picture import MIN_SIDE_PX
from scm.records.eye import TagSeen

PIXEL_ORIGIN_PX = 0.5
"""The library puts the first pixel's centre at (0.5, 0.5); we, like OpenCV, at (0, 0)."""

CORNER_STD_PX = 0.037
"""Standard deviation of each corner coordinate, measured on rendered tags of 30 to 33 px at 2 grey
levels of sensor noise."""
MEASURE_SIGMA = 0.8
"""Blur of the exact pass [px]: without it corners are 0.053 px off."""
CUT_MARGIN = 0.4
"""Margin of a crop around a tag, in parts of the tag's larger side."""

MIN_SEARCH_PX = 5120
"""Minimum number of pixels of the picture in which squares are sought; enough under a checking
allocator, where 4900 are not."""

_lock = threading.Lock()
_detectors: list[pupil_apriltags.Detector] = []


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of the tag search.

    Attributes:
        quad_decimate: Squares are sought in a picture this many times smaller; edges and bits are
            still read from the full one. 2 finds tags down to about 28 px in a quarter of the time.
        quad_sigma: Blur before squares are sought [px of the smaller picture]. 0.8 saves a third of
            the time on a plain noisy floor, and lost one of five tags of 28 px in a photograph.
        max_hamming: Maximum number of wrong bits of a tag's 36.
        min_margin: Minimum decision margin (grey levels between bits and their threshold).
    """

    quad_decimate: float = 2.0
    quad_sigma: float = 0.0
    max_hamming: int = 1
    min_margin: float = 15.0


def detect_tags(
    grey: Image, settings: Settings | None = None, *, duplicates: bool = False
) -> tuple[TagSeen, ...]:
    """Return the tags in a grey frame (height, width), sorted by id, the clearest first.

    Args:
        grey: The frame.
        settings: Of the search.
        duplicates: Whether to return every place of an id, instead of only the clearest.
    """
    settings = settings or Settings()
    coarse = look(grey, settings, settings.quad_decimate, settings.quad_sigma)
    if not duplicates:
        coarse = list({tag.tag_id: tag for tag in reversed(coarse)}.values())
    return in_order(measure_again(grey, settings, tag) for tag in coarse)


def in_order(tags: Iterable[TagSeen]) -> tuple[TagSeen, ...]:
    """Return tags sorted by id, the clearest of each id first."""
    return tuple(sorted(tags, key=lambda tag: (tag.tag_id, -tag.margin)))


def look(grey: Image, settings: Settings, decimate: float, sigma: float) -> list[TagSeen]:
    """Return what the library finds in a grey picture, clearest first, duplicates included."""
    if min(grey.shape) < MIN_SIDE_PX:
        return []
    with _lock:
        detector = _detector()
        options = detector.tag_detector_ptr.contents
        options.quad_decimate = decimate
        options.quad_sigma = sigma
        found = detector.detect(_padded(grey, decimate))
    good = [
        one for one in found
        if one.hamming <= settings.max_hamming and one.decision_margin >= settings.min_margin
    ]  # fmt: skip
    return [_seen(one) for one in sorted(good, key=lambda one: -one.decision_margin)]


def _padded(grey: Image, decimate: float) -> Image:
    """Return the picture; a small one is padded to the right and below by its edges.

    The library's table of outlines is too small, and overflows, when there are fewer than
    `MIN_SEARCH_PX` pixels to seek squares in.
    """
    height, width = grey.shape
    if (height // decimate) * (width // decimate) >= MIN_SEARCH_PX:
        return np.ascontiguousarray(grey)
    least = math.ceil(decimate * (math.sqrt(MIN_SEARCH_PX) + 1.0))
    below, right = max(0, least - height), max(0, least - width)
    return np.pad(grey, ((0, below), (0, right)), mode="edge")


def measure_again(grey: Image, settings: Settings, coarse: TagSeen) -> TagSeen:
    """Return a tag measured in a full-size crop, or unchanged if it is not found there."""
    near = look_around(grey, settings, np.array(coarse.corners_px), CUT_MARGIN)
    return next((tag for tag in near if is_same(tag, coarse)), coarse)


def look_around(grey: Image, settings: Settings, corners: Floats, margin: float) -> list[TagSeen]:
    """Return what the library finds in a full-size crop, clearest first.

    Args:
        grey: The frame.
        settings: Of the search.
        corners: Centre of the crop, (4, 2) [px].
        margin: Around these, in parts of the larger side of their box.
    """
    reach = margin * float(np.ptp(corners, axis=0).max())
    left, top = (max(0, int(value)) for value in corners.min(axis=0) - reach)
    right, bottom = (max(0, int(value) + 2) for value in corners.max(axis=0) + reach)
    cut = grey[top:bottom, left:right]
    if cut.size == 0 or int(cut.max()) - int(cut.min()) < 2.0 * settings.min_margin:
        return []
    return [moved(tag, left, top) for tag in look(cut, settings, 1.0, MEASURE_SIGMA)]


def moved(tag: TagSeen, right: float, down: float) -> TagSeen:
    """Return a tag of a crop in the coordinates of the frame, shifted by [px]."""
    a, b, c, d = ((x + right, y + down) for x, y in tag.corners_px)
    x, y = tag.centre_px
    return TagSeen(
        tag_id=tag.tag_id,
        centre_px=(x + right, y + down),
        corners_px=(a, b, c, d),
        margin=tag.margin,
        hamming=tag.hamming,
    )


def is_same(one: TagSeen, other: TagSeen) -> bool:
    """Return whether two detections are of one tag: same id, less than half a side apart."""
    if one.tag_id != other.tag_id:
        return False
    side = math.dist(one.corners_px[0], one.corners_px[2]) / math.sqrt(2.0)
    return math.dist(one.centre_px, other.centre_px) < 0.5 * side


def _seen(one: pupil_apriltags.Detection) -> TagSeen:
    corners = [(float(x), float(y)) for x, y in one.corners - PIXEL_ORIGIN_PX]
    x, y = (float(value) for value in one.center - PIXEL_ORIGIN_PX)
    return TagSeen(
        tag_id=int(one.tag_id),
        centre_px=(x, y),
        corners_px=(corners[0], corners[1], corners[2], corners[3]),
        margin=float(one.decision_margin),
        hamming=int(one.hamming),
    )


def _detector() -> pupil_apriltags.Detector:
    if not _detectors:
        _detectors.append(pupil_apriltags.Detector(families="tag36h11", nthreads=1))
        atexit.register(_never_free)
    return _detectors[0]


def _never_free() -> None:
    for detector in _detectors:
        detector.tag_detector_ptr = None
