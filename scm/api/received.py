"""What the view has received, by subject: the world, signals, traffic, autonomy, the Eye.

None of these is safe between threads by itself: `scm.api.view.CityView` holds the lock.
"""

from collections import Counter, deque
from collections.abc import Iterator

from scm.api.picture import Held, SeenPose, TagSighting
from scm.api.signal_history import SignalHistory
from scm.clock import NS_PER_MS, NS_PER_S
from scm.eye.accuracy import EyeAccuracyPart
from scm.runtime.part import Subscription
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_status import EyeStatus
from scm.v2x.messages.eye_tags import EyeTags
from scm.v2x.messages.misbehaviour_report import MisbehaviourReport
from scm.v2x.messages.misbehaviour_scores import MisbehaviourScores
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.neighbour_status import NeighbourStatus
from scm.v2x.messages.signal_site import SignalSite
from scm.v2x.messages.signal_status import SignalStatus
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.traffic_counts import TrafficCounts
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.violation import Violation
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import WorldSnapshot

MAX_FRAMES = 4  # per camera
MAX_TAG_LISTS = 8  # per camera
MAX_VIOLATIONS = 500
MAX_REPORTS = 500
STOP_EXPIRES_NS = (
    3 * NS_PER_S
)  # of received snapshots: the world repeats an engaged stop each second
MAX_GAP_NS = 200 * NS_PER_MS  # between two snapshots; a longer one counts no further


class ReceivedWorld:
    """The world's newest snapshot, the stop and the trips."""

    def __init__(self) -> None:
        self.snapshot: Held[WorldSnapshot] | None = None
        self.definition: WorldDefinition | None = None
        self.stop: CityStop | None = None
        self.trips: dict[str, Held[Trip]] = {}
        self._without_stop_ns = 0

    def receive_snapshot(self, snapshot: WorldSnapshot, t_ns: int) -> None:
        """Store a snapshot; a stop that is no longer repeated ends."""
        if self.snapshot is not None:
            passed_ns = t_ns - self.snapshot.arrived_ns
            self._without_stop_ns += max(0, min(passed_ns, MAX_GAP_NS))
        if self._without_stop_ns > STOP_EXPIRES_NS:
            self.stop = None  # its release was missed: an engaged stop is repeated
        self.snapshot = Held(snapshot, t_ns)

    def receive_definition(self, definition: WorldDefinition, _t_ns: int) -> None:
        """Store the map."""
        self.definition = definition

    def receive_stop(self, stop: CityStop, _t_ns: int) -> None:
        """Store the city-wide stop."""
        self.stop, self._without_stop_ns = stop, 0

    def receive_trip(self, trip: Trip, t_ns: int) -> None:
        """Store a car's trip."""
        self.trips[trip.vehicle] = Held(trip, t_ns)

    def forget(self, oldest_ns: int) -> None:
        """Drop trips that arrived before a time."""
        for name in [n for n, trip in self.trips.items() if trip.arrived_ns < oldest_ns]:
            del self.trips[name]


class ReceivedSignals:
    """The newest messages of each junction, and what its signals showed."""

    def __init__(self) -> None:
        self.spats: dict[str, Held[Spat]] = {}
        self.monitors: dict[str, Held[MonitorStatus]] = {}
        self.sites: dict[str, SignalSite] = {}
        self.statuses: dict[str, Held[SignalStatus]] = {}
        self.history = SignalHistory()

    def receive_spat(self, spat: Spat, t_ns: int) -> None:
        """Store signal phase and timing."""
        self.spats[spat.junction] = Held(spat, t_ns)
        self.history.receive(spat)

    def receive_monitor(self, status: MonitorStatus, t_ns: int) -> None:
        """Store the status of a junction's monitor."""
        self.monitors[status.junction] = Held(status, t_ns)
        self.history.receive_monitor(status)

    def receive_site(self, site: SignalSite, _t_ns: int) -> None:
        """Store a junction's signal equipment."""
        self.sites[site.junction] = site

    def receive_status(self, status: SignalStatus, t_ns: int) -> None:
        """Store what runs at a junction."""
        self.statuses[status.junction] = Held(status, t_ns)


class ReceivedTraffic:
    """Counts, violations, and scores and reports of misbehaviour."""

    def __init__(self) -> None:
        self.counts: Held[TrafficCounts] | None = None
        self.violations: deque[Violation] = deque(maxlen=MAX_VIOLATIONS)
        self.scores: Held[MisbehaviourScores] | None = None
        self.reports: dict[str, MisbehaviourReport] = {}

    def receive_counts(self, counts: TrafficCounts, t_ns: int) -> None:
        """Store the observer's counts."""
        self.counts = Held(counts, t_ns)

    def receive_violation(self, violation: Violation, _t_ns: int) -> None:
        """Store a violation."""
        self.violations.append(violation)

    def receive_scores(self, scores: MisbehaviourScores, t_ns: int) -> None:
        """Store the scores of all stations."""
        self.scores = Held(scores, t_ns)

    def receive_report(self, report: MisbehaviourReport, _t_ns: int) -> None:
        """Store the newest report against a station."""
        self.reports.pop(report.suspect, None)
        self.reports[report.suspect] = report
        if len(self.reports) > MAX_REPORTS:
            self.reports.pop(next(iter(self.reports)))


