"""One city of a live trial, in lockstep: cars of the reality circulate, the twin part watches.

What the twin part reports is collected, and how well versions that it put in force predict later
driving. Nothing of the scene reaches the parts but what cars and cameras do.
"""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from scm.clock import NS_PER_S, ProcessorClock, seconds
from scm.errors import ScmError
from scm.maps.load import load_map
from scm.maps.route import LanePath
from scm.recorder.driven import CarMessages, recording_of
from scm.recording.span import part_of
from scm.records.city_map import CityMap
from scm.records.twins import TwinChange, TwinVersion
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Part, Subscription
from scm.traffic.signals.part import TrafficPart
from scm.twin.investigation import AtOnce, T, compare
from scm.twin.memory import seen_by_eye
from scm.twin.part import BUDGET_S, FALSE_ALARM_H, TwinPart
from scm.twin.trial.poses_eye import PosesEye, View, sees
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart
from vehicle_agent.bodies.reality import RealityBody, engine_of, reality
from vehicle_agent.body import BodyKind

CAR, CAMERAS = "nigel", ("west", "east")
BEGIN_NS = 1_800_000_000 * NS_PER_S
STEP_S, CHUNK_S, LATER_S = 10.0, 60.0, 300.0
BEYOND_M = 0.5  # of the floor's edge: about where the floor below a sinking camera stays
PLACES_M = 0.1  # between places where something may be spilled
FOUND_FILE = "city.json"
ENDED = ("named", "undecided", "unexplained", "elsewhere", "failed")


@dataclass(frozen=True, slots=True, kw_only=True)
class CityRequest:
    """What city to play.

    Attributes:
        number: Of the city among those of its seed.
        strength: Of changes, in multiples of the smallest size that 90 s of driving can show.
        healthy: Nothing changes.
        search: Whether the twin part searches for what a change is.
    """

    seed: int = 0
    number: int = 0
    cars: int = 6
    hours: float = 2.0
    engine: str = "own"
    strength: tuple[float, float] = (2.0, 3.0)
    healthy: bool = False
    map: str = "driving_school"
    false_alarm_h: float = FALSE_ALARM_H
    search: bool = True
    budget_s: float = BUDGET_S

    @property
    def names(self) -> tuple[str, ...]:
        """The cars'."""
        return tuple(f"n{k}" for k in range(1, self.cars + 1))

    @property
    def title(self) -> str:
        """Of its files."""
        return f"case_{self.number:03d}"


class Chunk(msgspec.Struct, kw_only=True, frozen=True):
    """Errors of position after 3 s on a minute of driving, by the version before and by the new."""

    begins_s: float
    ends_s: float
    windows: int
    before_m: float
    now_m: float


class Adopted(msgspec.Struct, kw_only=True):
    """A version that was put in force; `number` below `after`: it was gone back to."""

    t_s: float
    number: int
    after: int
    later: list[Chunk] = []


class CarFound(msgspec.Struct, kw_only=True):
    """What the twin part found of one car.

    Attributes:
        driven: Time in the city, and how long the car was driven and watched until then [s].
        changes: By when they were noticed, as they were known in the end.
        ended_s: When the search for each was over, by the same.
    """

    driven: list[tuple[float, float]] = []
    changes: dict[int, TwinChange] = {}
    ended_s: dict[int, float] = {}
    versions: dict[int, TwinVersion] = {}
    adopted: list[Adopted] = []


class CityFound(msgspec.Struct, kw_only=True):
    """What a city found; times are seconds since its begin, those of changes as in its messages."""

    begin_ns: int
    lasted_s: float
    cars: dict[str, CarFound]
    contacts: int = 0
    cpu_s: float = 0.0
    search_cpu_s: float = 0.0
    wall_s: float = 0.0


