"""A car of the independent reality, `tests/reality`, as a body: the city does not know its physics.

Another simulator moves it, by commands that it holds for a cycle. Its numbers may change while it
drives, which nobody reports. Its agent reports where it is, so that the world can place it among
others, but contacts do not move it, and its floor is level but for what its numbers say. The
reality comes with a clone of the repository; it is not part of the installed package.
"""

import importlib
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.errors import CarError, RunError
from scm.geometry import TAU, Pose2
from scm.records.city_map import CityMap
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import load_car
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.lights import Switches
from vehicle_agent.body import Body, BodyKind, Motion, Wiring

REALITY = "tests.reality"
COMMAND_NS = 20 * NS_PER_MS  # of an agent
MORE_COMMANDS = 30_000
STEERING_STD_RAD = 0.002  # of the potentiometer
GRAVITY = 9.80665
COURSES = ("step", "ramp", "intermittent")

Numbers = Callable[[int, Pose2], Mapping[str, float]]
"""Of a car at a time [ns] and a place; the same object for as long as they are the same."""


def reality(module: str) -> Any:
    """Return a module of the reality.

    Raises:
        RunError: without a clone.
    """
    name = f"{REALITY}.{module}"
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if not f"{name}.".startswith(f"{error.name}."):
            raise  # of a package that it needs
        msg = (
            "cars of the independent reality come with the repository, not with the installed "
            f"package: run this in a clone of it (no {error.name})"
        )
        raise RunError(msg) from error


def engine_of(name: str) -> Any:
    """Return what moves cars of the reality.

    Raises:
        RunError: when there is no such engine, or its package is missing.
    """
    engine = reality("engine")
    if name not in engine.ENGINES:
        msg = f"--engine: expected one of {', '.join(engine.ENGINES)}, got {name!r}"
        raise RunError(msg)
    try:
        return engine.find_engine(name)
    except ModuleNotFoundError as error:
        raise RunError(str(error)) from error


