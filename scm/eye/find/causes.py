"""Finds out why tags are missing: a mirrored picture, or prints that are not our tag36h11.

Each guess is tried on a whole frame, for frames with missing tags: all of them at once on a single
picture (`cause_of`), one at a time and rarely in a stream (`Causes`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.clock import NS_PER_S
from scm.eye.detect import Settings, look
from scm.v2x.messages.eye_status import Complaint

MISSING_NS = 2 * NS_PER_S
"""How long tags are missing before the first guess is tried."""
NEXT_CAUSE_NS = NS_PER_S // 2  # between two causes of one search
AGAIN_NS, SURE_NS = 60 * NS_PER_S, 10 * NS_PER_S
"""Pause after all guesses failed, and after one was right."""
LONGEST_PX = 1280
"""Larger frames are downscaled: guesses are about large tags."""
COARSE_PX = 800
"""In larger frames squares are sought at half the resolution, which is fast."""
MIN_SIDE_PX = 12.0  # of a tag that another family could have
FAMILIES = {
    "tag25h9": cv2.aruco.DICT_APRILTAG_25h9,
    "tag36h10": cv2.aruco.DICT_APRILTAG_36h10,
    "tag16h5": cv2.aruco.DICT_APRILTAG_16h5,
    "ArUco 4x4": cv2.aruco.DICT_4X4_100,
    "ArUco 5x5": cv2.aruco.DICT_5X5_250,
    "ArUco 6x6": cv2.aruco.DICT_6X6_250,
    "ArUco 7x7": cv2.aruco.DICT_7X7_250,
    "ArUco original": cv2.aruco.DICT_ARUCO_ORIGINAL,
    "ArUco MIP 36h12": cv2.aruco.DICT_ARUCO_MIP_36h12,
}
REPRINT = "print tag36h11, as `scm eye print` does"
_EXACT = Settings(max_hamming=0, min_margin=30.0)


@dataclass(frozen=True, slots=True)
class _Guess:
    """One guess: its code, a function that finds tags if it is right, and its sentence."""

    code: str
    find: Callable[[Image], Sequence[int]]
    text: str


def cause_of(grey: Image) -> Complaint | None:
    """Return why no tag36h11 is found in a grey picture, (height, width); None: unknown."""
    small = _smaller(grey)
    return next((text for guess in _guesses() if (text := _tried(guess, small))), None)


class Causes:
    """Tries the guesses one after the other, while tags are missing in a camera's frames."""

    def __init__(self) -> None:
        self._missing_ns: int | None = None
        self._due_ns = 0
        self._next = 0
        self._found: tuple[int, Complaint] | None = None
        self._reported: set[str] = set()

    def see(self, t_ns: int, grey: Image, *, missing: bool) -> None:
        """Process a frame, (height, width), in which tags are missing, or not."""
        if not missing:
            self._missing_ns, self._found, self._next = None, None, 0
            return
        if self._missing_ns is None or t_ns < self._missing_ns:
            self._missing_ns, self._due_ns = t_ns, t_ns + MISSING_NS
        if t_ns < self._due_ns:
            return
        number = self._next if self._found is None else self._found[0]
        found = _tried(_guesses()[number], _smaller(grey))
        self._next = (number + 1) % len(_guesses())
        self._found = (number, found) if found else None
        self._due_ns = t_ns + (SURE_NS if found else NEXT_CAUSE_NS if self._next else AGAIN_NS)

    def complaints(self) -> tuple[Complaint, ...]:
        """Return the cause that was found last, if one was."""
        return () if self._found is None else (self._found[1],)

    def news(self) -> tuple[Complaint, ...]:
        """Return the cause if it was not returned here before."""
        found = self.complaints()
        codes = {one.code for one in found}
        new = tuple(one for one in found if one.code not in self._reported)
        self._reported = codes
        return new


@cache
def _guesses() -> tuple[_Guess, ...]:
    mirrored = "the picture is mirrored: switch off mirroring in the camera or its driver"
    inverted = "tags are inverted, white on black: {reprint}, or switch off the camera's negative"
    wide = "tags have a border two cells wide (OpenCV's borderBits=2): {reprint}, one cell wide"
    return (
        _Guess("mirrored", lambda grey: _ours(cv2.flip(grey, 1)), mirrored),
        _Guess("inverted", lambda grey: _ours(cv2.bitwise_not(grey)), inverted),
        _Guess(
            "inverted", lambda grey: _ours(cv2.flip(cv2.bitwise_not(grey), 1)),
            "the picture is mirrored and its tags are inverted: switch off both in the camera",
        ),
        _Guess("wide_border", _finder(cv2.aruco.DICT_APRILTAG_36h11, 2), wide),
        *(
            _Guess(
                "other_family", _finder(number),
                f"tags are of the family {family}, not of tag36h11: {{reprint}}",
            )
            for family, number in FAMILIES.items()
        ),
    )  # fmt: skip


def _tried(guess: _Guess, grey: Image) -> Complaint | None:
    ids = sorted(guess.find(grey))
    if not ids:
        return None
    shown = ", ".join(str(one) for one in ids[:8])
    text = guess.text.format(reprint=REPRINT)
    return Complaint(code=guess.code, said=f"{text} (seen so: {shown})")


def _smaller(grey: Image) -> Image:
    times = max(grey.shape) / LONGEST_PX
    if times <= 1.0:
        return grey
    size = round(grey.shape[1] / times), round(grey.shape[0] / times)
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _ours(grey: object) -> list[int]:
    frame = np.asarray(grey, dtype=np.uint8)
    decimate = 2.0 if max(frame.shape) > COARSE_PX else 1.0
    return [tag.tag_id for tag in look(frame, _EXACT, decimate, 0.0)]


def _finder(dictionary: int, border_cells: int = 1) -> Callable[[Image], Sequence[int]]:
    """Return a function that finds markers of an OpenCV dictionary, without bit errors."""
    family = cv2.aruco.getPredefinedDictionary(dictionary)

    def find(grey: Image) -> list[int]:
        settings = cv2.aruco.DetectorParameters()
        settings.markerBorderBits = border_cells
        settings.errorCorrectionRate = 0.0
        settings.maxErroneousBitsInBorderRate = 0.04
        settings.minMarkerPerimeterRate = 4.0 * MIN_SIDE_PX / max(grey.shape)
        corners, ids, _ = cv2.aruco.ArucoDetector(family, settings).detectMarkers(grey)
        numbers = np.ravel(ids) if corners else ()  # None if there are no corners
        return [
            int(one) for one, square in zip(numbers, corners, strict=True)
            if _side(np.asarray(square, dtype=np.float64).reshape(4, 2)) >= MIN_SIDE_PX
        ]  # fmt: skip

    return find


def _side(square: Floats) -> float:
    return float(np.hypot(*(square - np.roll(square, 1, axis=0)).T).min())
