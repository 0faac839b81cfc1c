"""The Eye's watch over itself: what is wrong with a camera, in words, while it runs.

The map's tags lie still. Whatever they seem to do, the camera did: move (it was bumped), blur (its
focus drifted), be of another size (wrong tag, wrong height) or be elsewhere (another camera's
calibration). The picture tells the rest: black, frozen, of the wrong size, or none at all.

After a bump the anchor is told to believe the tags, and what its poses are worth from then on is
its own doubt: below `WORTH_M` the complaint is withdrawn and the new anchor is told of. One small
tag cannot tell a tilt from a shift, so with one tag it stays until the camera is located anew.
"""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from scm.arrays import Floats, Image
from scm.clock import NS_PER_MS, NS_PER_S
from scm.eye.anchor import Anchor
from scm.eye.camera import CameraModel
from scm.eye.sharpness import EdgeWidth, edge_width
from scm.records.city_map import MapTag
from scm.v2x.messages.eye_status import Complaint

SETTLED_FRAMES = 10
RECENT_FRAMES = 8
SHIFT_M, SHIFT_PX = 0.001, 0.15
TURN_RAD = math.radians(0.12)
WORTH_M = 0.0025
"""Standard deviation: errors of twice that, 5 mm, are the most that may pass unsaid."""
TOLD_NS = 10 * NS_PER_S
SIZE = 0.012
ELSEWHERE_M, ELSEWHERE_RAD = 0.15, math.radians(10.0)
BLURRED = 1.5
BLURRED_PX = 0.5
BLURRED_CELL = 0.9
"""An edge as wide as this part of a tag's cell is out of focus whatever it was before."""
DIM = 25.0
CELLS = 8
UNSEEN_NS = 1_500 * NS_PER_MS
FROZEN_NS = NS_PER_S
STALLED_NS = NS_PER_S // 2
STALLED_PERIODS = 5
BLACK, BLANK_STD = 12.0, 2.5
COARSE = 8
INFORMS = ("re_anchored",)
"""Codes that spoil no pose."""


@dataclass(slots=True, eq=False)
class Watched:
    """A tag of the map: where it was when the camera had settled, and how it looks of late."""

    settled: list[Floats] = field(default_factory=list)
    recent: deque[Floats] = field(default_factory=lambda: deque(maxlen=RECENT_FRAMES))
    widths: deque[EdgeWidth] = field(default_factory=lambda: deque(maxlen=RECENT_FRAMES))
    sharp_px: float | None = None
    moved_m: float = 0.0
    turned_rad: float = 0.0