class RealityBody:
    """One car.

    Args:
        car: Its file's name.
        engine: What moves it, of `engine_of`.
        numbers: Of the car.
        rng: Of its sensors' noise.
        faults: Of its sensors; None: they have none.
        command_ns: For how long it holds a command.
    """

    wants_eye = False

    def __init__(
        self, car: str, engine: Any, numbers: Numbers, rng: np.random.Generator,
        faults: Numbers | None = None, command_ns: int = COMMAND_NS,
    ) -> None:  # fmt: skip
        self.limits = limits_of(load_car(car))
        self._engine, self._numbers, self._rng = engine, numbers, rng
        none = reality("sensing").FAULTS
        self._faults = faults or (lambda _now_ns, _pose: none)
        self._row_ns, self._command_ns = round(reality("motion").ROW_S * NS_PER_S), command_ns
        self._command, self._count = (0.0, 0.0), 0
        self._turned, self._counted = np.zeros(2), np.zeros(2)
        self._place_at(Pose2(0.0, 0.0, 0.0), 0)

    def learn(self, city_map: CityMap, seed: int) -> None:
        """Do nothing: its floor is its own."""

    def place(self, pose: Pose2, now_ns: int) -> None:
        """Stand at a pose."""
        self._place_at(pose, now_ns)

    def _place_at(self, pose: Pose2, now_ns: int) -> None:
        self.pose, self._begin_ns, self._count = pose, now_ns, 0
        self._now = self._numbers(now_ns, pose)
        self._car = self._engine(self._held(self._now), tuple(pose), MORE_COMMANDS)
        self._rows = np.array([[0.0, *pose, *np.zeros(7)]])
        self._row, self._turned = self._rows[0], np.zeros(2)

    def _held(self, numbers: Mapping[str, float]) -> dict[str, float]:
        return {**numbers, "command": seconds(self._command_ns)}

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Do nothing: it needs no Eye."""

    def was_lifted(self) -> bool:
        """Return False: nobody lifts it."""
        return False

    def inhibit_reason(self, now_ns: int) -> str:
        """Return an empty reason: it may always move."""
        del now_ns
        return ""

    def advance(self, now_ns: int) -> None:
        """Advance to now; the command of a cycle's beginning acts to its end."""
        while self._begin_ns + self._count * self._command_ns < now_ns:
            self._cycle(self._begin_ns + self._count * self._command_ns)
        over_ns = self._begin_ns + self._count * self._command_ns - now_ns
        left = max(0, over_ns // self._row_ns)
        self._row = self._rows[max(len(self._rows) - 1 - left, 0)]
        self.pose = Pose2(*map(float, self._row[1:4]))

    def _cycle(self, now_ns: int) -> None:
        numbers = self._numbers(now_ns, self.pose)
        if numbers is not self._now:
            self._now = numbers
            self._car.become(self._held(numbers))
        if self._count == len(self._car.throttle):
            for name in ("throttle", "steering", "shake"):
                given = getattr(self._car, name)
                setattr(self._car, name, np.concatenate((given, np.zeros(MORE_COMMANDS))))
        throttle, steering = self._command
        least = getattr(self._engine, "least_throttle", -1.0)
        self._rows = self._car.command(self._count, max(throttle, least), steering)
        self._count += 1

    def command(self, throttle: float, steering: float) -> None:
        """Apply a command from the next cycle on."""
        self._command = throttle, steering

    def obeyed(self) -> None:
        """Return None: each command is sent when it is given."""

    def show(self, switches: Switches) -> None:
        """Do nothing: it has no lamps."""

    def push(self, contact: Contact) -> None:
        """Do nothing: it drives on through what it meets."""

    def motion(self) -> Motion:
        """Return how it moves."""
        speed, across, rate, accel = map(float, self._row[4:8])
        across -= rate * self._now["cog"]  # a row has the centre of gravity's
        return Motion(self.pose, speed, across, rate, accel, self._angle(), "simulated")

    def sensors(self, vehicle: str, now_ns: int, *, wanted: bool = True) -> list[VehicleSensors]:
        """Return what its sensors measure."""
        fault, noise = self._faults(now_ns, self.pose), self._rng.standard_normal
        turned = self._row[9:11]
        counts = self._now["counts"] * (1.0 - fault["lost_counts"]) / TAU
        self._counted = self._counted + counts * (turned - self._turned)
        self._turned = turned.copy()
        if not wanted:
            return []
        left, right = map(math.floor, self._counted)
        gyro = fault["gyro_scale"] * self._row[6] + fault["gyro_bias"]
        along, across = self._row[7:9] + self._now["accel_noise"] * noise(2)
        return [
            VehicleSensors(
                vehicle=vehicle, t_ns=now_ns, encoder_left=left, encoder_right=right,
                accel_mps2=(float(along), float(across), GRAVITY),
                gyro_radps=(0.0, 0.0, float(gyro + self._now["gyro_noise"] * noise())),
                steering_rad=self._angle() + STEERING_STD_RAD * noise(),
            )
        ]  # fmt: skip

    def close(self) -> None:
        """Do nothing: it holds no resources."""

    def _angle(self) -> float:
        return float(self._car.state["angle"][0])


def changing(
    car: str, seed: int, engine: str, effect: str = "", course: str = "step",
    strength: float = 2.0, after_s: float = 0.0, lasts_s: float = 120.0,
) -> RealityBody:  # fmt: skip
    """Return a car that is scattered as its kind is, and later has an effect.

    Args:
        car: Its file's name.
        seed: Of all its randomness.
        engine: By name.
        effect: By name; `drawn`: any; empty: none.
        course: One of `COURSES`.
        strength: In multiples of the smallest size that 90 s of driving can show.
        after_s: When it begins, since the car's first placement.
        lasts_s: Until a ramp is complete, or what came is gone.

    Raises:
        RunError: when something is not possible, with what is.
    """
    moving, rng = engine_of(engine), np.random.default_rng([seed, *b"reality"])
    numbers, scenes = reality("numbers"), reality("scenes")
    if not (numbers.TYPES / f"{car}.toml").is_file():
        raise CarError(f"--car: a car of the reality is a kind of car by name, got {car!r}")
    usual, events = numbers.scattered(numbers.nominal(car), rng), []
    can = scenes.of_cars(car, moving)
    if effect:
        name = str(rng.choice(can)) if effect == "drawn" else effect
        if name not in can:
            msg = f"--conceal: {engine} cars can have {', '.join(can)}, or drawn; got {effect!r}"
            raise RunError(msg)
        drawn = reality("cases").draw_effects((name,), car, (strength, strength), rng)
        until_s = after_s + (lasts_s if course == "ramp" else 0.0)
        back_s = after_s + lasts_s if course == "intermittent" else math.inf
        events = [scenes.Event("car", "", course, tuple(drawn), after_s, until_s, back_s)]
    scene, begun = scenes.Scene({"": usual}, events), list[int]()

    def since_s(now_ns: int) -> float:
        if not begun and now_ns:
            begun.append(now_ns)
        return seconds(now_ns - begun[0]) if begun else 0.0

    return RealityBody(
        car, moving, lambda now_ns, pose: scene.numbers("", since_s(now_ns), pose.x, pose.y), rng,
        lambda now_ns, _: scene.faults("", since_s(now_ns)),
    )  # fmt: skip


def _open(car: str, seed: int, wiring: Wiring) -> Body:
    del wiring
    return changing(car, seed, "own")


BODY = BodyKind(kind="remote", open=_open)
