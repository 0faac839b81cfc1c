"""The view: a part that only hears, and keeps the newest of everything a person wants to see.

`step` runs on the runner's thread, everything else is called by the web's. Pictures of cars'
cameras, their LIDARs' scans and their own reports are heard only while somebody watches them: they
are made for whoever hears them.
"""

import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from scm.api.close_up import CloseUps
from scm.api.event_log import EventLog
from scm.api.eye_tracks import TrackWatch
from scm.api.picture import Held, Picture, SeenPose, TagSighting
from scm.api.scan_watch import ScanWatch
from scm.api.signal_history import SignalHistory
from scm.api.stations import StationTable
from scm.clock import NS_PER_MS, NS_PER_S
from scm.disturbances import Disturbances
from scm.eye.accuracy import EyeAccuracyPart
from scm.geometry import Pose2
from scm.records.events import LoggedEvent
from scm.records.eye import ResidualSample, TrackRow
from scm.records.signal_history import ForecastScore, History, Verdict
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.message import Message
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_status import EyeStatus
from scm.v2x.messages.eye_tags import EyeTags
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.misbehaviour_report import MisbehaviourReport
from scm.v2x.messages.misbehaviour_scores import MisbehaviourScores
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.signal_site import SignalSite
from scm.v2x.messages.signal_status import SignalStatus
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.traffic_counts import TrafficCounts
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.violation import Violation
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import WorldSnapshot

FRAME_DEPTH = 4
TAGS_DEPTH = 8
FORGET_NS = 60 * NS_PER_S
VIOLATIONS_DEPTH = 500
STOP_EXPIRES_NS = 3 * NS_PER_S  # of a world that speaks: it repeats an engaged stop each second
LONGEST_GAP_NS = 200 * NS_PER_MS  # between two snapshots; more is silence, not speech
MOST_REPORTED = 500


