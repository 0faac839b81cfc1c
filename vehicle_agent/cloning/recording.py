"""The part that records a demonstration while somebody drives a car; it never commands.

That may be a person at the teleoperation page, the built-in driver, or a script.

A lap is over when the car comes back to where it set out, the same way round.
"""

import math
import statistics
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import LearningError
from scm.geometry import Pose2
from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from vehicle_agent.cloning.demonstration import ABOUT, FRAMES, About, Sample, write
from vehicle_agent.cloning.demonstrator import Demonstrator

WIDTH_PX, JPEG_QUALITY = 320, 90  # of a stored frame
AT_START_M, AT_START_RAD, AWAY_M = 0.25, 0.8, 1.0
MOVING_MPS = 0.05


class Laps:
    """Counts how often a car comes back to where it set out.

    Attributes:
        done: Laps that are over.
    """

    def __init__(self) -> None:
        self.done = 0
        self._start: Pose2 | None = None
        self._is_away = False

    def add(self, pose: Pose2, speed_mps: float) -> None:
        """Take where the car is."""
        if self._start is None:
            self._start = pose if abs(speed_mps) > MOVING_MPS else None
            return
        off = self._start.inverse() @ pose
        far = math.hypot(off.x, off.y)
        self._is_away = self._is_away or far > AWAY_M
        if self._is_away and far < AT_START_M and abs(off.yaw) < AT_START_RAD and off.x >= 0.0:
            self.done, self._is_away = self.done + 1, False


class RecordDemoPart(BasePart):
    """Records one car's frames and commands.

    Args:
        name: Its station.
        vehicle: The car.
        path: Folder of the demonstration, which is made.
        laps: After which it is over.
        on_lap: Called with the number of laps done.
        dagger: Record what the built-in driver would do instead of what is done.

    Attributes:
        samples: Recorded so far.

    Raises:
        LearningError: when the folder has a demonstration already.
    """

    role = "client"
    period_ns = 20 * NS_PER_MS

    def __init__(
        self, name: str, vehicle: str, path: Path, laps: int,
        on_lap: Callable[[int], None] | None = None, *, dagger: bool = False,
    ) -> None:  # fmt: skip
        if (path / ABOUT).exists():
            raise LearningError(f"{path}: has a demonstration already: name another folder")
        (path / FRAMES).mkdir(parents=True, exist_ok=True)
        self.name, self._vehicle, self._path, self._wanted = name, vehicle, path, laps
        self._on_lap, self._is_dagger = on_lap, dagger
        self._demonstrator: Demonstrator | None = None
        self._laps = Laps()
        self.samples: list[Sample] = []
        self._waiting: list[tuple[CameraFrame, int]] = []
        self._state: VehicleState | None = None
        self._map, self._drivers = "", list[str]()
        self._size = (0, 0)
        self._status_ns = -NS_PER_S
        own = {"vehicle": vehicle}
        self.subscriptions: Sequence[Subscription] = (
            Subscription(CameraFrame, {**own, "camera": "front"}),
            Subscription(VehicleState, own),
            Subscription(WorldDefinition),
        )

    @property
    def is_over(self) -> bool:
        """Whether all laps are driven."""
        return self._laps.done >= self._wanted

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Take frames, and the commands that were in force as they arrived."""
        for item in inbox:
            message = item.message
            if isinstance(message, CameraFrame):
                self._waiting.append((message, item.t_ns))
            elif isinstance(message, WorldDefinition):
                self._defined(message.map)
            elif isinstance(message, VehicleState) and not self.is_over:
                self._drove(message, item.t_ns)
        if now_ns - self._status_ns < NS_PER_S:
            return []
        self._status_ns = now_ns
        detail = f"{len(self.samples)} frames, lap {self._laps.done + 1} of {self._wanted}"
        return [PartStatus(station=self.name, t_ns=now_ns, detail=detail)]

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Write what was recorded, however much it is."""
        del now_ns
        self._write()
        return []

    def _defined(self, city_map: CityMap) -> None:
        if self._is_dagger and (self._demonstrator is None or self._map != city_map.name):
            city_map = replace(city_map, junctions=(), stop_lines=(), lights=())
            self._demonstrator = Demonstrator(city_map)
        self._map = city_map.name

    def _commands(self, state: VehicleState) -> tuple[float, float] | None:
        """Return the throttle and steering to store; None: there is nothing to learn from."""
        if self._demonstrator is not None:
            return self._demonstrator.commands(state)
        if self._is_dagger or state.throttle is None or state.steering is None:
            return None
        return state.throttle, state.steering

    def _drove(self, state: VehicleState, arrived_ns: int) -> None:
        """Store the frames that arrived before a report, with the commands that go with it."""
        commands = self._commands(state)
        before, self._state = self._laps.done, state
        self._laps.add(Pose2(state.x_m, state.y_m, state.yaw_rad), state.speed_mps)
        due = [one for one in self._waiting if one[1] <= arrived_ns]
        self._waiting = [one for one in self._waiting if one[1] > arrived_ns]
        for frame, frame_ns in due:
            if commands is not None:
                self._store(frame, frame_ns, state, commands, before)
        if self._laps.done > before:
            self._write()
            if self._on_lap is not None:
                self._on_lap(self._laps.done)

    def _store(
        self, frame: CameraFrame, arrived_ns: int, state: VehicleState,
        commands: tuple[float, float], lap: int,
    ) -> None:  # fmt: skip
        image = cv2.imdecode(np.frombuffer(frame.payload, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            return
        self._size = frame.width_px, frame.height_px
        height = round(WIDTH_PX * image.shape[0] / image.shape[1])
        smaller = cv2.resize(image, (WIDTH_PX, height), interpolation=cv2.INTER_AREA)
        name = f"{len(self.samples):06d}.jpg"
        quality = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
        if not cv2.imwrite(str(self._path / FRAMES / name), smaller, quality):
            raise LearningError(f"{self._path / FRAMES / name}: cannot be written")
        self.samples.append(
            Sample(
                frame=name, t_ns=frame.t_ns, arrived_ns=arrived_ns, steering=commands[1],
                throttle=commands[0], speed_mps=state.speed_mps, lap=lap,
            )
        )  # fmt: skip

    def _write(self) -> None:
        if not self.samples or self._state is None:
            return
        delays = [sample.arrived_ns - sample.t_ns for sample in self.samples]
        about = About(
            demonstration=1, vehicle=self._vehicle, car=self._state.car, map=self._map,
            width_px=self._size[0], height_px=self._size[1],
            delay_s=statistics.median(delays) / NS_PER_S, laps=self._laps.done,
        )  # fmt: skip
        write(self._path, about, self.samples)
