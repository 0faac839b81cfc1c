"""Monitors a camera while it runs, and reports in words what is wrong with it.

The map's tags do not move. Any apparent change is the camera's: it moved (bumped), its focus
drifted (blurred tag), or its calibration is wrong (a tag of another size or elsewhere). The picture
shows the rest: black, frozen, of the wrong size, or missing.

After a bump the extrinsics are estimated from the tags, and their covariance shows how accurate
poses are from then on: below `MAX_STD_M` the fault is withdrawn and the new estimate reported.
One small tag cannot separate a tilt from a shift, so with one tag the fault remains until the
camera is located again.
"""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from scm.arrays import Floats, Image
from scm.clock import NS_PER_MS, NS_PER_S
from scm.eye.camera import CameraModel
from scm.eye.extrinsics import ExtrinsicsEstimator
from scm.eye.sharpness import TAG_CELLS, EdgeWidth, corner_std_px, edge_width
from scm.records.city_map import MapTag
from scm.v2x.messages.eye_status import Complaint

REFERENCE_FRAMES = 10  # averaged for the place of a tag
RECENT_FRAMES = 8  # averaged for its place now
SHIFT_M, SHIFT_PX = 0.001, 0.15
TURN_RAD = math.radians(0.12)
MAX_STD_M = 0.0025
"""Maximum standard deviation without a fault: errors up to twice that, 5 mm."""
REPORT_AGAIN_NS = 10 * NS_PER_S
SIZE_TOLERANCE = 0.012
ELSEWHERE_M, ELSEWHERE_RAD = 0.15, math.radians(10.0)
BLUR_RATIO = 1.5  # edge width over the reference that counts as blurred
MIN_BLUR_PX = 0.5  # and by how much it must be wider
BLURRED_CELL = 0.9
"""An edge wider than this part of a tag's cell is out of focus in any case."""
MIN_CONTRAST = 25.0  # grey levels; less and edges are not measured
MAX_UNSEEN_NS = 1_500 * NS_PER_MS  # without any tag the camera is reported
FROZEN_NS = NS_PER_S
MAX_FRAME_GAP_NS = NS_PER_S // 2  # without a frame the camera is reported
MAX_GAP_PERIODS = 5  # or so many of its periods, if longer
BLACK, BLANK_STD = 12.0, 2.5
SAMPLE_STEP_PX = 8  # every eighth pixel is enough for brightness
INFO_CODES = ("re_anchored",)
"""Codes that do not affect poses."""


@dataclass(slots=True, eq=False)
class MonitoredTag:
    """A tag of the map: its corners after the start, and its recent appearance."""

    reference: list[Floats] = field(default_factory=list)
    recent: deque[Floats] = field(default_factory=lambda: deque(maxlen=RECENT_FRAMES))
    widths: deque[EdgeWidth] = field(default_factory=lambda: deque(maxlen=RECENT_FRAMES))
    sharp_px: float | None = None
    moved_m: float = 0.0
    turned_rad: float = 0.0

    def edge_px(self) -> float:
        """Return the usual width of its edges of late."""
        return float(np.median([one.px for one in self.widths]))

    def contrast(self) -> float:
        """Return its usual step from black to white of late [grey levels]."""
        return float(np.median([one.contrast for one in self.widths]))


