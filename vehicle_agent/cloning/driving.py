"""The part that drives one car by a trained network: frames come in, commands go out.

The network sees the front camera and nothing else. On a map with signals, a rule above it limits
its throttle (`signal_rule`). A car whose frames stop coming stands: its lease repeats no command
that is older than a second.
"""

import logging
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from scm.arrays import Image
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RunError
from scm.log import event
from scm.runtime.part import BasePart, IsWanted, Subscription
from scm.v2x.exchange import Call, Incoming, Outgoing
from scm.v2x.message import Message, Refused, Request
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.spatem import SpatemRx
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from vehicle_agent.autonomy.control import Command
from vehicle_agent.cloning.model_file import Model
from vehicle_agent.cloning.network import FrameStack, network_named
from vehicle_agent.cloning.saliency import NetworkWatch
from vehicle_agent.lease import CarLease

if TYPE_CHECKING:  # it needs the compiler; a map without signals does not
    from vehicle_agent.cloning.signal_rule import SignalRule

SPAWN_TIMEOUT_S = 10.0
TURN_FIRST_NS = NS_PER_S  # a car that stands turns its wheels before it sets out
STAND = Command(0.0, 0.0)

_log = logging.getLogger(__name__)


class NetworkPart(BasePart):
    """A network that drives one car.

    Args:
        name: Its station, which owns the lease.
        vehicle: The car.
        model: Path of the network.
        throttle: Instead of the network's, or of the demonstration's; None: theirs.
        speed: Times that throttle.
        spawn: Place at which the car is put onto the map first, empty: any free one; None: it is
            there.
        session: Of its bus.
        ignore_signals: Whether the network drives on whatever they show.

    Attributes:
        frames: How many it drove by.
        infer_s: What the last one took, decoding included.
        problem: Why it does not drive, in words; empty: it does.

    Raises:
        LearningError: when the network cannot be used.
    """

    role = "client"
    period_ns = 20 * NS_PER_MS

    def __init__(
        self, name: str, vehicle: str, model: Path, throttle: float | None = None,
        speed: float = 1.0, spawn: str | None = None, session: str = "", *,
        ignore_signals: bool = False,
    ) -> None:  # fmt: skip
        self.name, self._vehicle, self._spawn, self._run = name, vehicle, spawn, session
        self.model = Model(model)
        self._view = network_named(self.model.metadata.network).view
        self._watch = NetworkWatch(vehicle, self.model.metadata.network, model.name, self.model)
        self._stack = FrameStack[Image](self.model.metadata.stack)
        self._throttle, self._speed = throttle, speed
        self._lease = CarLease(vehicle, name)
        self._command, self._commanded_ns = STAND, -NS_PER_S
        self._has_spawned, self._spawn_ns = spawn is None, -NS_PER_S
        self._began_ns: int | None = None
        self._status_ns = -NS_PER_S
        self.frames, self.infer_s, self.problem = 0, 0.0, ""
        self._ignores_signals, self._defined_ns = ignore_signals, -1
        self._rule: SignalRule | None = None
        self._waits_for = ""
        own, here = {"vehicle": vehicle}, {"receiver": vehicle}
        self.subscriptions: Sequence[Subscription] = (
            Subscription(CameraFrame, {**own, "camera": "front"}),
            Subscription(VehicleState, own),
            Subscription(WorldDefinition),
            Subscription(SpatemRx, here),
            Subscription(CamRx, here),
            Subscription(MonitorStatus),
        )

    def attach(self, is_wanted: IsWanted) -> None:
        """Receive what reports whether somebody watches the network drive."""
        self._watch.attach(is_wanted)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Look at the newest frame; drive."""
        frame: CameraFrame | None = None
        for item in inbox:
            if item.call is not None:
                self._replied(item.call.request, item.message)
            elif isinstance(item.message, CameraFrame):
                frame = item.message
            elif isinstance(item.message, WorldDefinition):
                self._learn(item.message)
            elif isinstance(item.message, VehicleState):
                self._check(item.message)
            if self._rule is not None:
                self._rule.receive(item)
        out: list[Outgoing] = []
        if not self._has_spawned:
            out += self._put(now_ns)
        elif frame is not None and not self.problem:
            self._look(frame, now_ns)
        if self._has_spawned and self.frames:
            out += self._lease.step(now_ns, self._allowed(now_ns), self._commanded_ns)
        return out + self._watch.step(is_idle=frame is None) + self._status(now_ns)

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Release the lease: the car stands."""
        del now_ns
        return self._lease.release()

    def _look(self, frame: CameraFrame, now_ns: int) -> None:
        """Steer by a frame; a damaged one is logged."""
        began_s = time.perf_counter()
        image = cv2.imdecode(np.frombuffer(frame.payload, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            why = repr(f"expected a JPEG, got {len(frame.payload)} bytes that are none")
            event(_log, "frame", level=logging.WARNING, vehicle=self._vehicle, why=why)
            return
        seen = self._stack.add(frame.t_ns, np.asarray(image, dtype=np.uint8))
        view = self._view(seen)
        commands = self.model(view)
        throttle = commands[1] if len(commands) > 1 else self.model.metadata.throttle
        if self._throttle is not None:
            throttle = self._throttle
        throttle = min(1.0, self._speed * throttle)
        if self._began_ns is None:
            self._began_ns = now_ns
        if now_ns - self._began_ns < TURN_FIRST_NS:
            throttle = 0.0
        self._command, self._commanded_ns = Command(throttle, commands[0]), now_ns
        self.infer_s, self.frames = time.perf_counter() - began_s, self.frames + 1
        self._watch.begin(frame, view, self._allowed(now_ns), now_ns, self.infer_s)

    def _learn(self, world: WorldDefinition) -> None:
        """Prepare for the signals of another map."""
        if world.t_ns == self._defined_ns:
            return
        self._defined_ns, self._rule = world.t_ns, None
        if world.map.junctions and not self._ignores_signals:
            from vehicle_agent.cloning.signal_rule import SignalRule  # noqa: PLC0415 see above

            self._rule = SignalRule(self._vehicle, self.model.metadata.car, world.map)

    def _allowed(self, now_ns: int) -> Command:
        """Return the network's command with the throttle that signals allow."""
        if self.problem:
            return STAND
        self._waits_for = "" if self._defined_ns >= 0 else "waits for the map"
        throttle = self._command.throttle
        if self._rule is not None:
            throttle = min(throttle, self._rule.max_throttle(now_ns))
            self._waits_for = self._rule.detail
        return self._command._replace(throttle=0.0 if self._defined_ns < 0 else throttle)

    def _check(self, state: VehicleState) -> None:
        """Do not drive another car than the one that the network learned on."""
        expected = self.model.metadata.car
        if state.car != expected and not self.problem:
            self.problem = (
                f"the network was trained on a {expected}, {self._vehicle} is a {state.car}"
            )
            event(_log, "network", level=logging.WARNING, why=repr(self.problem))

    def _put(self, now_ns: int) -> list[Outgoing]:
        if now_ns - self._spawn_ns < NS_PER_S:
            return []
        self._spawn_ns = now_ns
        request = SpawnRequest(
            request_id=f"{self.name}-spawn-{self._vehicle}-{self._run}", vehicle=self._vehicle,
            car=self.model.metadata.car, spawn=self._spawn or "",
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
        driven = f"{self.frames} frames, {1e3 * self.infer_s:.1f} ms a frame"
        detail = self.problem or self._waits_for or driven
        if not self.frames and not self.problem:
            detail = f"waits for frames of {self._vehicle}'s front camera"
        return [PartStatus(station=self.name, t_ns=now_ns, detail=detail)]
