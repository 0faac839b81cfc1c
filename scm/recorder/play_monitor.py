"""Supervises a drive that is played in a running city, since a written drive is open loop.

The car is stopped first, the predicted path must fit on the floor from there, and the drive ends
when the car nears the floor's edge, hits something, no longer obeys, or somebody requests it.
"""

import threading
from collections.abc import Sequence
from dataclasses import dataclass, field

from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.maps.ways import Span, Way, is_inside, laid_from, leaves
from scm.recorder.driven import CarMessages, Report

AT_REST_M = 0.002  # moved in REST_NS
REST_NS = NS_PER_S // 5
MAX_DISOBEYING_NS = NS_PER_S // 2  # in which a car's reports must show the command


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayMonitor:
    """The limits of a drive.

    Attributes:
        floor: Range of x and y [m]; None: unlimited.
        margin_m: Least distance of the rear axle from the floor's edges.
        way: Predicted path, relative to its first pose. Empty: unknown.
        stop_requested: Set to end the drive.
    """

    floor: tuple[Span, Span] | None = None
    margin_m: float = 0.2
    way: Way = ()
    stop_requested: threading.Event = field(default_factory=threading.Event)

    def is_at_rest(self, reports: Sequence[Report]) -> bool:
        """Return whether a car has stood still for a moment."""
        if not reports:
            return False
        last = reports[-1]
        since = [r for r in reports if r.t_ns >= last.t_ns - REST_NS]
        moved = max(abs(r.x_m - last.x_m) + abs(r.y_m - last.y_m) for r in since)
        return last.t_ns - since[0].t_ns >= REST_NS // 2 and moved < AT_REST_M

    def refuses(self, reports: Sequence[Report]) -> str:
        """Return why a drive must not begin where the car is; empty: it may."""
        if not reports:
            return "the city tells nothing of where it is"
        if self.floor is None:
            return ""
        start = _pose(reports[-1])
        far = leaves(laid_from(self.way, start) or [start], *self.floor, self.margin_m)
        if far is None:
            return ""
        return (
            f"from where it stands, x {start.x:.2f} m, y {start.y:.2f} m, the drive leads to "
            f"x {far.x:.2f} m, y {far.y:.2f} m, off the floor; expected room for all of it"
        )

    def ends(self, messages: CarMessages, began_ns: int) -> str:
        """Return why a drive that began then must end now; empty: it continues."""
        if self.stop_requested.is_set():
            return "stopped on request"
        if any(t_ns >= began_ns for t_ns in messages.hit_ns):
            return "stopped: the car hit something"
        report = messages.reports[-1]
        if self.floor is not None and not is_inside(_pose(report), *self.floor, self.margin_m / 2):
            return f"stopped at the edge of the floor, x {report.x_m:.2f} m, y {report.y_m:.2f} m"
        since = [r for r in messages.reports if r.t_ns >= report.t_ns - MAX_DISOBEYING_NS]
        whole = since[0].t_ns >= began_ns and report.t_ns - since[0].t_ns >= 0.9 * MAX_DISOBEYING_NS
        if whole and all(r.mode != "drive" for r in since):
            return "stopped: the car does not obey; is the city stopped, or its link lost?"
        return ""


def _pose(report: Report) -> Pose2:
    return Pose2(report.x_m, report.y_m, report.yaw_rad)
