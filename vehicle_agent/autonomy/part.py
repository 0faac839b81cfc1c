"""The part that parks one car: what the car measures comes in, commands under its lease go out.

It drives a car that the world simulates, one with an agent of its own, and a real one alike: it
subscribes to the map and to that car's sensors, never to where the world has it. Of a car's report
of its state only motion that the Eye saw is used; with `use_eye`, the Eye's track of the car, too.
"""

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RunError, ScmError
from scm.geometry import Pose2
from scm.log import event
from scm.maps.route import roads_of
from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, IsWanted, Service, Subscription
from scm.v2x.exchange import Answer, Call, Incoming, Outgoing
from scm.v2x.message import Message, Refused, Request
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.bay_request import BayReply, BayRequest
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.park_request import ParkReply, ParkRequest
from scm.v2x.messages.parking_status import ParkingStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.vehicles.car import load_car
from scm.vehicles.drivers.cam_tracker import CamTracker
from vehicle_agent.autonomy.bay import BayClient, is_bay
from vehicle_agent.autonomy.control import Command
from vehicle_agent.autonomy.navigation import stack_named
from vehicle_agent.autonomy.parking import Parking, Report
from vehicle_agent.autonomy.shown import costmap_of, plan_of
from vehicle_agent.lease import CarLease