class ReceivedNeighbours:
    """The newest status of each neighbouring city."""

    def __init__(self) -> None:
        self.statuses: dict[str, Held[NeighbourStatus]] = {}

    def receive(self, status: NeighbourStatus, t_ns: int) -> None:
        """Store how a neighbour is."""
        self.statuses[status.neighbour] = Held(status, t_ns)


class ReceivedAutonomy:
    """The newest status and plan of each car that parks itself."""

    def __init__(self) -> None:
        self.statuses: dict[str, Held[AutonomyStatus]] = {}
        self.plans: dict[str, Held[AutonomyPlan]] = {}

    def receive_status(self, status: AutonomyStatus, t_ns: int) -> None:
        """Store what a car is doing."""
        self.statuses[status.vehicle] = Held(status, t_ns)

    def receive_plan(self, plan: AutonomyPlan, t_ns: int) -> None:
        """Store how a car means to drive."""
        self.plans[plan.vehicle] = Held(plan, t_ns)

    def forget(self, oldest_ns: int) -> None:
        """Drop what arrived before a time."""
        for name in [n for n, held in self.statuses.items() if held.arrived_ns < oldest_ns]:
            del self.statuses[name]
        for name in [n for n, held in self.plans.items() if held.arrived_ns < oldest_ns]:
            del self.plans[name]


class ReceivedTwins:
    """The newest status of each car that the twin part watches."""

    def __init__(self) -> None:
        self.statuses: dict[str, Held[TwinStatus]] = {}

    def receive(self, status: TwinStatus, t_ns: int) -> None:
        """Store what is known of a car."""
        self.statuses[status.vehicle] = Held(status, t_ns)

    def forget(self, oldest_ns: int) -> None:
        """Drop what arrived before a time."""
        for name in [n for n, held in self.statuses.items() if held.arrived_ns < oldest_ns]:
            del self.statuses[name]


class ReceivedEye:
    """Frames, tags and poses of the overhead cameras, and their residuals against the world."""

    def __init__(self, accuracy: EyeAccuracyPart) -> None:
        self._accuracy = accuracy
        self.frames: dict[str, deque[Held[EyeFrame]]] = {}
        self.tags: dict[str, deque[Held[EyeTags]]] = {}
        self.tags_seen: dict[tuple[str, int], TagSighting] = {}
        self.statuses: dict[str, Held[EyeStatus]] = {}
        self.poses: dict[tuple[str, str], SeenPose] = {}

    def receive_frame(self, frame: EyeFrame, t_ns: int) -> None:
        """Store a frame."""
        self.frames.setdefault(frame.camera, deque(maxlen=MAX_FRAMES)).append(Held(frame, t_ns))

    def receive_tags(self, tags: EyeTags, t_ns: int) -> None:
        """Store the tags of a frame."""
        self.tags.setdefault(tags.camera, deque(maxlen=MAX_TAG_LISTS)).append(Held(tags, t_ns))
        for tag in tags.tags:
            self.tags_seen[tags.camera, tag.tag_id] = TagSighting(tag, tags.t_ns, t_ns)

    def receive_status(self, status: EyeStatus, t_ns: int) -> None:
        """Store the status of a camera."""
        self.statuses[status.camera] = Held(status, t_ns)

    def receive_pose(self, pose: EyePose, t_ns: int) -> None:
        """Store a pose with its residual, where the truth of that time is known."""
        residual = self._accuracy.newest(pose.camera, pose.vehicle)
        self.poses[pose.camera, pose.vehicle] = SeenPose(Held(pose, t_ns), residual)

    def forget(self, oldest_ns: int) -> None:
        """Drop poses and tags that arrived before a time."""
        for key in [k for k, seen in self.poses.items() if seen.held.arrived_ns < oldest_ns]:
            del self.poses[key]
        for tag in [k for k, one in self.tags_seen.items() if one.arrived_ns < oldest_ns]:
            del self.tags_seen[tag]


class CameraWatch:
    """Who watches which camera of which car, and its newest frame."""

    def __init__(self) -> None:
        self._watched: Counter[tuple[str, str]] = Counter()
        self._frames: dict[tuple[str, str], Held[CameraFrame]] = {}

    def watch(self, vehicle: str, camera: str, more: int) -> None:
        """Count `more` watchers of a camera; without any its frame is dropped."""
        which = (vehicle, camera)
        self._watched[which] += more
        if self._watched[which] <= 0:
            del self._watched[which]
            self._frames.pop(which, None)

    def receive(self, frame: CameraFrame, t_ns: int) -> None:
        """Store a frame of a watched camera."""
        which = (frame.vehicle, frame.camera)
        if which in self._watched:
            self._frames[which] = Held(frame, t_ns)

    def newest(self, vehicle: str, camera: str) -> Held[CameraFrame] | None:
        """Return the newest frame of a watched camera; None if there is none yet."""
        return self._frames.get((vehicle, camera))

    def of(self, vehicle: str) -> tuple[str, ...]:
        """Return the watched cameras of a car."""
        return tuple(sorted(camera for name, camera in self._watched if name == vehicle))

    def subscriptions(self) -> Iterator[Subscription]:
        """Yield the subscriptions for those who watch now."""
        return (
            Subscription(CameraFrame, {"vehicle": vehicle, "camera": camera})
            for vehicle, camera in self._watched
        )