class _Counted(AtOnce):
    """Runs searches at once, and counts their processor time."""

    def __init__(self) -> None:
        self.spent_s, self._clock = 0.0, ProcessorClock()

    def submit(self, function: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        begun_ns = self._clock.now_ns()
        found = super().submit(function, *args, **kwargs)
        self.spent_s += seconds(self._clock.now_ns() - begun_ns)
        return found


def scene_of(request: CityRequest) -> tuple[Any, np.random.Generator]:
    """Draw the scene of a city; return it, and the generator that drew it.

    Raises:
        RunError: without a clone, or without the engine.
    """
    rng = np.random.default_rng([request.seed, request.number, *b"live"])
    scene = reality("scenes").draw_scene(
        request.names, 3600.0 * request.hours, rng, car=CAR, cameras=CAMERAS,
        places=_places(load_map(request.map)), strengths=request.strength,
        moving=engine_of(request.engine), healthy=request.healthy,
    )  # fmt: skip
    return scene, rng


def _places(city_map: CityMap) -> list[tuple[float, float]]:
    """Return places where cars drive."""
    found = list[tuple[float, float]]()
    for lane in city_map.lanes:
        line = LanePath(lane)
        spots = (line.at(float(s)) for s in np.arange(0.0, line.length_m, PLACES_M))
        found += [(spot.x, spot.y) for spot in spots]
    return found


def parts_of(request: CityRequest, scene: Any) -> list[Part]:
    """Return the parts of a city but for the twin part: its cars and cameras are of the scene."""
    city_map, engine = load_map(request.map), engine_of(request.engine)
    parts: list[Part] = [TrafficPart(city_map), WorldPart(city_map, request.seed)]
    for k, name in enumerate(request.names):
        noise = np.random.default_rng([request.seed, request.number, k])
        body = _body(engine, scene, name, noise)
        kind = BodyKind("remote", lambda *_, body=body: body)
        parts.append(AgentPart(name, CAR, seed=k, body=kind))
    (x0, x1), noise = city_map.floor.x_m, np.random.default_rng([request.seed, request.number])
    middle = 0.5 * (x0 + x1)
    views = [View("west", (x0, middle)), View("east", (middle, x1))]
    edges = {"west": x0 - BEYOND_M, "east": x1 + BEYOND_M}
    seen = sees(scene.camera_faults, scene.faults, edges, reality("sensing").seen)
    return [*parts, PosesEye(views, seen, noise, BEGIN_NS)]


def _body(engine: Any, scene: Any, name: str, noise: np.random.Generator) -> RealityBody:
    def t_s(now_ns: int) -> float:
        return max(seconds(now_ns - BEGIN_NS), 0.0)

    return RealityBody(
        CAR, engine, lambda now_ns, pose: scene.numbers(name, t_s(now_ns), pose.x, pose.y), noise,
        lambda now_ns, _: scene.faults(name, t_s(now_ns)),
    )  # fmt: skip


class _Listener:
    """Collects what the twin part says, and driving after a version was put in force."""

    def __init__(self, city: Lockstep, request: CityRequest) -> None:
        kinds = (TwinStatus, CityEvent, VehicleState, VehicleSensors, EyePose)
        self._boxes = [city.subscribe(Subscription(kind)) for kind in kinds]
        self.found = CityFound(
            begin_ns=BEGIN_NS, lasted_s=0.0, cars={name: CarFound() for name in request.names}
        )
        self._in_force = dict.fromkeys(request.names, 0)
        self._later = dict[str, CarMessages]()  # of cars of which later driving is collected

    def listen(self, now_s: float) -> None:
        """Take what came."""
        for message in (item.message for box in self._boxes for item in box.drain()):
            match message:
                case TwinStatus(vehicle=name) if name in self.found.cars:
                    self._status(message, now_s)
                case CityEvent(name="contact"):
                    self.found.contacts += 1
                case VehicleState() | VehicleSensors() | EyePose():
                    if message.vehicle in self._later:
                        self._later[message.vehicle].add(message)
                case _:
                    pass
        self.found.lasted_s = now_s
        for name in list(self._later):
            if now_s - self.found.cars[name].adopted[-1].t_s >= LATER_S:
                self.compare(name)

    def _status(self, status: TwinStatus, now_s: float) -> None:
        car = self.found.cars[status.vehicle]
        car.driven.append((seconds(status.t_ns - BEGIN_NS), status.driven_s))
        for change in status.changes:
            car.changes[change.noticed_ns] = change
            if change.search in ENDED:
                car.ended_s.setdefault(change.noticed_ns, now_s)
        car.versions |= {one.number: one for one in status.versions}
        before = self._in_force[status.vehicle]
        if status.version != before:
            self.compare(status.vehicle)
            self._in_force[status.vehicle] = status.version
            car.adopted.append(Adopted(t_s=now_s, number=status.version, after=before))
            self._later[status.vehicle] = CarMessages()

    def compare(self, name: str) -> None:
        """Compare the version in force with the one before it on what was driven since."""
        messages, car = self._later.pop(name, None), self.found.cars[name]
        if messages is None:
            return
        new = car.adopted[-1]
        files = [car.versions[number].file for number in (new.after, new.number)]
        try:
            recording = recording_of(seen_by_eye(messages), Path(name), name, BEGIN_NS)
        except ScmError:
            return  # it was not driven since
        recording = replace(recording, begin_s=0.0)
        for begins_s in np.arange(new.t_s, new.t_s + LATER_S, CHUNK_S).tolist():
            try:
                done = compare(part_of(recording, begins_s, begins_s + CHUNK_S), *files)
            except ScmError:
                continue  # it stood, or the city ended
            (position,) = [one for one in done.errors if one.name == "position_m"]
            new.later.append(
                Chunk(
                    begins_s=begins_s, ends_s=begins_s + CHUNK_S, windows=done.windows,
                    before_m=position.before, now_m=position.now,
                )
            )  # fmt: skip


def play(request: CityRequest, folder: Path, notify: Callable[[float], None] | None = None) -> Path:
    """Let a city run, and write what it found; return the file.

    Args:
        request: Which city.
        folder: For what the twin part writes, and for this file.
        notify: Receives how much of the city's time is over [s].

    Raises:
        ScmError: when it cannot run.
    """
    scene, _ = scene_of(request)
    found = played(request, parts_of(request, scene), folder, notify)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / FOUND_FILE
    path.write_bytes(msgspec.json.format(msgspec.json.encode(found), indent=1))
    return path


def played(
    request: CityRequest, parts: Sequence[Part], folder: Path,
    notify: Callable[[float], None] | None = None,
) -> CityFound:  # fmt: skip
    """Let parts run beside a twin part; return what this finds."""
    executor, processor = _Counted(), ProcessorClock()
    begun_ns, begun_s = processor.now_ns(), time.monotonic()
    with Lockstep(parts, start_ns=BEGIN_NS) as city:
        data = folder / "twin" if request.search else None
        city.add(TwinPart(request.false_alarm_h, data, request.budget_s, executor))
        listener = _Listener(city, request)
        for k in range(1, round(3600.0 * request.hours / STEP_S) + 1):
            city.run_for(STEP_S)
            listener.listen(k * STEP_S)
            if notify is not None:
                notify(k * STEP_S)
    for name in request.names:
        listener.compare(name)
    found = listener.found
    found.cpu_s = seconds(processor.now_ns() - begun_ns)
    found.search_cpu_s, found.wall_s = executor.spent_s, time.monotonic() - begun_s
    return found
