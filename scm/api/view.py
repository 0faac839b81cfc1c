"""The view: a part that only subscribes, and holds the newest of everything a person wants to see.

`step` runs on the runner's thread, everything else is called by the web's. Pictures of cars'
cameras, their LIDARs' scans and their own reports are subscribed to only while somebody watches
them: they are made for whoever subscribes.
"""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from scm.api.close_up import CloseUps
from scm.api.costmap_watch import CostmapWatch
from scm.api.event_log import EventLog
from scm.api.eye_tracks import TrackWatch
from scm.api.picture import Held, Picture
from scm.api.received import (
    CameraWatch,
    ReceivedAutonomy,
    ReceivedEye,
    ReceivedNeighbours,
    ReceivedSignals,
    ReceivedTraffic,
    ReceivedTwins,
    ReceivedWorld,
)
from scm.api.room_maps import ReceivedMaps
from scm.api.stations import StationTable
from scm.api.vehicle_watch import VehicleWatch
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
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_status import EyeStatus
from scm.v2x.messages.eye_tags import EyeTags
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.misbehaviour_report import MisbehaviourReport
from scm.v2x.messages.misbehaviour_scores import MisbehaviourScores
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.neighbour_status import NeighbourStatus
from scm.v2x.messages.network_view import NetworkView
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.signal_site import SignalSite
from scm.v2x.messages.signal_status import SignalStatus
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.traffic_counts import TrafficCounts
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.violation import Violation
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import WorldSnapshot

FORGET_NS = 60 * NS_PER_S
FORGET_TWINS_NS = 600 * NS_PER_S  # as the twin part does


