"""Finding tag36h11 tags in a grey frame, with the AprilTag library.

In two looks: tags are found in the frame made smaller, which is fast, and each is then measured in
a full-size cut-out of its own, which is exact (corners 0.035 px off against 0.055 px).

The library writes into memory that is not its own (pupil-apriltags 1.0.4) in two places. Freeing a
detector does, after which the process dies at any later time: there is one for the life of the
process, never freed, and its settings are changed in place. A small picture does: see `_roomy`.
"""

import atexit
import math
import threading
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pupil_apriltags

from scm.arrays import Floats, Image
from scm.eye.picture import LEAST_PX
from scm.records.eye import TagSeen

PIXEL_ORIGIN_PX = 0.5
"""The library puts the first pixel's centre at (0.5, 0.5); we, as OpenCV, at (0, 0)."""

CORNER_STD_PX = 0.037
"""Standard deviation of each corner coordinate, measured on rendered tags of 30 to 33 px at 2 grey
levels of sensor noise."""
MEASURE_SIGMA = 0.8
"""Blur of the exact look [px]: without it corners are 0.053 px off."""
CUT_MARGIN = 0.4
"""Of a cut-out around a tag, in parts of the tag's larger side."""

ROOMY_PX = 5120
"""Pixels of the picture in which squares are sought; seen to be enough under a checking allocator,
where 4900 are not."""

_lock = threading.Lock()
_detectors: list[pupil_apriltags.Detector] = []


@dataclass(frozen=True, slots=True)
class Settings:
    """How to look for tags.

    Attributes:
        quad_decimate: Squares are sought in a picture this many times smaller; edges and bits are
            still read from the full one. 2 finds tags down to about 28 px in a quarter of the time.
        quad_sigma: Blur before squares are sought [px of the smaller picture]. 0.8 saves a third of
            the time on a plain noisy floor, and lost one of five tags of 28 px in a photograph.
        max_hamming: Wrong bits put up with in a tag of 36.
        min_margin: Least decision margin (grey levels between bits and their threshold).
    """

    quad_decimate: float = 2.0
    quad_sigma: float = 0.0
    max_hamming: int = 1
    min_margin: float = 15.0


def detect_tags(
    grey: Image, settings: Settings | None = None, *, twins: bool = False
) -> tuple[TagSeen, ...]:
    """Return the tags in a grey frame (height, width), sorted by id, the clearer of twins first.

    Args:
        grey: The frame.
        settings: How to look.
        twins: Whether an id seen at several places is told of each, not of the clearest alone.
    """
    settings = settings or Settings()
    rough = look(grey, settings, settings.quad_decimate, settings.quad_sigma)
    if not twins:
        rough = list({tag.tag_id: tag for tag in reversed(rough)}.values())
    return in_order(measure_again(grey, settings, tag) for tag in rough)


def in_order(tags: Iterable[TagSeen]) -> tuple[TagSeen, ...]:
    """Return tags sorted by id, the clearer of twins first."""
    return tuple(sorted(tags, key=lambda tag: (tag.tag_id, -tag.margin)))


def look(grey: Image, settings: Settings, decimate: float, sigma: float) -> list[TagSeen]:
    """Return what the library finds in a grey picture, clearest first, twins among them."""
    if min(grey.shape) < LEAST_PX:
        return []
    with _lock:
        detector = _detector()
        options = detector.tag_detector_ptr.contents
        options.quad_decimate = decimate
        options.quad_sigma = sigma
        found = detector.detect(_roomy(grey, decimate))
    good = [
        one for one in found
        if one.hamming <= settings.max_hamming and one.decision_margin >= settings.min_margin
    ]  # fmt: skip
    return [_seen(one) for one in sorted(good, key=lambda one: -one.decision_margin)]


def _roomy(grey: Image, decimate: float) -> Image:
    """Return the picture, continued to the right and below as its edges are if it is small.

    The library's table of outlines is too small, and written beyond its end, when there are fewer
    than `ROOMY_PX` pixels to seek squares in.
    """
    height, width = grey.shape
    if (height // decimate) * (width // decimate) >= ROOMY_PX:
        return np.ascontiguousarray(grey)
    least = math.ceil(decimate * (math.sqrt(ROOMY_PX) + 1.0))
    below, right = max(0, least - height), max(0, least - width)
    return np.pad(grey, ((0, below), (0, right)), mode="edge")


def measure_again(grey: Image, settings: Settings, rough: TagSeen) -> TagSeen:
    """Return a tag measured in a full-size cut-out, or as it was if it is not found there."""
    near = look_around(grey, settings, np.array(rough.corners_px), CUT_MARGIN)
    return next((tag for tag in near if is_same(tag, rough)), rough)


def look_around(grey: Image, settings: Settings, corners: Floats, margin: float) -> list[TagSeen]:
    """Return what the library finds in a full-size cut-out, clearest first.

    Args:
        grey: The frame.
        settings: How to look.
        corners: Around what, (4, 2) [px].
        margin: How far around, in parts of the larger side of the corners' box.
    """
    reach = margin * float(np.ptp(corners, axis=0).max())
    left, top = (max(0, int(value)) for value in corners.min(axis=0) - reach)
    right, bottom = (max(0, int(value) + 2) for value in corners.max(axis=0) + reach)
    cut = grey[top:bottom, left:right]
    if cut.size == 0 or int(cut.max()) - int(cut.min()) < 2.0 * settings.min_margin:
        return []
    return [moved(tag, left, top) for tag in look(cut, settings, 1.0, MEASURE_SIGMA)]


def moved(tag: TagSeen, right: float, down: float) -> TagSeen:
    """Return a tag seen in a cut-out as one of the frame that it was cut from, so far off [px]."""
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
    """Return whether two sightings in a frame are of one tag: its id, less than half a side off."""
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