class CityView(BasePart):
    """What the city looks like from outside; hears all, says nothing."""

    def __init__(self) -> None:
        self.name = "api"
        self.role = "part"
        self.period_ns = 50 * NS_PER_MS
        self._lock = threading.Lock()
        self._now_ns = 0
        self._picture: Picture | None = None
        self._next_forget_ns = 0
        self._snapshot: Held[WorldSnapshot] | None = None
        self._definition: WorldDefinition | None = None
        self._stop: CityStop | None = None
        self._stop_untold_ns = 0
        self._spats: dict[str, Held[Spat]] = {}
        self._monitors: dict[str, Held[MonitorStatus]] = {}
        self._sites: dict[str, SignalSite] = {}
        self._signal_statuses: dict[str, Held[SignalStatus]] = {}
        self._signal_history = SignalHistory()
        self._trips: dict[str, Held[Trip]] = {}
        self._traffic: Held[TrafficCounts] | None = None
        self._violations: deque[Violation] = deque(maxlen=VIOLATIONS_DEPTH)
        self._frames: dict[str, deque[Held[EyeFrame]]] = {}
        self._tags: dict[str, deque[Held[EyeTags]]] = {}
        self._tags_seen: dict[tuple[str, int], TagSighting] = {}
        self._eye_statuses: dict[str, Held[EyeStatus]] = {}
        self._watched: Counter[tuple[str, str]] = Counter()
        self._camera_frames: dict[tuple[str, str], Held[CameraFrame]] = {}
        self._scans = ScanWatch()
        self._tracks = TrackWatch()
        self._close_ups = CloseUps()
        self._poses: dict[tuple[str, str], SeenPose] = {}
        self._eye_accuracy = EyeAccuracyPart()
        self._scores: Held[MisbehaviourScores] | None = None
        self._reports: dict[str, MisbehaviourReport] = {}
        self._stations = StationTable()
        self._disturbances = Disturbances()
        self._log = EventLog()
        self._receivers = self._receivers_of_all()
        self._always = tuple(Subscription(kind) for kind in self._receivers)
        self._receivers[CameraFrame] = self._receive_camera_frame
        self._receivers[LidarScan] = self._scans.receive
        self._receivers[EyeTrack] = self._tracks.receive
        self._receivers[VehicleState] = self._close_ups.receive
        self.subscriptions: Sequence[Subscription] = self._always

    def _receivers_of_all(self) -> dict[type[Message], Callable[[Any, int], None]]:
        """Return who takes each message that is heard whether somebody looks or not."""
        return {
            WorldSnapshot: self._receive_snapshot,
            WorldDefinition: self._receive_definition,
            Spat: self._receive_spat,
            SignalSite: lambda m, _: self._sites.update({m.junction: m}),
            SignalStatus: lambda m, t: self._signal_statuses.update({m.junction: Held(m, t)}),
            MonitorStatus: self._receive_monitor,
            EyeFrame: self._receive_frame,
            EyeTags: self._receive_tags,
            EyePose: self._receive_pose,
            EyeStatus: lambda m, t: self._eye_statuses.update({m.camera: Held(m, t)}),
            Presence: self._stations.presence,
            PartStatus: self._stations.status,
            CityEvent: lambda m, _: self._log.add(m),
            Trip: lambda m, t: self._trips.update({m.vehicle: Held(m, t)}),
            CityStop: self._receive_stop,
            TrafficCounts: self._receive_counts,
            Violation: lambda m, _: self._violations.append(m),
            MisbehaviourScores: self._receive_scores,
            MisbehaviourReport: self._receive_report,
        }

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Keep what came in; never answers."""
        with self._lock:
            self._now_ns = now_ns
            self._picture = None
            self._eye_accuracy.step(now_ns, inbox)
            for incoming in inbox:
                taker = self._receivers.get(type(incoming.message))
                if taker is not None:
                    taker(incoming.message, incoming.t_ns)
                self._disturbances.receive(incoming)
            self._disturbances.check_silence(now_ns)
            if now_ns >= self._next_forget_ns:
                self._next_forget_ns = now_ns + NS_PER_S
                self._forget(now_ns)
        return []

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Leave without a word."""
        self._now_ns = now_ns
        self._picture = None
        return []

    def picture(self) -> Picture:
        """Return a copy of the present state, one for all until the next step; any thread may."""
        with self._lock:
            if self._picture is None:
                self._picture = self._drawn()
            return self._picture

    def _drawn(self) -> Picture:
        return Picture(
            now_ns=self._now_ns,
            snapshot=self._snapshot,
            definition=self._definition,
            stop=self._stop,
            spats=dict(self._spats),
            monitors=dict(self._monitors),
            sites=dict(self._sites),
            signal_statuses=dict(self._signal_statuses),
            trips=dict(self._trips),
            traffic=self._traffic,
            violations=tuple(self._violations),
            frames={camera: tuple(frames) for camera, frames in self._frames.items()},
            tags={camera: tuple(tags) for camera, tags in self._tags.items()},
            tags_seen=dict(self._tags_seen),
            eye_statuses=dict(self._eye_statuses),
            poses=dict(self._poses),
            stations=self._stations.rows(self._now_ns),
            disturbances=self._disturbances,
            event_seq=self._log.newest_seq,
        )

    def events_after(self, seq: int, limit: int) -> tuple[LoggedEvent, ...]:
        """Return up to `limit` events numbered above `seq`, oldest first; safe from any thread."""
        with self._lock:
            return self._log.after(seq, limit)

    def events(self) -> Iterator[LoggedEvent]:
        """Return all events that are kept, newest first; safe from any thread."""
        with self._lock:
            return self._log.newest_first()

    def residuals(
        self, camera: str, window_s: float, vehicle: str = ""
    ) -> dict[str, tuple[ResidualSample, ...]]:
        """Return what a camera's poses were off by of late, by car; safe from any thread."""
        with self._lock:
            newest_ns = self._eye_accuracy.truth_ns
            return self._eye_accuracy.samples(
                camera, self._now_ns if newest_ns is None else newest_ns, window_s, vehicle
            )

    def misbehaviour(
        self,
    ) -> tuple[Held[MisbehaviourScores] | None, dict[str, MisbehaviourReport]]:
        """Return all stations' scores, and the newest report by station; safe from any thread."""
        with self._lock:
            return self._scores, dict(self._reports)

    def signal_history(self, junction: str, groups: Sequence[str]) -> History:
        """Return what a junction's groups showed in the last minutes; safe from any thread."""
        with self._lock:
            return self._signal_history.history(junction, groups)

    def signal_score(self, junction: str) -> ForecastScore:
        """Return what became of what a junction told; safe from any thread."""
        with self._lock:
            return self._signal_history.score(junction)

    def signal_verdicts(self, junction: str) -> tuple[Verdict, ...]:
        """Return what a junction's monitor said, newest first; safe from any thread."""
        with self._lock:
            return self._signal_history.verdicts(junction)

    @contextmanager
    def watching(self, vehicle: str, camera: str) -> Iterator[None]:
        """Hear the pictures of a car's camera for as long as this lasts; safe from any thread."""
        which = (vehicle, camera)
        self._watch(which, 1)
        try:
            yield
        finally:
            self._watch(which, -1)

    def camera_frame(self, vehicle: str, camera: str) -> Held[CameraFrame] | None:
        """Return the newest picture of a watched camera; safe from any thread."""
        with self._lock:
            return self._camera_frames.get((vehicle, camera))

    def watched(self, vehicle: str) -> tuple[str, ...]:
        """Return which of a car's cameras somebody watches; safe from any thread."""
        with self._lock:
            return tuple(sorted(camera for name, camera in self._watched if name == vehicle))

    @contextmanager
    def watching_scan(self, vehicle: str) -> Iterator[None]:
        """Hear a car's LIDAR for as long as this lasts; safe from any thread."""
        self._watch_scan(vehicle, 1)
        try:
            yield
        finally:
            self._watch_scan(vehicle, -1)

    def scan(self, vehicle: str) -> tuple[Held[LidarScan], Pose2 | None] | None:
        """Return a watched car's newest scan, and where the car was; safe from any thread."""
        with self._lock:
            held = self._scans.newest(vehicle)
            if held is None:
                return None
            return held, self._eye_accuracy.truth_at(vehicle, held.message.t_ns)

    def tracks(self) -> tuple[TrackRow, ...]:
        """Return the Eye's tracks, and hear them for some seconds more; safe from any thread."""
        with self._lock:
            if self._tracks.subscribe(self._now_ns):
                self._update_subscriptions()
            return self._tracks.rows(self._now_ns)

    @property
    def snapshot(self) -> Held[WorldSnapshot] | None:
        """What the world told last, and when; safe from any thread."""
        return self._snapshot

    @property
    def trips(self) -> Mapping[str, Held[Trip]]:
        """Each vehicle's newest trip; a copy, safe from any thread."""
        with self._lock:
            return dict(self._trips)

    @property
    def now_ns(self) -> int:
        """Time of the last step."""
        return self._now_ns

    @contextmanager
    def watching_closely(self, vehicle: str) -> Iterator[None]:
        """Hear all that a car reports for as long as this lasts; safe from any thread."""
        self._watch_closely(vehicle, 1)
        try:
            yield
        finally:
            self._watch_closely(vehicle, -1)

    def reports_after(self, vehicle: str, number: int) -> tuple[int, tuple[VehicleState, ...]]:
        """Return a watched car's reports after `number`, and the newest number; thread-safe."""
        with self._lock:
            return self._close_ups.after(vehicle, number)

    def _watch_closely(self, vehicle: str, more: int) -> None:
        with self._lock:
            self._close_ups.watch(vehicle, more)
            self._update_subscriptions()

    def _watch_scan(self, vehicle: str, more: int) -> None:
        with self._lock:
            self._scans.watch(vehicle, more)
            self._update_subscriptions()

    def _watch(self, which: tuple[str, str], more: int) -> None:
        with self._lock:
            self._watched[which] += more
            if self._watched[which] <= 0:
                del self._watched[which]
                self._camera_frames.pop(which, None)
            self._update_subscriptions()

    def _update_subscriptions(self) -> None:
        """Say what is to be heard now."""
        cameras = (
            Subscription(CameraFrame, {"vehicle": vehicle, "camera": camera})
            for vehicle, camera in self._watched
        )
        watched = (self._scans, self._close_ups, self._tracks)
        requested = (each for one in watched for each in one.subscriptions())
        self.subscriptions = (*self._always, *cameras, *requested)

    def _receive_camera_frame(self, frame: CameraFrame, t_ns: int) -> None:
        which = (frame.vehicle, frame.camera)
        if which in self._watched:
            self._camera_frames[which] = Held(frame, t_ns)

    def _receive_snapshot(self, snapshot: WorldSnapshot, t_ns: int) -> None:
        if self._snapshot is not None:
            passed_ns = t_ns - self._snapshot.arrived_ns
            self._stop_untold_ns += max(0, min(passed_ns, LONGEST_GAP_NS))
        if self._stop_untold_ns > STOP_EXPIRES_NS:
            self._stop = None  # its release was missed: an engaged stop is repeated
        self._snapshot = Held(snapshot, t_ns)

    def _receive_definition(self, definition: WorldDefinition, _t_ns: int) -> None:
        self._definition = definition

    def _receive_spat(self, spat: Spat, t_ns: int) -> None:
        self._spats[spat.junction] = Held(spat, t_ns)
        self._signal_history.receive(spat)

    def _receive_monitor(self, status: MonitorStatus, t_ns: int) -> None:
        self._monitors[status.junction] = Held(status, t_ns)
        self._signal_history.receive_monitor(status)

    def _receive_stop(self, stop: CityStop, _t_ns: int) -> None:
        self._stop, self._stop_untold_ns = stop, 0

    def _receive_counts(self, counts: TrafficCounts, t_ns: int) -> None:
        self._traffic = Held(counts, t_ns)

    def _receive_frame(self, frame: EyeFrame, t_ns: int) -> None:
        self._frames.setdefault(frame.camera, deque(maxlen=FRAME_DEPTH)).append(Held(frame, t_ns))

    def _receive_tags(self, tags: EyeTags, t_ns: int) -> None:
        self._tags.setdefault(tags.camera, deque(maxlen=TAGS_DEPTH)).append(Held(tags, t_ns))
        for tag in tags.tags:
            self._tags_seen[tags.camera, tag.tag_id] = TagSighting(tag, tags.t_ns, t_ns)

    def _receive_pose(self, pose: EyePose, t_ns: int) -> None:
        residual = self._eye_accuracy.newest(pose.camera, pose.vehicle)
        self._poses[pose.camera, pose.vehicle] = SeenPose(Held(pose, t_ns), residual)

    def _receive_scores(self, scores: MisbehaviourScores, t_ns: int) -> None:
        self._scores = Held(scores, t_ns)

    def _receive_report(self, report: MisbehaviourReport, _t_ns: int) -> None:
        self._reports.pop(report.suspect, None)
        self._reports[report.suspect] = report
        if len(self._reports) > MOST_REPORTED:
            self._reports.pop(next(iter(self._reports)))

    def _forget(self, now_ns: int) -> None:
        self._stations.forget(now_ns)
        if self._tracks.forget(now_ns):
            self._update_subscriptions()
        oldest_ns = now_ns - FORGET_NS
        for name in [n for n, trip in self._trips.items() if trip.arrived_ns < oldest_ns]:
            del self._trips[name]
        for key in [k for k, seen in self._poses.items() if seen.held.arrived_ns < oldest_ns]:
            del self._poses[key]
        for tag in [k for k, one in self._tags_seen.items() if one.arrived_ns < oldest_ns]:
            del self._tags_seen[tag]
        self._eye_accuracy.forget()
