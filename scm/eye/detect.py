"""Finding tag36h11 tags in a grey frame, with the AprilTag library.

In two looks: tags are found in the frame made smaller, which is fast, and each is then measured in
a full-size cut-out of its own, which is exact (corners 0.035 px off against 0.055 px).

The library's detector crashes the process when it is freed and built again (pupil-apriltags 1.0.4:
after 1 to 60 times). So there is one for the life of the process, never freed, and its settings are
changed in place.
"""

import atexit
import threading
from dataclasses import dataclass

import numpy as np
import pupil_apriltags

from scm.arrays import Image
from scm.eye.picture import LEAST_PX
from scm.v2x.messages.eye_tags import TagSeen

PIXEL_ORIGIN_PX = 0.5
"""The library puts the first pixel's centre at (0.5, 0.5); we, as OpenCV, at (0, 0)."""

CORNER_STD_PX = 0.037
"""Standard deviation of each corner coordinate, measured on rendered tags of 30 to 33 px at 2 grey
levels of sensor noise."""
MEASURE_SIGMA = 0.8
"""Blur of the exact look [px]: without it corners are 0.053 px off."""
CUT_MARGIN = 0.4
"""Of a cut-out around a tag, in parts of the tag's larger side."""

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


def detect_tags(grey: Image, settings: Settings | None = None) -> tuple[TagSeen, ...]:
    """Return the tags in a grey frame (height, width), sorted by id; of twins the clearer one."""
    settings = settings or Settings()
    if min(grey.shape) < LEAST_PX:
        return ()
    with _lock:
        rough = _look(grey, settings, settings.quad_decimate, settings.quad_sigma)
        found = {tag_id: _measure(grey, settings, tag) for tag_id, tag in rough.items()}
    return tuple(found[tag_id] for tag_id in sorted(found))


def _look(grey: Image, settings: Settings, decimate: float, sigma: float) -> dict[int, TagSeen]:
    detector = _detector()
    options = detector.tag_detector_ptr.contents
    options.quad_decimate = decimate
    options.quad_sigma = sigma
    found = detector.detect(np.ascontiguousarray(grey))
    best: dict[int, TagSeen] = {}
    for one in sorted(found, key=lambda one: one.decision_margin):
        if one.hamming <= settings.max_hamming and one.decision_margin >= settings.min_margin:
            best[one.tag_id] = _seen(one)
    return best


def _measure(grey: Image, settings: Settings, rough: TagSeen) -> TagSeen:
    """Return a tag measured in a full-size cut-out, or as it was if it is not found there."""
    corners = np.array(rough.corners_px)
    margin = CUT_MARGIN * float(np.ptp(corners, axis=0).max())
    left, top = (max(0, int(value)) for value in corners.min(axis=0) - margin)
    right, bottom = (int(value) + 2 for value in corners.max(axis=0) + margin)
    fine = _look(grey[top:bottom, left:right], settings, 1.0, MEASURE_SIGMA).get(rough.tag_id)
    if fine is None:
        return rough
    a, b, c, d = ((x + left, y + top) for x, y in fine.corners_px)
    x, y = fine.centre_px
    return TagSeen(
        tag_id=fine.tag_id,
        centre_px=(x + left, y + top),
        corners_px=(a, b, c, d),
        margin=fine.margin,
    )


def _seen(one: pupil_apriltags.Detection) -> TagSeen:
    corners = [(float(x), float(y)) for x, y in one.corners - PIXEL_ORIGIN_PX]
    x, y = (float(value) for value in one.center - PIXEL_ORIGIN_PX)
    return TagSeen(
        tag_id=int(one.tag_id),
        centre_px=(x, y),
        corners_px=(corners[0], corners[1], corners[2], corners[3]),
        margin=float(one.decision_margin),
    )


def _detector() -> pupil_apriltags.Detector:
    if not _detectors:
        _detectors.append(pupil_apriltags.Detector(families="tag36h11", nthreads=1))
        atexit.register(_never_free)
    return _detectors[0]


def _never_free() -> None:
    for detector in _detectors:
        detector.tag_detector_ptr = None
