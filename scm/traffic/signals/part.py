"""The traffic part: controls every junction of the map and publishes what it shows.

It answers requests and subscribes to the monitor. A fault that the monitor reports, or a monitor
that falls silent, makes the junction flash red until the monitor reports no fault. What the
controller shows is published as `Spat` at every step, and sent by the roadside station as SPATEM
twice a second and at every change, with the lanes as MAPEM once a second. A policy that needs
detectors also uses the CAMs that the roadside unit receives, and the overhead cameras' tracks.
"""

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from scm.errors import PlanError, nearest
from scm.log import event
from scm.maps.route import roads_of
from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, Service, Subscription
from scm.store.records import PlanRecord
from scm.traffic.signals.changed_times import ChangedTimes
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.detectors import JunctionDetectors, Seen, Sightings, reach_of
from scm.traffic.signals.junction import JunctionSignals
from scm.traffic.signals.junction_timings import timings_of, topologies_of
from scm.traffic.signals.policy import FIXED
from scm.traffic.signals.priority_requests import PriorityRequests
from scm.traffic.signals.program import STEP_NS
from scm.traffic.signals.status_reports import StatusReports
from scm.traffic.signals.timing import NIGEL, CarFacts
from scm.v2x.etsi.convert import roadside_station
from scm.v2x.exchange import Answer, Incoming, Outgoing, PersistedState
from scm.v2x.message import Refused
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanRequest
from scm.v2x.messages.signal_request import SignalRequest
from scm.v2x.messages.srem import SremRx
from scm.v2x.messages.twin_status import TwinStatus

_log = logging.getLogger(__name__)


class TrafficPart(BasePart):
    """Controls the signals of all junctions of a map; see `scm.runtime.part.Part`."""

    def __init__(
        self,
        city_map: CityMap,
        plan: str | None = None,
        *,
        policy: str = FIXED,
        car: CarFacts = NIGEL,
        learned: Callable[[Any], Any] | None = None,
        restored: Mapping[str, PlanRecord] | None = None,
    ) -> None:
        """Set up all junctions.

        Args:
            city_map: Whose junctions.
            plan: Replaces the plans that the map names.
            policy: Of all junctions while nobody requests another one.
            car: As bad as the worst of the fleet; all least times follow from it.
            learned: For the policy `learned`.
            restored: What operators requested in an earlier run, by junction.

        Raises:
            PlanError: when a plan or policy is unknown, or not safe for a junction.
        """
        self.name = "traffic"
        self.role = "part"
        self.period_ns = STEP_NS
        self.services = (Service(PlanRequest), Service(SignalRequest))
        roads, timings = roads_of(city_map), timings_of(city_map, car)
        topologies = topologies_of(city_map)
        self._changed_times = ChangedTimes(city_map, car, timings)
        self._sightings = Sightings()
        self._junctions = {
            junction.name: JunctionSignals(
                junction,
                Controller(
                    junction.name,
                    timings[junction.name].program,
                    plan or junction.plan,
                    city_map.revision,
                    policy=policy,
                    tables=timings[junction.name].tables,
                    learned=learned,
                    car=car,
                ),
                JunctionDetectors(junction, roads, reach_of(timings[junction.name].program, roads)),
                PriorityRequests(junction, roads),
                topologies[junction.name],
                StatusReports(
                    junction.name, timings[junction.name].program, timings[junction.name].tables
                ),
            )
            for junction in city_map.junctions
        }
        for name, record in (restored or {}).items():
            if name in self._junctions:
                self._junctions[name].restore(record)
        self._by_station = {roadside_station(name): s for name, s in self._junctions.items()}

    @property
    def subscriptions(self) -> tuple[Subscription, ...]:
        """The monitor, requests for priority, versions of cars; cars, where detectors need them."""
        listening = [
            Subscription(CamRx, {"receiver": station})
            for station, signals in self._by_station.items()
            if signals.controller.needs_detectors
        ]
        tracks = (Subscription(EyeTrack),) if listening else ()
        cars = (Subscription(TwinStatus), Subscription(CityEvent, {"source": "world"}))
        return (Subscription(MonitorStatus), Subscription(SremRx), *cars, *listening, *tracks)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Handle requests, cars and the monitor, step every junction, publish what it shows."""
        outbox: list[Outgoing] = []
        for item in inbox:
            message = item.message
            if isinstance(message, MonitorStatus):
                self._receive_monitor(message, item.t_ns)
            elif isinstance(message, SremRx):
                self._receive_srem(message, now_ns)
            elif isinstance(message, CamRx):
                self._add_sighting([message.receiver], self._sightings.of_cam(message), item.t_ns)
            elif isinstance(message, EyeTrack):
                self._add_sighting(self._by_station, self._sightings.of_track(message), item.t_ns)
            elif isinstance(message, TwinStatus | CityEvent):
                self._changed_times.receive(message, now_ns)
            elif isinstance(message, PlanRequest | SignalRequest):
                outbox += self._serve(item, message, now_ns)
        timings, events = self._changed_times.step(now_ns)
        outbox += events
        for name, timing in timings.items():
            self._junctions[name].request_timing(timing)
        for signals in self._junctions.values():
            outbox += signals.step(now_ns)
        return outbox

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Stop publishing: cars do not use a green that is older than a second."""
        event(_log, "traffic_finished", t_ns=now_ns, junctions=len(self._junctions))
        return []

    def _receive_srem(self, message: SremRx, now_ns: int) -> None:
        signals = self._by_station.get(message.receiver)
        if signals is not None:
            signals.priority_requests.receive(message, now_ns)

    def _add_sighting(self, stations: Iterable[str], seen: Seen | None, arrived_ns: int) -> None:
        for station in stations if seen is not None else ():
            signals = self._by_station.get(station)
            if signals is not None and seen is not None and signals.controller.needs_detectors:
                signals.detectors.add(seen, arrived_ns)

    def _receive_monitor(self, status: MonitorStatus, arrived_ns: int) -> None:
        signals = self._junctions.get(status.junction)
        if signals:
            signals.receive_monitor(status, arrived_ns)

    def _serve(
        self, item: Incoming, request: PlanRequest | SignalRequest, now_ns: int
    ) -> list[Outgoing]:
        signals = self._junctions.get(request.junction)
        if signals is None:
            known = list(self._junctions)
            hint = nearest(request.junction, known)
            detail = f"no junction {request.junction!r}{hint}, only {known}"
            return [Answer(item, Refused(code="not_found", detail=detail))]
        if not request.by.strip():
            detail = f"junction {request.junction}: by: got nothing, expected who asks"
            return [Answer(item, Refused(code="invalid", detail=detail))]
        try:
            if isinstance(request, SignalRequest):
                return [Answer(item, signals.serve_override(request, now_ns))]
            reply = signals.serve_plan(request)
            return [PersistedState("plans", request.junction, signals.record), Answer(item, reply)]
        except PlanError as refusal:
            is_override = isinstance(request, SignalRequest) or request.stages
            code = "invalid" if is_override else "not_found"
            return [Answer(item, Refused(code=code, detail=str(refusal)))]