class CameraMonitor:
    """Monitors one camera; it also feeds the extrinsics estimator with the same frames.

    Attributes:
        estimator: Of the camera's extrinsics, from its map tags.
    """

    def __init__(self, estimator: ExtrinsicsEstimator) -> None:
        self.estimator = estimator
        self._tags = {one.tag_id: MonitoredTag() for one in estimator.map_tags}
        self._complaints: dict[str, str] = {}
        self._frame_ns: int | None = None
        self._sample: bytes = b""
        self._changed_ns = 0
        self._bump: str | None = None
        self._corrected_ns: int | None = None
        self._assessed: CameraModel | None = None
        self._std_m = 0.0

    def see(self, t_ns: int, grey: Image, corners: Mapping[int, Floats]) -> None:
        """Process a frame, (height, width), and the corners of its tags, (4, 2) [px]."""
        self._frame_ns = t_ns
        self._complaints.clear()
        self._look(t_ns, grey)
        ours = {tag_id: found for tag_id, found in corners.items() if tag_id in self._tags}
        if "frame_size" in self._complaints:
            return
        moved = [tag_id for tag_id, found in ours.items() if self._moves(tag_id, found)]
        if moved:
            self._bumped(moved)
        for tag_id, found in ours.items():
            self._tags[tag_id].widths.append(edge_width(grey, found))
        stds = {
            tag_id: corner_std_px(self._tags[tag_id].edge_px(), _side(found))
            for tag_id, found in ours.items()
            if self._tags[tag_id].contrast() >= MIN_CONTRAST
        }
        self.estimator.see(ours, t_ns, stds)
        for tag_id, found in ours.items():
            self._collect_reference(tag_id, found)
            self._check_blur(tag_id, found)
        self._complaints.update(self.misplaced(ours))
        self._check_bump(t_ns)
        self._check_accuracy()

    def complaints(self, now_ns: int) -> tuple[Complaint, ...]:
        """Return all that is wrong now, sorted by code."""
        complaints = dict(self._complaints)
        self._check_age(now_ns, complaints)
        return tuple(Complaint(code=code, said=complaints[code]) for code in sorted(complaints))

    def flags(self, now_ns: int) -> tuple[str, ...]:
        """Return the codes of faults that affect poses; none if the camera is good."""
        codes = (one.code for one in self.complaints(now_ns))
        return tuple(code for code in codes if code not in INFO_CODES)

    def tags_seen(self, now_ns: int) -> dict[int, Floats]:
        """Return the recent corners of the map's tags, (4, 2) [px] by id; none if unseen."""
        late = self.estimator.age_ms(now_ns) * NS_PER_MS > MAX_UNSEEN_NS
        return {} if late or self.estimator.seen_ns is None else self.estimator.averaged()

    def _look(self, t_ns: int, grey: Image) -> None:
        camera = self.estimator.model.camera
        got, wanted = grey.shape[::-1], (camera.width_px, camera.height_px)
        if got != wanted:
            self._complaints["frame_size"] = (
                f"frames are {got[0]} x {got[1]} px, the calibration is for "
                f"{wanted[0]} x {wanted[1]} px"
            )
        sample = grey[::SAMPLE_STEP_PX, ::SAMPLE_STEP_PX]
        same = sample.tobytes()
        if same != self._sample or camera.noise_sigma == 0.0:
            self._sample, self._changed_ns = same, t_ns
        still_ns = t_ns - self._changed_ns
        if still_ns >= FROZEN_NS:
            self._complaints["frozen"] = (
                f"the picture has been exactly the same for {still_ns / NS_PER_S:.1f} s"
            )
        bright, std = float(sample.mean()), float(sample.std())
        if bright < BLACK:
            self._complaints["black"] = (
                f"the picture is black (mean grey {bright:.0f} of 255): lens cap on, or no light"
            )
        elif std < BLANK_STD:
            self._complaints["blank"] = (
                f"the picture shows nothing (grey {bright:.0f} of 255 everywhere): lens covered"
            )

    def _check_age(self, now_ns: int, complaints: dict[str, str]) -> None:
        period_ns = NS_PER_S / self.estimator.model.camera.rate_hz
        if self._frame_ns is not None:
            late_ns = now_ns - self._frame_ns
            if late_ns > max(MAX_FRAME_GAP_NS, MAX_GAP_PERIODS * period_ns):
                complaints["stalled"] = (
                    f"no frame for {late_ns / NS_PER_S:.1f} s: the camera stalls"
                )
            unseen_ms = self.estimator.age_ms(now_ns)
            if unseen_ms * NS_PER_MS > MAX_UNSEEN_NS:
                names = ", ".join(str(tag_id) for tag_id in sorted(self._tags))
                complaints["map_tag_unseen"] = (
                    f"no map tag ({names}) seen for {unseen_ms / 1000.0:.1f} s: "
                    "a movement of the camera cannot be detected"
                )

    def _moves(self, tag_id: int, found: Floats) -> bool:
        """Return whether a tag has moved from its reference corners."""
        tag_state = self._tags[tag_id]
        tag_state.recent.append(found)
        if len(tag_state.reference) < REFERENCE_FRAMES:
            steady = (
                not tag_state.reference or _moved(np.mean(tag_state.reference, 0), found)[0] < 1.0
            )
            if not steady:
                tag_state.reference.clear()
            return not steady
        then = np.mean(tag_state.reference, axis=0)
        px_per_m = _side(then) / self._map_tag(tag_id).size_m
        shift_px, _ = _moved(then, found)
        _, turn = _moved(then, np.mean(tag_state.recent, axis=0))
        tag_state.moved_m, tag_state.turned_rad = shift_px / px_per_m, turn
        turned = abs(turn) > TURN_RAD and len(tag_state.recent) == RECENT_FRAMES
        return turned or shift_px > max(SHIFT_M * px_per_m, SHIFT_PX)

    def _bumped(self, moved: list[int]) -> None:
        tag_id = max(moved, key=lambda one: self._tags[one].moved_m)
        tag_state = self._tags[tag_id]
        if tag_state.reference or self._bump is None:
            self._bump = (
                f"bumped: map tag {tag_id} moved by {1e3 * tag_state.moved_m:.1f} mm and turned by "
                f"{math.degrees(tag_state.turned_rad):.2f} deg in the picture"
            )
        self.estimator.bumped()
        self._corrected_ns = None
        for one in self._tags.values():
            one.reference.clear()
            one.recent.clear()

    def _collect_reference(self, tag_id: int, found: Floats) -> None:
        tag_state = self._tags[tag_id]
        if len(tag_state.reference) < REFERENCE_FRAMES:
            tag_state.reference.append(found.copy())

    def _check_bump(self, t_ns: int) -> None:
        if self._bump is None and self.estimator.is_knocked:
            self._bump = "bumped: the map tags are not where the calibration puts them"
        if self._bump is None:
            return
        std_m = self.estimator.max_position_std_m()
        has_reference = any(len(one.reference) >= REFERENCE_FRAMES for one in self._tags.values())
        corrected = f"realigned to the map tags, poses are accurate to {2e3 * std_m:.1f} mm"
        if not has_reference or std_m > MAX_STD_M:
            self._complaints["bumped"] = f"{self._bump}; {corrected}; locate the camera again"
            return
        if self._corrected_ns is None:
            self._corrected_ns = t_ns
        if t_ns - self._corrected_ns > REPORT_AGAIN_NS:
            self._bump, self._corrected_ns = None, None
            return
        self._complaints["re_anchored"] = f"{self._bump}; {corrected}"

    def _check_accuracy(self) -> None:
        """Report when poses may be less accurate than accepted, without any movement."""
        if self.estimator.model is not self._assessed:
            self._assessed, self._std_m = self.estimator.model, self.estimator.max_position_std_m()
        seen = self.estimator.seen_ns is not None
        if seen and self._bump is None and self._std_m > MAX_STD_M:
            self._complaints["unsure"] = (
                f"the camera's place is uncertain: poses are accurate to {2e3 * self._std_m:.1f} "
                "mm only: locate it with more tags, far apart"
            )

    def misplaced(self, ours: Mapping[int, Floats]) -> dict[str, str]:
        """Return faults, by code, of tags of another size or place than calibrated."""
        found_by_code = {}
        for tag_id, found in ours.items():
            tag = self._map_tag(tag_id)
            there = self.estimator.expected(tag, self.estimator.calibrated)
            ratio = _side(found) / _side(there)
            shift, turn = _moved(there, found)
            away = shift / _side(there) * tag.size_m
            if away > ELSEWHERE_M or abs(turn) > ELSEWHERE_RAD:
                found_by_code["calibration"] = (
                    f"map tag {tag_id} is {away:.2f} m and {math.degrees(turn):.0f} deg from where "
                    "the calibration puts it: is it another camera's?"
                )
            if abs(ratio - 1.0) > SIZE_TOLERANCE:
                height = self.estimator.calibrated.position[2]
                found_by_code["tag_size"] = (
                    f"map tag {tag_id} looks {100.0 * (ratio - 1.0):+.1f} % larger than it should: "
                    f"its edge is {1e3 * ratio * tag.size_m:.1f} mm instead of "
                    f"{1e3 * tag.size_m:.1f} mm, or the camera hangs at {height / ratio:.2f} m "
                    f"instead of {height:.2f} m"
                )
        return found_by_code

    def _check_blur(self, tag_id: int, found: Floats) -> None:
        tag_state = self._tags[tag_id]
        width = tag_state.edge_px()
        contrast = tag_state.contrast()
        if contrast < MIN_CONTRAST:
            self._complaints["dim"] = (
                f"map tag {tag_id} is dim: {contrast:.0f} grey levels between black and white"
            )
        if tag_state.sharp_px is None and len(tag_state.widths) == RECENT_FRAMES:
            tag_state.sharp_px = width
        then = tag_state.sharp_px if tag_state.sharp_px is not None else width
        never = width > BLURRED_CELL * _side(found) / TAG_CELLS
        if never or width > max(BLUR_RATIO * then, then + MIN_BLUR_PX):
            self._complaints["focus"] = (
                f"focus drifted: edges of map tag {tag_id} are {width:.1f} px wide, "
                f"{then:.1f} px at the start"
            )

    def _map_tag(self, tag_id: int) -> MapTag:
        return next(one for one in self.estimator.map_tags if one.tag_id == tag_id)


def _side(corners: Floats) -> float:
    """Return the mean length of the sides of a square, (4, 2) [px]."""
    return float(np.hypot(*(corners - np.roll(corners, 1, axis=0)).T).mean())


def _moved(then: Floats, now: Floats) -> tuple[float, float]:
    """Return shift [px] and rotation [rad, counter-clockwise on the map] of a square."""
    shift = now.mean(axis=0) - then.mean(axis=0)
    a, b = then - then.mean(axis=0), now - now.mean(axis=0)
    turn = math.atan2(float((b[:, 0] * a[:, 1] - b[:, 1] * a[:, 0]).sum()), float((a * b).sum()))
    return float(np.hypot(*shift)), turn
