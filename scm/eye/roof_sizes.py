"""Detects roof tags of another size than in their car file, and reports the size that fits.

A sheet printed with "fit to page" is 3 to 7 % off. Such a tag still gives a pose
(`scm.eye.pose`); the sightings and the track carry the flag `roof_tag_size`, and the camera's
status names the tag until it fits or is out of view.
"""

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from scm.clock import NS_PER_S
from scm.eye.pose import SIZE_TOLERANCE, PoseEstimate
from scm.eye.track.sighting import ROOF_TAG_SIZE
from scm.scenery.bodies import CarBody
from scm.v2x.messages.eye_status import Complaint

FRAMES = 5
"""Number of agreeing sightings before a report: one frame may be blurred or half covered."""
MEMORY_NS = 10 * NS_PER_S  # of a tag of another size
MAX_RATIO_ERROR = 0.15
"""Larger size error above which an unknown tag gives no pose: it may lie on the floor, or belong to
another kind of car. Printing errors are smaller."""


@dataclass(slots=True, eq=False)
class _Roof:
    """One tag: its vehicle, body, and recent size ratios."""

    vehicle: str
    body: CarBody
    ratios: deque[float] = field(default_factory=lambda: deque(maxlen=FRAMES))
    seen_ns: int = 0
    reported: bool = False

    @property
    def ratio(self) -> float:
        """Observed size over the car file's; 1 while there are too few frames."""
        return float(np.median(self.ratios)) if len(self.ratios) == FRAMES else 1.0


class RoofSizes:
    """The sizes of the roof tags that one camera sees."""

    def __init__(self) -> None:
        self._roofs: dict[int, _Roof] = {}

    def see(
        self, t_ns: int, tag_id: int, vehicle: str, body: CarBody, found: PoseEstimate
    ) -> tuple[str, ...]:
        """Process a sighting; return its flags besides the camera's own."""
        roof = self._roofs.get(tag_id)
        if roof is None or (roof.vehicle, roof.body) != (vehicle, body):
            roof = self._roofs[tag_id] = _Roof(vehicle, body)
        if not found.is_refused:
            roof.ratios.append(found.size_ratio)
            roof.seen_ns = t_ns
        return (ROOF_TAG_SIZE,) if found.is_other_size else ()

    def complaints(self, t_ns: int, camera_height_m: float) -> tuple[Complaint, ...]:
        """Return a sentence for each recently seen tag of wrong size, by tag id."""
        self._roofs = {
            tag_id: one for tag_id, one in self._roofs.items() if t_ns - one.seen_ns <= MEMORY_NS
        }
        return tuple(
            Complaint(code=ROOF_TAG_SIZE, said=_sentence(tag_id, one, camera_height_m))
            for tag_id, one in sorted(self._roofs.items())
            if abs(one.ratio - 1.0) > SIZE_TOLERANCE
        )

    def news(self, t_ns: int, camera_height_m: float) -> tuple[str, ...]:
        """Return a sentence for each tag of wrong size that was not returned here before."""
        news = []
        for tag_id, one in sorted(self._roofs.items()):
            is_off = abs(one.ratio - 1.0) > SIZE_TOLERANCE and t_ns - one.seen_ns <= MEMORY_NS
            if is_off and not one.reported:
                news.append(_sentence(tag_id, one, camera_height_m))
            one.reported = is_off
        return tuple(news)


def is_on_a_roof(tag_id: int, vehicle: str, found: PoseEstimate) -> bool:
    """Return whether a sighting is of a car: a known one, or an unknown of about the right size."""
    if found.is_refused:
        return False
    return vehicle != f"tag-{tag_id}" or abs(found.size_ratio - 1.0) < MAX_RATIO_ERROR


def _sentence(tag_id: int, roof: _Roof, camera_height_m: float) -> str:
    """Return a sentence with a tag's observed size, and advice."""
    body, ratio = roof.body, roof.ratio
    height = body.tag_position[2]
    looks, wants = 1e3 * body.tag_size * ratio, 1e3 * body.tag_size
    true_height = camera_height_m - (camera_height_m - height) / ratio
    if roof.vehicle == f"tag-{tag_id}":
        whose = f"tag {tag_id} of no known car"
        file = f"a Nigel's is {wants:.1f} mm"
        advice = (
            "join its car, so that its own size is known; if it lies on the floor, list it in the "
            "file of `--tags`"
        )
    else:
        whose, file = f"tag {tag_id} of {roof.vehicle}", f"its car file has {wants:.1f} mm"
        advice = f"or set ips.tag_size_m = {looks / 1e3:.4f} in the car file"
        advice = f'print it at 100 %, not "fit to page", {advice}'
    return (
        f"{whose}: its black edge looks {looks:.1f} mm ({100.0 * (ratio - 1.0):+.1f} %), {file}: "
        f"{advice}; were the size right, the roof would be at {true_height:.2f} m, not "
        f"{height:.2f} m"
    )
