"""Finding tag36h11 tags in a grey frame, with the AprilTag library.

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
from scm.v2x.messages.eye_tags import TagSeen

PIXEL_ORIGIN_PX = 0.5
"""The library puts the first pixel's centre at (0.5, 0.5); we, as OpenCV, at (0, 0)."""

_lock = threading.Lock()
_detectors: list[pupil_apriltags.Detector] = []


@dataclass(frozen=True, slots=True)
class Settings:
    """How to look for tags.

    Attributes:
        quad_decimate: Squares are sought in a picture this many times smaller; edges and bits are
            still read from the full one. 2 is 5 times faster than 1 and as accurate down to tags
            of about 30 px.
        quad_sigma: Blur before squares are sought [px of the smaller picture]; helps against noise.
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
    with _lock:
        found = _detector(settings).detect(np.ascontiguousarray(grey))
    best: dict[int, TagSeen] = {}
    for one in sorted(found, key=lambda one: one.decision_margin):
        if one.hamming <= settings.max_hamming and one.decision_margin >= settings.min_margin:
            best[one.tag_id] = _seen(one)
    return tuple(best[tag_id] for tag_id in sorted(best))


def _seen(one: pupil_apriltags.Detection) -> TagSeen:
    corners = [(float(x), float(y)) for x, y in one.corners - PIXEL_ORIGIN_PX]
    x, y = (float(value) for value in one.center - PIXEL_ORIGIN_PX)
    return TagSeen(
        tag_id=int(one.tag_id),
        centre_px=(x, y),
        corners_px=(corners[0], corners[1], corners[2], corners[3]),
        margin=float(one.decision_margin),
    )


def _detector(settings: Settings) -> pupil_apriltags.Detector:
    if not _detectors:
        _detectors.append(pupil_apriltags.Detector(families="tag36h11", nthreads=1))
        atexit.register(_never_free)
    options = _detectors[0].tag_detector_ptr.contents
    options.quad_decimate = settings.quad_decimate
    options.quad_sigma = settings.quad_sigma
    return _detectors[0]


def _never_free() -> None:
    for detector in _detectors:
        detector.tag_detector_ptr = None
