"""The part that drives one car by a trained network: frames come in, commands go out.

The network sees the front camera and nothing else.
"""

import logging
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from scm.arrays import Image
from scm.clock import NS_PER_S
from scm.log import event
from scm.runtime.part import IsWanted, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.camera_frame import CameraFrame
from vehicle_agent.autonomy.control import Command
from vehicle_agent.cloning.model_file import Model
from vehicle_agent.cloning.network import FrameStack, network_named
from vehicle_agent.cloning.saliency import NetworkWatch
from vehicle_agent.trained_driver import TrainedDriver

TURN_FIRST_NS = NS_PER_S  # a car that stands turns its wheels before it sets out

_log = logging.getLogger(__name__)


class NetworkPart(TrainedDriver):
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

    Raises:
        LearningError: when the network cannot be used.
    """

    def __init__(
        self, name: str, vehicle: str, model: Path, throttle: float | None = None,
        speed: float = 1.0, spawn: str | None = None, session: str = "", *,
        ignore_signals: bool = False,
    ) -> None:  # fmt: skip
        self.model = Model(model)
        car = self.model.metadata.car
        super().__init__(name, vehicle, car, spawn, session, ignore_signals=ignore_signals)
        self._view = network_named(self.model.metadata.network).view
        self._watch = NetworkWatch(vehicle, self.model.metadata.network, model.name, self.model)
        self._stack = FrameStack[Image](self.model.metadata.stack)
        self._throttle, self._speed = throttle, speed
        self._began_ns: int | None = None
        self.frames, self.infer_s = 0, 0.0
        front = Subscription(CameraFrame, {"vehicle": vehicle, "camera": "front"})
        self.subscriptions = (front, *self.subscriptions)

    def attach(self, is_wanted: IsWanted) -> None:
        """Receive what reports whether somebody watches the network drive."""
        self._watch.attach(is_wanted)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Look at the newest frame; drive."""
        out = super().step(now_ns, inbox)
        is_idle = not any(isinstance(item.message, CameraFrame) for item in inbox)
        return out + self._watch.step(is_idle=is_idle)

    def look(self, inbox: Sequence[Incoming], now_ns: int) -> Command | None:
        """Steer by the newest frame; a damaged one is logged."""
        frames = [item.message for item in inbox if isinstance(item.message, CameraFrame)]
        if not frames:
            return None
        frame, began_s = frames[-1], time.perf_counter()
        image = cv2.imdecode(np.frombuffer(frame.payload, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            why = repr(f"expected a JPEG, got {len(frame.payload)} bytes that are none")
            event(_log, "frame", level=logging.WARNING, vehicle=self._vehicle, why=why)
            return None
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
        self._command = Command(throttle, commands[0])
        self.infer_s, self.frames = time.perf_counter() - began_s, self.frames + 1
        self._watch.begin(frame, view, self.allowed(now_ns), now_ns, self.infer_s)
        return self._command

    def detail(self) -> str:
        """Return how it drives, or what it waits for, in words."""
        if not self.frames:
            return f"waits for frames of {self._vehicle}'s front camera"
        return f"{self.frames} frames, {1e3 * self.infer_s:.1f} ms a frame"
