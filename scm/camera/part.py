"""The part that renders the cameras of all cars, only for subscribers.

Without subscribers it receives nothing, not even snapshots. The time of a frame is a multiple of
the camera's period. It is rendered once the world's snapshots have passed that time, interpolated
between the two around it. So a frame is up to one snapshot (50 ms) late; a car file's `latency_s`
counts from the frame's time and includes these 50 ms.
Emulated real cars are rendered at their true poses, see `scm.v2x.emulated_cars`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import cv2

from scm.camera.daylight import Daylight
from scm.camera.delivery import UnderWay, is_lost
from scm.camera.motion import STILL
from scm.camera.optics import Optics, fitted
from scm.camera.studio import Studio
from scm.camera.tween import between, motion, near
from scm.clock import NS_PER_MS, NS_PER_S, Clock, nanoseconds
from scm.errors import EyeError
from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, IsWanted, Subscription
from scm.v2x.emulated_cars import EmulatedCars
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.message import Message
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.world_snapshot import WorldSnapshot

SUBSCRIBER_CHECK_NS = 100 * NS_PER_MS
FLASH_NS = 500 * NS_PER_MS
FARTHEST_M = 12.0
"""Cars farther away are not drawn: a Nigel is 15 pixels wide there."""
ACTIVE_SUBSCRIPTIONS = (Subscription(WorldSnapshot), Subscription(Spat), Subscription(EmulatedPose))
ASLEEP: tuple[Subscription, ...] = ()

Which = tuple[str, str]
"""A vehicle and one of its cameras."""


@dataclass
class _Counted:
    """What the part reports of itself."""

    frames: int = 0
    published_ns: int = 0
    wanted: set[Which] = field(default_factory=set)


class CameraPart(BasePart):
    """Pictures the city through whichever cameras are wanted.

    Args:
        city_map: The city.
        seed: Of the floor's grain, the sensors' noise and the lost frames.
        daylight: The light in the city; None: a well lit room.
        clock: Times the pictures for the status line; None: it is left out.
        cameras: Returns the cameras of a car file, by name; None: as the file has them.
    """

    name = "camera"
    role = "part"
    period_ns = 20 * NS_PER_MS

    def __init__(
        self,
        city_map: CityMap,
        seed: int = 0,
        daylight: Daylight | None = None,
        clock: Clock | None = None,
        cameras: Callable[[str], Mapping[str, Optics]] | None = None,
    ) -> None:
        self.subscriptions: Sequence[Subscription] = ASLEEP
        self._map = city_map
        self._seed = seed
        self._daylight = daylight or Daylight()
        self._clock = clock
        self._cameras = cameras
        self._studio: Studio | None = None
        self._is_wanted: IsWanted = _nobody
        self._look_ns: int | None = None
        self._snapshots: list[WorldSnapshot] = []
        self._spats: dict[str, Spat] = {}
        self._emulated = EmulatedCars()
        self._exposed_ns: dict[Which, int] = {}
        self._under_way = UnderWay()
        self._counted = _Counted()
        self._spent_ns = 0

    def attach(self, is_wanted: IsWanted) -> None:
        """Receive what reports whether a picture has subscribers."""
        self._is_wanted = is_wanted

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Look whether anybody wants pictures; make those that are due."""
        if self._look_ns is None or now_ns >= self._look_ns:
            self._look_ns = now_ns + SUBSCRIBER_CHECK_NS
            self._look()
        status = self._status(now_ns)
        if not self.subscriptions:
            return status
        received_ns: int | None = None
        for item in inbox:
            if isinstance(item.message, Spat):
                self._spats[item.message.junction] = item.message
            elif isinstance(item.message, EmulatedPose):
                self._emulated.update(item.message)
            elif isinstance(item.message, WorldSnapshot):
                self._snapshots = [*self._snapshots[-1:], self._emulated.seen(item.message)]
                received_ns = min(item.t_ns, now_ns)
        if received_ns is not None:
            self._expose(received_ns)
        return [*self._under_way.come_out(now_ns), *status]

    def _look(self) -> None:
        if self._is_wanted(CameraFrame, {}):
            self.subscriptions = ACTIVE_SUBSCRIPTIONS
        elif self.subscriptions:
            self.subscriptions = ASLEEP
            self._snapshots.clear()
            self._spats.clear()
            self._exposed_ns.clear()
            self._under_way.clear()
            self._counted.wanted.clear()

    def _expose(self, received_ns: int) -> None:
        """Picture every wanted camera whose grid has a time between the last two snapshots."""
        if len(self._snapshots) < 2 or self._snapshots[0].t_ns >= self._snapshots[1].t_ns:
            return  # the first one, or the world's time went back
        before, after = self._snapshots
        self._counted.wanted.clear()
        for car in after.vehicles:
            if not self._is_wanted(CameraFrame, {"vehicle": car.vehicle}):
                continue
            for camera, optics in (self._cameras or fitted)(car.car).items():
                which = (car.vehicle, camera)
                if not self._is_wanted(CameraFrame, {"vehicle": car.vehicle, "camera": camera}):
                    continue
                self._counted.wanted.add(which)
                number, due_ns = _on_grid(after.t_ns, optics.rate_hz)
                if due_ns <= max(before.t_ns, self._exposed_ns.get(which, -1)):
                    continue
                self._exposed_ns[which] = due_ns
                if is_lost(self._seed, *which, number, optics.drop_out):
                    continue
                # In the clock by which snapshots arrive: the world's may be another computer's.
                out_ns = received_ns - (after.t_ns - due_ns) + nanoseconds(optics.latency_s)
                for frame in self._frame(which, optics, due_ns):
                    self._under_way.put(frame, out_ns)

    def _frame(self, which: Which, optics: Optics, t_ns: int) -> list[CameraFrame]:
        began_ns = self._clock.now_ns() if self._clock else 0
        if self._studio is None:
            self._studio = Studio(self._map, self._daylight, self._seed)
        vehicle, camera = which
        before, after = self._snapshots
        cars = between(before, near(after, vehicle, FARTHEST_M), t_ns)
        own = next((car for car in cars if car.vehicle == vehicle), None)
        if own is None:
            return []
        exposure_s = optics.exposure_time_s
        moving = motion(before, after, vehicle, exposure_s) if exposure_s else STILL
        image = self._studio.picture(
            optics, own, cars, self._shown(t_ns), camera, t_ns, after.boxes, moving
        )
        quality = [cv2.IMWRITE_JPEG_QUALITY, round(optics.jpeg_quality)]
        good, data = cv2.imencode(".jpg", image, quality)
        if not good:
            raise EyeError(f"cannot encode a frame of shape {image.shape} as JPEG")
        self._counted.frames += 1
        self._spent_ns += self._clock.now_ns() - began_ns if self._clock else 0
        height, width = image.shape[:2]
        frame = CameraFrame(
            vehicle=vehicle, camera=camera, t_ns=t_ns, width_px=width, height_px=height,
            payload=data.tobytes(),
        )  # fmt: skip
        return [frame]

    def _shown(self, t_ns: int) -> dict[int, str | None]:
        """Return the lamp that is on at each signal head."""
        colours = {
            (spat.junction, group.group): group.colour
            for spat in self._spats.values()
            for group in spat.groups
        }
        lit = t_ns // FLASH_NS % 2 == 0
        shown: dict[int, str | None] = {}
        for light in self._map.lights:
            colour = colours.get((light.junction, light.group), "dark")
            if colour == "flashing_red":
                shown[light.light_id] = "red" if lit else None
            else:
                shown[light.light_id] = None if colour == "dark" else colour
        return shown

    def _status(self, now_ns: int) -> list[Outgoing]:
        counted = self._counted
        if now_ns - counted.published_ns < NS_PER_S:
            return []
        counted.published_ns = now_ns
        count = len(counted.wanted)
        detail = "nobody looks" if not self.subscriptions else f"{count} camera{'s' * (count != 1)}"
        if counted.frames and self._clock is not None:
            detail += f", {self._spent_ns / counted.frames / NS_PER_MS:.0f} ms a frame"
        counted.frames = self._spent_ns = 0
        return [PartStatus(station=self.name, t_ns=now_ns, detail=detail)]


def _on_grid(t_ns: int, rate_hz: float) -> tuple[int, int]:
    """Return how many whole periods of a rate there were since time zero, and when the last was."""
    millihertz = round(1000 * rate_hz)
    frames = t_ns * millihertz // (1000 * NS_PER_S)
    return frames, frames * 1000 * NS_PER_S // millihertz


def _nobody(kind: type[Message], where: Mapping[str, str]) -> bool:
    del kind, where
    return False