class CityView(BasePart):
    """What the city looks like from outside; it publishes nothing."""

    def __init__(self) -> None:
        self.name = "api"
        self.role = "part"
        self.period_ns = 50 * NS_PER_MS
        self._lock = threading.Lock()
        self._now_ns = 0
        self._picture: Picture | None = None
        self._next_forget_ns = 0
        self._world = ReceivedWorld()
        self._signals = ReceivedSignals()
        self._traffic = ReceivedTraffic()
        self._autonomy = ReceivedAutonomy()
        self._room_maps = ReceivedMaps()
        self._twins = ReceivedTwins()
        self._neighbours = ReceivedNeighbours()
        self._eye_accuracy = EyeAccuracyPart()
        self._eye = ReceivedEye(self._eye_accuracy)
        self._cameras = CameraWatch()
        self._scans = VehicleWatch(LidarScan)
        self._networks = VehicleWatch(NetworkView)
        self._costmaps = CostmapWatch()
        self._tracks = TrackWatch()
        self._close_ups = CloseUps()
        self._stations = StationTable()
        self._disturbances = Disturbances()
        self._log = EventLog()
        self._receivers = self._receivers_of_all()
        self._always = tuple(Subscription(kind) for kind in self._receivers)
        self._receivers[CameraFrame] = self._cameras.receive
        self._receivers[LidarScan] = self._scans.receive
        self._receivers[NetworkView] = self._networks.receive
        self._receivers[Costmap] = self._costmaps.receive
        self._receivers[EyeTrack] = self._tracks.receive
        self._receivers[VehicleState] = self._close_ups.receive
        self.subscriptions: Sequence[Subscription] = self._always

    def _receivers_of_all(self) -> dict[type[Message], Callable[[Any, int], None]]:
        """Return the receiver of each message that the view always subscribes to."""
        return {
            WorldSnapshot: self._world.receive_snapshot,
            WorldDefinition: self._world.receive_definition,
            CityStop: self._world.receive_stop,
            Trip: self._world.receive_trip,
            AutonomyStatus: self._autonomy.receive_status,
            AutonomyPlan: self._autonomy.receive_plan,
            OccupancyMap: self._room_maps.receive,
            TwinStatus: self._twins.receive,
            NeighbourStatus: self._neighbours.receive,
            Spat: self._signals.receive_spat,
            SignalSite: self._signals.receive_site,
            SignalStatus: self._signals.receive_status,
            MonitorStatus: self._signals.receive_monitor,
            EyeFrame: self._eye.receive_frame,
            EyeTags: self._eye.receive_tags,
            EyePose: self._eye.receive_pose,
            EyeStatus: self._eye.receive_status,
            TrafficCounts: self._traffic.receive_counts,
            Violation: self._traffic.receive_violation,
            MisbehaviourScores: self._traffic.receive_scores,
            MisbehaviourReport: self._traffic.receive_report,
            Presence: self._stations.presence,
            PartStatus: self._stations.status,
            CityEvent: lambda event, _: self._log.add(event),
        }

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Store what arrived; publish nothing."""
        with self._lock:
            self._now_ns = now_ns
            self._picture = None
            self._eye_accuracy.step(now_ns, inbox)
            for incoming in inbox:
                receive = self._receivers.get(type(incoming.message))
                if receive is not None:
                    receive(incoming.message, incoming.t_ns)
                self._disturbances.receive(incoming)
            self._room_maps.place(self._eye_accuracy.truth_at)
            self._disturbances.check_silence(now_ns)
            if now_ns >= self._next_forget_ns:
                self._next_forget_ns = now_ns + NS_PER_S
                self._forget(now_ns)
        return []

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Publish nothing."""
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
            snapshot=self._world.snapshot,
            definition=self._world.definition,
            stop=self._world.stop,
            spats=dict(self._signals.spats),
            monitors=dict(self._signals.monitors),
            sites=dict(self._signals.sites),
            signal_statuses=dict(self._signals.statuses),
            trips=dict(self._world.trips),
            autonomy=dict(self._autonomy.statuses),
            autonomy_plans=dict(self._autonomy.plans),
            room_maps=dict(self._room_maps.newest),
            map_origins=dict(self._room_maps.origins),
            twins=dict(self._twins.statuses),
            traffic=self._traffic.counts,
            violations=tuple(self._traffic.violations),
            frames={camera: tuple(frames) for camera, frames in self._eye.frames.items()},
            tags={camera: tuple(tags) for camera, tags in self._eye.tags.items()},
            tags_seen=dict(self._eye.tags_seen),
            eye_statuses=dict(self._eye.statuses),
            poses=dict(self._eye.poses),
            stations=self._stations.rows(self._now_ns),
            neighbours=dict(self._neighbours.statuses),
            disturbances=self._disturbances,
            event_seq=self._log.newest_seq,
        )

    def events_after(self, seq: int, limit: int) -> tuple[LoggedEvent, ...]:
        """Return up to `limit` events numbered above `seq`, oldest first; safe from any thread."""
        with self._lock:
            return self._log.after(seq, limit)

    def events(self) -> Iterator[LoggedEvent]:
        """Return all stored events, newest first; safe from any thread."""
        with self._lock:
            return self._log.newest_first()

    def residuals(
        self, camera: str, window_s: float, vehicle: str = ""
    ) -> dict[str, tuple[ResidualSample, ...]]:
        """Return the residuals of a camera's recent poses, by car; safe from any thread."""
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
            return self._traffic.scores, dict(self._traffic.reports)

    def signal_history(self, junction: str, groups: Sequence[str]) -> History:
        """Return what a junction's groups showed in the last minutes; safe from any thread."""
        with self._lock:
            return self._signals.history.history(junction, groups)

    def signal_score(self, junction: str) -> ForecastScore:
        """Return how well a junction forecast its signals; safe from any thread."""
        with self._lock:
            return self._signals.history.score(junction)

    def signal_verdicts(self, junction: str) -> tuple[Verdict, ...]:
        """Return the verdicts of a junction's monitor, newest first; safe from any thread."""
        with self._lock:
            return self._signals.history.verdicts(junction)

    @contextmanager
    def watching(self, vehicle: str, camera: str) -> Iterator[None]:
        """Subscribe to the frames of a car's camera while this lasts; safe from any thread."""
        self._watch_camera(vehicle, camera, 1)
        try:
            yield
        finally:
            self._watch_camera(vehicle, camera, -1)

    def camera_frame(self, vehicle: str, camera: str) -> Held[CameraFrame] | None:
        """Return the newest picture of a watched camera; safe from any thread."""
        with self._lock:
            return self._cameras.newest(vehicle, camera)

    def watched(self, vehicle: str) -> tuple[str, ...]:
        """Return which of a car's cameras somebody watches; safe from any thread."""
        with self._lock:
            return self._cameras.of(vehicle)

    @contextmanager
    def watching_scan(self, vehicle: str) -> Iterator[None]:
        """Subscribe to a car's LIDAR while this lasts; safe from any thread."""
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

    @contextmanager
    def watching_network(self, vehicle: str) -> Iterator[None]:
        """Subscribe to what a network makes of a car's frames; safe from any thread."""
        self._watch_network(vehicle, 1)
        try:
            yield
        finally:
            self._watch_network(vehicle, -1)

    def network(self, vehicle: str) -> NetworkView | None:
        """Return what a network made of a watched car's newest frame; safe from any thread."""
        with self._lock:
            held = self._networks.newest(vehicle)
            return None if held is None else held.message

    def costmap(self, vehicle: str) -> Costmap | None:
        """Return a car's newest costmap, and subscribe to them for some seconds; thread-safe."""
        with self._lock:
            if self._costmaps.subscribe(vehicle, self._now_ns):
                self._update_subscriptions()
            return self._costmaps.newest(vehicle)

    def tracks(self) -> tuple[TrackRow, ...]:
        """Return the Eye's tracks, and subscribe to them for some seconds; safe from any thread."""
        with self._lock:
            if self._tracks.subscribe(self._now_ns):
                self._update_subscriptions()
            return self._tracks.rows(self._now_ns)

    @property
    def snapshot(self) -> Held[WorldSnapshot] | None:
        """The newest snapshot and when it arrived; safe from any thread."""
        return self._world.snapshot

    @property
    def trips(self) -> Mapping[str, Held[Trip]]:
        """Each vehicle's newest trip; a copy, safe from any thread."""
        with self._lock:
            return dict(self._world.trips)

    @property
    def now_ns(self) -> int:
        """Time of the last step."""
        return self._now_ns

    @contextmanager
    def watching_closely(self, vehicle: str) -> Iterator[None]:
        """Subscribe to a car's reports while this lasts; safe from any thread."""
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

    def _watch_network(self, vehicle: str, more: int) -> None:
        with self._lock:
            self._networks.watch(vehicle, more)
            self._update_subscriptions()

    def _watch_camera(self, vehicle: str, camera: str, more: int) -> None:
        with self._lock:
            self._cameras.watch(vehicle, camera, more)
            self._update_subscriptions()

    def _update_subscriptions(self) -> None:
        watched = (
            self._cameras, self._scans, self._networks, self._costmaps, self._close_ups,
            self._tracks,
        )  # fmt: skip
        requested = (each for one in watched for each in one.subscriptions())
        self.subscriptions = (*self._always, *requested)

    def _forget(self, now_ns: int) -> None:
        self._stations.forget(now_ns)
        if self._tracks.forget(now_ns) | self._costmaps.forget(now_ns):
            self._update_subscriptions()
        self._world.forget(now_ns - FORGET_NS)
        self._autonomy.forget(now_ns - FORGET_NS)
        self._room_maps.forget(now_ns - FORGET_NS)
        self._twins.forget(now_ns - FORGET_TWINS_NS)
        self._eye.forget(now_ns - FORGET_NS)
        self._eye_accuracy.forget()
