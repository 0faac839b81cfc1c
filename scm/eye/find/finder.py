"""Finds tags frame after frame: fast where they are known, and nothing new missed for long.

A tag with a predicted place is measured there, without a search. The library searches one upright
strip of the frame each time, so that the whole frame is covered within `scan_frames`. The first
frame, and one in which most tags are lost, is searched completely. Two tags with the same id at two
places are both returned.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.eye.detect import (
    Settings,
    in_order,
    is_same,
    look,
    look_around,
    measure_again,
    moved,
)
from scm.eye.find.codes import tag_cells
from scm.eye.find.measure import BITS, BORDER, MARGIN, measure
from scm.eye.picture import MIN_SIDE_PX
from scm.records.eye import TagSeen
from scm.scenery.tags import TAG_COUNT

DECIMATED_ROWS = 1080
"""Taller frames are downscaled in proportion for the search."""
ENOUGH_PX = 14.0
"""Sufficient side of a tag in the search: strips are downscaled to it, by 1.5 at most."""
SEARCH_BLUR_PX = (3, 3)
"""Blur before downscaling: saves a quarter of the time."""
RESCUES = 6
"""Maximum number of crops around lost tags searched per frame."""
_RESCUE_MARGIN = 0.75
MAX_BORDER = 2
"""Maximum number of wrong cells in a tag's border, of 28."""
_STRIP_OVERLAP = 1.9
"""Overlap of strips, in sides of the largest tag: its diagonal, and a margin."""
_USUAL_SIDE = 1.0 / 18.0
"""Minimum side of a tag that strips must overlap for, in heights of the frame."""
_NOTHING: Mapping[int, Floats] = MappingProxyType({})


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Predicted place of a tag.

    Attributes:
        tag_id: Which.
        corners: (4, 2) [px].
        step: Movement of the corners since the previous frame, (4, 2) [px].
        middle: Mean of the corners [px].
        side: Of the tag [px].
    """

    tag_id: int
    corners: Floats
    step: Floats
    middle: tuple[float, float]
    side: float

    def is_near(self, other: "_Place") -> bool:
        """Return whether it has the same id and is less than a side away."""
        return self.tag_id == other.tag_id and math.dist(self.middle, other.middle) < self.side


def _place(tag_id: int, corners: Floats, step: Floats | None = None) -> _Place:
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = corners.tolist()
    middle = (0.25 * (ax + bx + cx + dx), 0.25 * (ay + by + cy + dy))
    side = math.hypot(cx - ax, cy - ay) / math.sqrt(2.0)
    return _Place(tag_id, corners, np.zeros((4, 2)) if step is None else step, middle, side)


class TagFinder:
    """Finds the tags of one camera's frames, given in order.

    Args:
        settings: Of the search, at up to 1080 rows.
        scan_frames: Number of frames in which the whole picture is searched.
    """

    def __init__(self, settings: Settings | None = None, scan_frames: int = 12) -> None:
        self._settings = settings or Settings()
        self._scan_frames = max(1, scan_frames)
        self._shape: tuple[int, ...] = ()
        self._strip = 0
        self._since_whole = 0
        self._turn = 0
        self._seen: list[_Place] = []

    def find(self, grey: Image, expected: Mapping[int, Floats] = _NOTHING) -> tuple[TagSeen, ...]:
        """Return the tags in a frame, sorted by id, the clearest first.

        Args:
            grey: The frame, (height, width).
            expected: Predicted corners of known tags by id, (4, 2) [px], in the order of
                `TagSeen.corners_px`; up to 1.5 of a tag's cells off. Tags of the previous frame are
                tracked anyway.
        """
        if min(grey.shape) < MIN_SIDE_PX:
            return ()
        frame = np.require(grey, np.uint8, ["C", "W"])
        first = frame.shape != self._shape
        if first:
            self._shape, self._seen, self._since_whole = frame.shape, [], self._scan_frames
        places = self._places(expected)
        seen, lost = self._measured(frame, places)
        most_lost = len(places) > 0 and 2 * len(lost) >= len(places)
        whole = first or (most_lost and self._since_whole >= self._scan_frames)
        coarse = self._search(frame, places, whole=whole)
        if not whole:
            ids = {tag.tag_id for tag in seen}
            coarse += self._rescue(frame, [place for place in lost if place.tag_id not in ids])
        for tag in coarse:
            if not any(is_same(tag, other) for other in seen):
                seen.append(self._exact(frame, tag))
        self._remember(seen)
        return in_order(seen)

    def _places(self, expected: Mapping[int, Floats]) -> list[_Place]:
        known = [
            _place(tag_id, np.asarray(corners, dtype=np.float64))
            for tag_id, corners in expected.items()
            if 0 <= tag_id < TAG_COUNT and np.isfinite(corners).all()
        ]
        expected_by_id = {place.tag_id: place for place in known}
        for place in self._seen:
            now = _place(place.tag_id, place.corners + place.step, place.step)
            if place.tag_id not in expected_by_id or not now.is_near(expected_by_id[place.tag_id]):
                known.append(now)
        return known

    def _measured(self, frame: Image, places: list[_Place]) -> tuple[list[TagSeen], list[_Place]]:
        """Return the tags measured at their predicted places, and the places without a tag."""
        if not places:
            return [], []
        white = tag_cells()[[place.tag_id for place in places]]
        found, results = measure(frame, np.array([place.corners for place in places]), white)
        settings = self._settings
        good = (
            (results[:, BITS] <= settings.max_hamming)
            & (results[:, BORDER] <= MAX_BORDER)
            & (results[:, MARGIN] >= settings.min_margin)
        )
        seen: list[TagSeen] = []
        lost: list[_Place] = []
        by_id: dict[int, list[TagSeen]] = {}
        for place, corners, result, is_good in zip(places, found, results, good, strict=True):
            if not is_good:
                lost.append(place)
                continue
            tag = _sighting(place.tag_id, corners, result)
            same_id = by_id.setdefault(place.tag_id, [])
            if not any(is_same(tag, other) for other in same_id):
                same_id.append(tag)
                seen.append(tag)
        return seen, lost

    def _search(self, frame: Image, places: list[_Place], *, whole: bool) -> list[TagSeen]:
        height, width = frame.shape
        decimate = self._settings.quad_decimate * max(1.0, round(height / DECIMATED_ROWS))
        if places and not whole:
            smallest = min(place.side for place in places)
            # the library leaves pixels out by whole numbers, and scales back by its argument
            decimate = max(decimate, int(min(1.5 * decimate, smallest / ENOUGH_PX)))
        self._since_whole += 1
        left, right = 0, width
        if whole:
            self._since_whole, self._strip = 0, 0
        elif self._scan_frames > 1:
            side = max([height * _USUAL_SIDE, *(place.side for place in places)])
            left = self._strip * width // self._scan_frames
            end = (self._strip + 1) * width / self._scan_frames
            right = min(width, math.ceil(end + _STRIP_OVERLAP * side))
            self._strip = (self._strip + 1) % self._scan_frames
        strip = frame[:, left:right]
        if decimate > 1.0:
            strip = np.asarray(cv2.blur(strip, SEARCH_BLUR_PX), dtype=np.uint8)
        found = look(strip, self._settings, decimate, self._settings.quad_sigma)
        return [moved(tag, left, 0.0) for tag in found]

    def _rescue(self, frame: Image, lost: list[_Place]) -> list[TagSeen]:
        """Return what the library finds around lost tags; if many, some in each frame."""
        count = min(RESCUES, len(lost))
        chosen = [lost[(self._turn + k) % len(lost)] for k in range(count)]
        self._turn += count
        cuts = (
            look_around(frame, self._settings, place.corners, _RESCUE_MARGIN) for place in chosen
        )
        return [tag for cut in cuts for tag in cut]

    def _exact(self, frame: Image, coarse: TagSeen) -> TagSeen:
        """Return a tag found by the library, measured like the others if possible."""
        place = _place(coarse.tag_id, np.array(coarse.corners_px))
        seen, _ = self._measured(frame, [place])
        if seen and is_same(seen[0], coarse):
            return seen[0]
        return measure_again(frame, self._settings, coarse)

    def _remember(self, seen: Iterable[TagSeen]) -> None:
        places: list[_Place] = []
        before_by_id = defaultdict[int, list[_Place]](list)
        for place in self._seen:
            before_by_id[place.tag_id].append(place)
        for tag in seen:
            corners = np.array(tag.corners_px)
            now = _place(tag.tag_id, corners)
            before = next((old for old in before_by_id[tag.tag_id] if old.is_near(now)), now)
            step = corners - before.corners
            places.append(_Place(tag.tag_id, corners, step, now.middle, now.side))
        self._seen = places


def _sighting(tag_id: int, corners: Floats, result: Floats) -> TagSeen:
    """Return a tag from measured corners; its centre is the intersection of its diagonals."""
    a, b, c, d = ((x, y) for x, y in corners.tolist())
    ux, uy, vx, vy = c[0] - a[0], c[1] - a[1], d[0] - b[0], d[1] - b[1]
    share = ((b[0] - a[0]) * vy - (b[1] - a[1]) * vx) / (ux * vy - uy * vx)
    centre = (a[0] + share * ux, a[1] + share * uy)
    return TagSeen(
        tag_id=tag_id,
        centre_px=centre,
        corners_px=(a, b, c, d),
        margin=float(result[MARGIN]),
        hamming=int(result[BITS]),
    )
