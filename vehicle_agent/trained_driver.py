"""The part that drives one car by something that was trained; what that is, its subclasses say.

The car is put onto the map if requested, its lease is held, and its commands go out. On a map with
signals, a rule above it limits the throttle (`cloning/signal_rule.py`). A car about which nothing
new comes stands: its lease repeats no command that is older than a second.
"""

import logging
from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RunError
from scm.log import event
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Call, Incoming, Outgoing
from scm.v2x.message import Message, Refused, Request
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.spatem import SpatemRx
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from vehicle_agent.autonomy.control import Command
from vehicle_agent.lease import CarLease

if TYPE_CHECKING:  # it needs the compiler; a map without signals does not
    from vehicle_agent.cloning.signal_rule import SignalRule

SPAWN_TIMEOUT_S = 10.0
STAND = Command(0.0, 0.0)

_log = logging.getLogger(__name__)


class TrainedDriver(BasePart):
    """Drives one car.

    Args:
        name: Its station, which owns the lease.
        vehicle: The car.
        car: Car file of the cars that it can drive.
        spawn: Place at which the car is put onto the map first, empty: any free one; None: it is
            there.
        session: Of its bus.
        ignore_signals: Whether it drives on whatever they show.

    Attributes:
        problem: Why it does not drive, in words; empty: it does.
    """

    role = "client"
    period_ns = 20 * NS_PER_MS

    def __init__(
        self, name: str, vehicle: str, car: str, spawn: str | None, session: str, *,
        ignore_signals: bool,
    ) -> None:  # fmt: skip
        self.name, self._vehicle, self._car = name, vehicle, car
        self._spawn, self._run = spawn, session
        self._lease = CarLease(vehicle, name)
        self._command, self._commanded_ns = STAND, -NS_PER_S
        self._has_spawned, self._spawn_ns = spawn is None, -NS_PER_S
        self._status_ns = -NS_PER_S
        self.problem = ""
        self._ignores_signals, self._defined_ns = ignore_signals, -1
        self._rule: SignalRule | None = None
        self._waits_for = ""
        own, here = {"vehicle": vehicle}, {"receiver": vehicle}
        self.subscriptions: Sequence[Subscription] = (
            Subscription(VehicleState, own),
            Subscription(WorldDefinition),
            Subscription(SpatemRx, here),
            Subscription(CamRx, here),
            Subscription(MonitorStatus),
        )

    @abstractmethod
    def look(self, inbox: Sequence[Incoming], now_ns: int) -> Command | None:
        """Return the command for what came; None: nothing that it drives by."""

    @abstractmethod
    def detail(self) -> str:
        """Return how it drives, or what it waits for, in words."""

    def learn(self, world: WorldDefinition) -> None:
        """Receive the city's definition, once each."""
        self._rule = None
        if world.map.junctions and not self._ignores_signals:
            from vehicle_agent.cloning.signal_rule import SignalRule  # noqa: PLC0415 see above

            self._rule = SignalRule(self._vehicle, self._car, world.map)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Look at what came; drive."""
        for item in inbox:
            if item.call is not None:
                self._replied(item.call.request, item.message)
            elif isinstance(item.message, WorldDefinition):
                if item.message.t_ns != self._defined_ns:
                    self._defined_ns = item.message.t_ns
                    self.learn(item.message)
            elif isinstance(item.message, VehicleState):
                self._check(item.message)
            if self._rule is not None:
                self._rule.receive(item)
        out: list[Outgoing] = []
        if not self._has_spawned:
            out += self._put(now_ns)
        elif not self.problem and (command := self.look(inbox, now_ns)) is not None:
            self._command, self._commanded_ns = command, now_ns
        if self._has_spawned and self._commanded_ns >= 0:
            out += self._lease.step(now_ns, self.allowed(now_ns), self._commanded_ns)
        return out + self._status(now_ns)

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Release the lease: the car stands."""
        del now_ns
        return self._lease.release()

    def allowed(self, now_ns: int) -> Command:
        """Return the command with the throttle that signals allow."""
        if self.problem:
            return STAND
        self._waits_for = "" if self._defined_ns >= 0 else "waits for the map"
        throttle = self._command.throttle
        if self._rule is not None:
            throttle = min(throttle, self._rule.max_throttle(now_ns))
            self._waits_for = self._rule.detail
        return self._command._replace(throttle=0.0 if self._defined_ns < 0 else throttle)

    def _check(self, state: VehicleState) -> None:
        """Do not drive another car than the one that it was trained on."""
        if state.car != self._car and not self.problem:
            self.refuse(
                f"the network was trained on a {self._car}, {self._vehicle} is a {state.car}"
            )

    def refuse(self, problem: str) -> None:
        """Drive no more, and say why."""
        self.problem = problem
        event(_log, "cannot_drive", level=logging.WARNING, vehicle=self._vehicle, why=repr(problem))

    def _put(self, now_ns: int) -> list[Outgoing]:
        if now_ns - self._spawn_ns < NS_PER_S:
            return []
        self._spawn_ns = now_ns
        request = SpawnRequest(
            request_id=f"{self.name}-spawn-{self._vehicle}-{self._run}", vehicle=self._vehicle,
            car=self._car, spawn=self._spawn or "",
        )  # fmt: skip
        return [Call(request, SPAWN_TIMEOUT_S)]

    def _replied(self, request: Request, reply: Message) -> None:
        """Process a reply.

        Raises:
            RunError: when the car cannot be spawned.
        """
        if isinstance(request, LeaseRequest):
            self._lease.replied(request, reply)
        elif isinstance(reply, SpawnReply):
            self._has_spawned = True
        elif isinstance(reply, Refused) and reply.code not in ("timeout", "offline"):
            raise RunError(reply.detail)

    def _status(self, now_ns: int) -> list[Outgoing]:
        if now_ns - self._status_ns < NS_PER_S:
            return []
        self._status_ns = now_ns
        detail = self.problem or self._waits_for or self.detail()
        return [PartStatus(station=self.name, t_ns=now_ns, detail=detail)]