STATUS_NS, PLAN_NS = 200 * NS_PER_MS, 500 * NS_PER_MS
WAITING_SCAN_NS = 500 * NS_PER_MS  # of a car that waits for its turn
SPAWN_TIMEOUT_S = 10.0
ENDED = ("parked", "failed")
STAND = Command(0.0, 0.0)

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a parking agent is to do.

    Attributes:
        vehicle: Which car.
        goal: Place of the map, `X,Y,DEG`, or `any` bay; empty: it waits for a `ParkRequest`.
        start: Likewise, where the car roughly stands; empty: it finds that out.
        spawn: Place at which it is put onto the map first, empty: any free one; None: it is there.
        car: Its car file.
        seed: Of all that is drawn.
        use_eye: Whether it uses the Eye's poses of the car, too, where there are some.
        stack: Planner and controller: a key of `STACKS`.
    """

    vehicle: str
    goal: str = ""
    start: str = ""
    spawn: str | None = None
    car: str = "nigel"
    seed: int = 0
    use_eye: bool = False
    stack: str = "own"


class ParkPart(BasePart):
    """The parking agent of one car.

    Args:
        name: Its station, which owns the lease.
        wanted: What it is to do.
        session: Of its bus.
        on_report: Called when state or reason change.
        city_map: To go by instead of the city's.

    Attributes:
        parking: The drive to the goal; None without a goal or a map.

    Raises:
        RunError: when there is no such stack.
    """

    role = "client"
    period_ns = 20 * NS_PER_MS

    def __init__(
        self,
        name: str,
        wanted: Wanted,
        session: str = "",
        on_report: Callable[[Report], None] | None = None,
        city_map: CityMap | None = None,
    ) -> None:
        self.name, self._wanted, self._run = name, wanted, session
        self._car, self._stack = load_car(wanted.car), stack_named(wanted.stack)
        self._map, self._has_own_map = city_map, city_map is not None
        self._goal = wanted.goal
        self.parking: Parking | None = None
        self._start: Pose2 | None = None
        self._has_spawned = wanted.spawn is None
        self._spawn_ns: int | None = None
        self._others = CamTracker()
        self._lease = CarLease(wanted.vehicle, name)
        self._bay = BayClient(wanted.vehicle, name, session)
        self._goal_requests: list[Incoming] = []
        self._waits = self._refusal = ""
        self._scan_ns = -NS_PER_S
        self._on_report, self._last_report = on_report, Report("localise", "has not begun")
        self._busy_ns = 0
        self._compute_share = 0.0
        self._status_ns = self._plan_ns = self._second_ns = self._costmap_ns = -NS_PER_S
        self._is_wanted: IsWanted = lambda kind, where: False
        own = {"vehicle": wanted.vehicle}
        self.subscriptions: Sequence[Subscription] = (
            Subscription(WorldDefinition),
            Subscription(VehicleSensors, own),
            Subscription(VehicleState, own),
            Subscription(LidarScan, own),
            Subscription(CamRx, {"receiver": wanted.vehicle}),
            Subscription(ParkingStatus),
            *([Subscription(EyeTrack, own)] if wanted.use_eye else []),
        )
        self.services: Sequence[Service] = (Service(ParkRequest, own),)
        if city_map is not None:
            self._learn(city_map)

    @property
    def is_over(self) -> bool:
        """Whether the car is parked, or the agent gave up."""
        return self._report().state in ENDED

    def attach(self, is_wanted: IsWanted) -> None:
        """Make costmaps only for subscribers."""
        self._is_wanted = is_wanted

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Take what was measured; drive."""
        began_ns = time.thread_time_ns()
        out: list[Outgoing] = []
        for item in sorted(inbox, key=_is_goal):
            out += self._receive(item, now_ns)
        if not self._has_spawned:
            out += self._spawn(now_ns)
        else:
            out += self._bay.step(now_ns)
            self._waits = self._bay.waits(now_ns)
        # A step that plans or compiles may take seconds: who sends a goal is answered before.
        if self._has_spawned and self.parking is not None and not _has_answer(out):
            self.parking.navigator.others = self._others.others(now_ns)
            out += self._drive(STAND if self._waits else self.parking.step(now_ns), now_ns)
            if self.is_over:
                self._bay.end()
        self._busy_ns += time.thread_time_ns() - began_ns
        return out + self._reports(now_ns)

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Release the lease: the car stands."""
        del now_ns
        return self._lease.release()

    def _receive(self, item: Incoming, now_ns: int) -> list[Outgoing]:
        message, parking = item.message, self.parking
        if item.call is not None:
            return self._replied(item.call.request, message, now_ns)
        if isinstance(message, WorldDefinition):
            if self._map != message.map and not self._has_own_map:
                self._learn(message.map)
        elif isinstance(message, ParkRequest):
            return self._requested(item, message)
        elif isinstance(message, ParkingStatus):
            self._bay.receive(message, item.t_ns)
        elif isinstance(message, CamRx):
            if message.station != self._wanted.vehicle:
                self._others.receive(message.body, item.t_ns)
        elif parking is not None:
            self._measured(parking, message, now_ns)
        return []

    def _may_skip(self, now_ns: int) -> bool:
        """Return whether a car that waits needs no scan yet: each costs as much as to drive."""
        return bool(self._waits) and now_ns - self._scan_ns < WAITING_SCAN_NS

    def _measured(self, parking: Parking, message: Message, now_ns: int) -> None:
        """Hand over what the car measured; a damaged message is logged."""
        try:
            if isinstance(message, VehicleSensors):
                parking.sensors(message)
            elif isinstance(message, VehicleState):
                parking.perception.state(message)
            elif isinstance(message, EyeTrack):
                parking.perception.eye.receive(message)
            elif isinstance(message, LidarScan) and not self._may_skip(now_ns):
                self._scan_ns = now_ns
                parking.scan(message, now_ns)
        except ScmError as cause:
            event(_log, "park_message", level=logging.WARNING, why=repr(str(cause)))

    def _learn(self, city_map: CityMap) -> None:
        self._map = city_map
        if self._wanted.start:
            self._start = place_on(city_map, self._wanted.start)
        self._begin()

    def _spawn(self, now_ns: int) -> list[Outgoing]:
        if self._spawn_ns is not None and now_ns - self._spawn_ns < NS_PER_S:
            return []
        self._spawn_ns = now_ns
        wanted = self._wanted
        request = SpawnRequest(
            request_id=f"{self.name}-spawn-{wanted.vehicle}-{self._run}", vehicle=wanted.vehicle,
            car=wanted.car, spawn=wanted.spawn or "",
        )  # fmt: skip
        return [Call(request, SPAWN_TIMEOUT_S)]

    def _replied(self, request: Request, reply: Message, now_ns: int) -> list[Outgoing]:
        """Process a reply; return the answers that it leads to.

        Raises:
            RunError: when the car cannot be spawned.
        """
        if isinstance(request, LeaseRequest):
            self._lease.replied(request, reply)
        elif isinstance(request, BayRequest):
            return self._assigned(self._bay.replied(request, reply, now_ns))
        elif isinstance(reply, SpawnReply):
            self._has_spawned = True
            self._start = self._start or Pose2(reply.x_m, reply.y_m, reply.yaw_rad)
            self._begin()
        elif isinstance(reply, Refused) and reply.code not in ("timeout", "offline"):
            raise RunError(reply.detail)
        return []

    def _begin(self) -> None:
        """Begin to park, if there is a goal and a map.

        Raises:
            ScmError: when the map has no such place, or the car file lacks what is needed.
        """
        city_map, self.parking = self._map, None
        if city_map is None or not self._goal:
            return
        if is_bay(city_map, self._goal):
            self._bay.begin(self._goal)
        else:
            self._go(city_map, place_on(city_map, self._goal))

    def _go(self, city_map: CityMap, goal: Pose2) -> None:
        """Set out for a goal."""
        self._refusal = ""
        if self.parking is None:
            seed = self._wanted.seed
            self.parking = Parking(self._car, city_map, goal, self._start, seed, self._stack)
        else:
            self.parking.turn_to(goal)

    def _requested(self, item: Incoming, request: ParkRequest) -> list[Outgoing]:
        """Return the answers to requests for a goal; that for a bay waits for the manager's."""
        city_map = self._map
        if city_map is None:
            detail = f"{request.vehicle}: its agent has no map yet"
            return [Answer(item, Refused(code="offline", detail=detail))]
        if is_bay(city_map, request.goal):
            out = self._answers(Refused(code="superseded", detail="another goal was requested"))
            self._goal_requests.append(item)
            self._bay.begin(request.goal)
            return out
        try:
            goal = place_on(city_map, request.goal)
            self._go(city_map, goal)
        except ScmError as cause:
            return [Answer(item, Refused(code="invalid", detail=str(cause)))]
        self._goal = request.goal
        self._bay.begin("")
        out = self._answers(Refused(code="superseded", detail="another goal was requested"))
        return [*out, Answer(item, self._reply(goal))]

    def _assigned(self, reply: Message | None) -> list[Outgoing]:
        """Set out for the bay that the manager gave; return the answers to who requested it."""
        if isinstance(reply, BayReply) and self._map is not None:
            goal = Pose2(reply.x_m, reply.y_m, reply.yaw_rad)
            try:
                self._go(self._map, goal)
            except ScmError as cause:
                return self._answers(Refused(code="invalid", detail=str(cause)))
            self._goal = self._bay.goal
            return self._answers(self._reply(goal))
        if isinstance(reply, Refused):
            if not self._goal_requests:
                self._refusal = reply.detail
            return self._answers(reply)
        return []

    def _answers(self, reply: Message) -> list[Outgoing]:
        """Return the same answer to all who requested a bay."""
        items, self._goal_requests = self._goal_requests, []
        return [Answer(item, reply) for item in items]

    def _reply(self, goal: Pose2) -> ParkReply:
        return ParkReply(vehicle=self._wanted.vehicle, x_m=goal.x, y_m=goal.y, yaw_rad=goal.yaw)

    def _drive(self, command: Command, now_ns: int) -> list[Outgoing]:
        if self.is_over and command.throttle == 0.0:
            return self._lease.release()
        return self._lease.step(now_ns, command, now_ns)

    def _reports(self, now_ns: int) -> list[Outgoing]:
        out: list[Outgoing] = []
        if now_ns - self._second_ns >= NS_PER_S:
            self._compute_share = self._busy_ns / (now_ns - self._second_ns)
            self._second_ns, self._busy_ns = now_ns, 0
            out.append(PartStatus(station=self.name, t_ns=now_ns, detail=self._detail()))
        parking, report, before = self.parking, self._report(), self._last_report
        is_new, self._last_report = report != before, report
        if is_new:
            name, reason = self._wanted.vehicle, repr(report.reason)
            event(
                _log, "park", level=logging.DEBUG, vehicle=name, state=report.state, reason=reason
            )
            if self._on_report is not None:
                self._on_report(report)
        if is_new or now_ns - self._status_ns >= STATUS_NS:
            self._status_ns = now_ns
            out.append(self._status(parking, now_ns))
        if parking is not None and now_ns - self._plan_ns >= PLAN_NS:
            self._plan_ns = now_ns
            out.append(plan_of(parking, self._wanted.vehicle, now_ns))
        if parking is not None and now_ns - self._costmap_ns >= NS_PER_S:
            out += self._costmap(parking, now_ns)
        return out

    def _report(self) -> Report:
        if self._waits:
            return Report("plan", self._waits)
        if self._refusal:
            return Report("failed", self._refusal)
        if self.parking is not None:
            report = self.parking.report
            return Report(report.state, report.reason or self.parking.perception.eye.problem)
        return Report("idle", f"no {'map' if self._map is None else 'goal'} yet")

    def _detail(self) -> str:
        report = self._report()
        reason = f": {report.reason}" if report.reason else ""
        lease = "" if report.state in ("idle", *ENDED) else f"; {self._lease.detail}"
        return f"{self._wanted.vehicle} {report.state}{reason}{lease}"

    def _status(self, parking: Parking | None, now_ns: int) -> AutonomyStatus:
        report = self._report()
        status = AutonomyStatus(
            vehicle=self._wanted.vehicle, t_ns=now_ns, state=report.state, reason=report.reason,
            compute_share=round(self._compute_share, 4),
        )  # fmt: skip
        if parking is None:
            return status
        found, here = parking.perception.localised, parking.perception.now()
        goal = parking.goal
        status = replace(
            status, goal_x_m=goal.x, goal_y_m=goal.y, goal_yaw_rad=goal.yaw,
            attempts=parking.attempts,
        )  # fmt: skip
        if found is None or here is None:
            return status
        std = np.sqrt(np.diag(found.covariance))
        return replace(
            status, x_m=here.pose.x, y_m=here.pose.y, yaw_rad=here.pose.yaw,
            position_std_m=float(np.hypot(std[0], std[1])), yaw_std_rad=float(std[2]),
            explained=float(found.explained.mean()) if len(found.explained) else 0.0,
        )  # fmt: skip

    def _costmap(self, parking: Parking, now_ns: int) -> list[Outgoing]:
        vehicle = self._wanted.vehicle
        if not self._is_wanted(Costmap, {"vehicle": vehicle}):
            return []
        self._costmap_ns = now_ns
        return [costmap_of(parking, vehicle, now_ns)]


def place_on(city_map: CityMap, text: str) -> Pose2:
    """Return the pose of a place of the map, or of coordinates.

    Raises:
        MapError: when there is no such place, or it is off the floor.
    """
    return roads_of(city_map).spawn_pose(text)


def _has_answer(out: Sequence[Outgoing]) -> bool:
    return any(isinstance(item, Answer) for item in out)


def _is_goal(item: Incoming) -> bool:
    return isinstance(item.message, ParkRequest)