class Watch:
    """The self check of one camera; it feeds the anchor, so that both see the same frames.

    Attributes:
        anchor: The camera as its map tags correct it.
    """

    def __init__(self, anchor: Anchor) -> None:
        self.anchor = anchor
        self._tags = {one.tag_id: Watched() for one in anchor.map_tags}
        self._said: dict[str, str] = {}
        self._frame_ns: int | None = None
        self._coarse: bytes = b""
        self._changed_ns = 0
        self._bump: str | None = None
        self._anchored_ns: int | None = None
        self._doubted: CameraModel | None = None
        self._doubt_m = 0.0

    def see(self, t_ns: int, grey: Image, corners: Mapping[int, Floats]) -> None:
        """Take a frame, (height, width), and the corners of the tags found in it, (4, 2) [px]."""
        self._frame_ns = t_ns
        self._said.clear()
        self._look(t_ns, grey)
        ours = {tag_id: found for tag_id, found in corners.items() if tag_id in self._tags}
        if "frame_size" in self._said:
            return
        moved = [tag_id for tag_id, found in ours.items() if self._moves(tag_id, found)]
        if moved:
            self._bumped(moved)
        self.anchor.see(ours, t_ns)
        for tag_id, found in ours.items():
            self._settle(tag_id, found)
            self._judge_blur(tag_id, grey, found)
        self._said.update(self.misplaced(ours))
        self._judge_bump(t_ns)
        self._judge_doubt()

    def complaints(self, now_ns: int) -> tuple[Complaint, ...]:
        """Return all that is wrong now, sorted by code."""
        said = dict(self._said)
        self._judge_age(now_ns, said)
        return tuple(Complaint(code=code, said=said[code]) for code in sorted(said))

    def flags(self, now_ns: int) -> tuple[str, ...]:
        """Return the codes of what spoils poses now; without any the camera is good."""
        codes = (one.code for one in self.complaints(now_ns))
        return tuple(code for code in codes if code not in INFORMS)

    def tags_seen(self, now_ns: int) -> dict[int, Floats]:
        """Return the corners of the map's tags, (4, 2) [px] by id, if any is seen these days."""
        late = self.anchor.age_ms(now_ns) * NS_PER_MS > UNSEEN_NS
        return {} if late or self.anchor.seen_ns is None else self.anchor.averaged()

    def _look(self, t_ns: int, grey: Image) -> None:
        camera = self.anchor.model.camera
        got, wanted = grey.shape[::-1], (camera.width_px, camera.height_px)
        if got != wanted:
            self._said["frame_size"] = (
                f"frames are {got[0]} x {got[1]} px, the calibration is for "
                f"{wanted[0]} x {wanted[1]} px"
            )
        coarse = grey[::COARSE, ::COARSE]
        same = coarse.tobytes()
        if same != self._coarse or camera.noise_sigma == 0.0:
            self._coarse, self._changed_ns = same, t_ns
        still_ns = t_ns - self._changed_ns
        if still_ns >= FROZEN_NS:
            self._said["frozen"] = (
                f"the picture has been exactly the same for {still_ns / NS_PER_S:.1f} s"
            )
        bright, std = float(coarse.mean()), float(coarse.std())
        if bright < BLACK:
            self._said["black"] = (
                f"the picture is black (mean grey {bright:.0f} of 255): lens cap on, or no light"
            )
        elif std < BLANK_STD:
            self._said["blank"] = (
                f"the picture shows nothing (grey {bright:.0f} of 255 everywhere): lens covered"
            )

    def _judge_age(self, now_ns: int, said: dict[str, str]) -> None:
        period_ns = NS_PER_S / self.anchor.model.camera.rate_hz
        if self._frame_ns is not None:
            late_ns = now_ns - self._frame_ns
            if late_ns > max(STALLED_NS, STALLED_PERIODS * period_ns):
                said["stalled"] = f"no frame for {late_ns / NS_PER_S:.1f} s: the camera stalls"
            unseen_ms = self.anchor.age_ms(now_ns)
            if unseen_ms * NS_PER_MS > UNSEEN_NS:
                names = ", ".join(str(tag_id) for tag_id in sorted(self._tags))
                said["map_tag_unseen"] = (
                    f"no map tag ({names}) seen for {unseen_ms / 1000.0:.1f} s: "
                    "whether the camera has moved cannot be told"
                )

    def _moves(self, tag_id: int, found: Floats) -> bool:
        """Return whether a tag is no longer where it was when the camera had settled."""
        watched = self._tags[tag_id]
        watched.recent.append(found)
        if len(watched.settled) < SETTLED_FRAMES:
            steady = not watched.settled or _moved(np.mean(watched.settled, 0), found)[0] < 1.0
            if not steady:
                watched.settled.clear()
            return not steady
        then = np.mean(watched.settled, axis=0)
        px_per_m = _side(then) / self._map_tag(tag_id).size_m
        shift_px, _ = _moved(then, found)
        _, turn = _moved(then, np.mean(watched.recent, axis=0))
        watched.moved_m, watched.turned_rad = shift_px / px_per_m, turn
        turned = abs(turn) > TURN_RAD and len(watched.recent) == RECENT_FRAMES
        return turned or shift_px > max(SHIFT_M * px_per_m, SHIFT_PX)

    def _bumped(self, moved: list[int]) -> None:
        tag_id = max(moved, key=lambda one: self._tags[one].moved_m)
        watched = self._tags[tag_id]
        if watched.settled or self._bump is None:
            self._bump = (
                f"bumped: map tag {tag_id} moved by {1e3 * watched.moved_m:.1f} mm and turned by "
                f"{math.degrees(watched.turned_rad):.2f} deg in the picture"
            )
        self.anchor.bumped()
        self._anchored_ns = None
        for one in self._tags.values():
            one.settled.clear()
            one.recent.clear()

    def _settle(self, tag_id: int, found: Floats) -> None:
        watched = self._tags[tag_id]
        if len(watched.settled) < SETTLED_FRAMES:
            watched.settled.append(found.copy())

    def _judge_bump(self, t_ns: int) -> None:
        if self._bump is None and self.anchor.is_knocked:
            self._bump = "bumped: the map tags are not where the calibration puts them"
        if self._bump is None:
            return
        worth = self.anchor.doubt_m()
        settled = any(len(one.settled) >= SETTLED_FRAMES for one in self._tags.values())
        anchored = f"re-anchored on the map tags, poses are good to {2e3 * worth:.1f} mm"
        if not settled or worth > WORTH_M:
            self._said["bumped"] = f"{self._bump}; {anchored}; locate the camera anew"
            return
        if self._anchored_ns is None:
            self._anchored_ns = t_ns
        if t_ns - self._anchored_ns > TOLD_NS:
            self._bump, self._anchored_ns = None, None
            return
        self._said["re_anchored"] = f"{self._bump}; {anchored}"

    def _judge_doubt(self) -> None:
        """Say when poses may be off by more than may pass unsaid, without anything having moved."""
        if self.anchor.model is not self._doubted:
            self._doubted, self._doubt_m = self.anchor.model, self.anchor.doubt_m()
        seen = self.anchor.seen_ns is not None
        if seen and self._bump is None and self._doubt_m > WORTH_M:
            self._said["unsure"] = (
                f"the camera's place is known so that poses are good to {2e3 * self._doubt_m:.1f} "
                "mm only: locate it with more tags, far apart"
            )

    def misplaced(self, ours: Mapping[int, Floats]) -> dict[str, str]:
        """Return by code what tags of another size, or elsewhere, than the calibration has say."""
        told = {}
        for tag_id, found in ours.items():
            tag = self._map_tag(tag_id)
            there = self.anchor.expected(tag, self.anchor.calibrated)
            ratio = _side(found) / _side(there)
            shift, turn = _moved(there, found)
            away = shift / _side(there) * tag.size_m
            if away > ELSEWHERE_M or abs(turn) > ELSEWHERE_RAD:
                told["calibration"] = (
                    f"map tag {tag_id} is {away:.2f} m and {math.degrees(turn):.0f} deg from where "
                    "the calibration puts it: is it another camera's?"
                )
            if abs(ratio - 1.0) > SIZE:
                height = self.anchor.calibrated.position[2]
                told["tag_size"] = (
                    f"map tag {tag_id} looks {100.0 * (ratio - 1.0):+.1f} % larger than it should: "
                    f"its edge is {1e3 * ratio * tag.size_m:.1f} mm instead of "
                    f"{1e3 * tag.size_m:.1f} mm, or the camera hangs at {height / ratio:.2f} m "
                    f"instead of {height:.2f} m"
                )
        return told

    def _judge_blur(self, tag_id: int, grey: Image, found: Floats) -> None:
        watched = self._tags[tag_id]
        watched.widths.append(edge_width(grey, found))
        width = float(np.median([one.px for one in watched.widths]))
        contrast = float(np.median([one.contrast for one in watched.widths]))
        if contrast < DIM:
            self._said["dim"] = (
                f"map tag {tag_id} is dim: {contrast:.0f} grey levels between black and white"
            )
        if watched.sharp_px is None and len(watched.widths) == RECENT_FRAMES:
            watched.sharp_px = width
        then = watched.sharp_px if watched.sharp_px is not None else width
        never = width > BLURRED_CELL * _side(found) / CELLS
        if never or width > max(BLURRED * then, then + BLURRED_PX):
            self._said["focus"] = (
                f"focus drifted: edges of map tag {tag_id} are {width:.1f} px wide, "
                f"{then:.1f} px at the start"
            )

    def _map_tag(self, tag_id: int) -> MapTag:
        return next(one for one in self.anchor.map_tags if one.tag_id == tag_id)


def _side(corners: Floats) -> float:
    """Return the mean length of the sides of a square, (4, 2) [px]."""
    return float(np.hypot(*(corners - np.roll(corners, 1, axis=0)).T).mean())


def _moved(then: Floats, now: Floats) -> tuple[float, float]:
    """Return how far [px] and by which turn [rad] a square moved, counter-clockwise on the map."""
    shift = now.mean(axis=0) - then.mean(axis=0)
    a, b = then - then.mean(axis=0), now - now.mean(axis=0)
    turn = math.atan2(float((b[:, 0] * a[:, 1] - b[:, 1] * a[:, 0]).sum()), float((a * b).sum()))
    return float(np.hypot(*shift)), turn
