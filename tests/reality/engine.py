"""Engines: what moves a car's bodies. `own` are our equations, the others are other people's.

Steering, drive and outside forces are the laws of `motion` in every engine.
"""

import hashlib
import importlib
import math
from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

import numpy as np
from numba import config, njit

from tests.reality import motion
from tests.reality.motion import NUMBERS, ROW_S, STATE, WHEEL

ENGINES = {
    "own": ("tests.reality.motion", ""),
    "mujoco": ("tests.reality.in_mujoco", "mujoco-core"),
    "commonroad": ("tests.reality.in_commonroad", "commonroad-vehicle-models"),
    "pybullet": ("tests.reality.in_pybullet", "pybullet"),
}
"""Of each engine the module whose `Moving` it is, and the package that it needs."""


def find_engine(name: str) -> type:
    """Return an engine's `Moving`.

    Raises:
        ModuleNotFoundError: says what to install, where its package is missing.
    """
    module, package = ENGINES[name]
    try:
        return importlib.import_module(module).Moving
    except ModuleNotFoundError as error:
        msg = f"--engine {name} needs {error.name}: pip install {package}"
        raise ModuleNotFoundError(msg) from error


def cache_folder(files, within):
    """Return a folder for code that is compiled from files, as they are now."""
    digest = hashlib.sha256()
    for file in files:
        digest.update(Path(file).read_bytes() + b"\0")
    return Path(within) / digest.hexdigest()[:16]


def kernel(*others):
    """Compile a function that calls laws of other files, cached until one of them has changed.

    Those are all files of this folder, and `others`: numba itself sees only the function's own.
    """

    def compiled(function):
        here, before = Path(__file__).parent, config.CACHE_DIR
        files = (*sorted(here.glob("*.py")), *others)
        config.CACHE_DIR = str(cache_folder(files, here / "__pycache__"))
        try:
            return njit(function, cache=True)  # where it is cached is decided now
        finally:
            config.CACHE_DIR = before

    return compiled


@njit(cache=True)
def see(c, s, place, moves):
    """Fill our own state from a rigid body's; the heading goes on turning beyond pi.

    Args:
        place: Of the centre of gravity, then the quaternion (w, x, y, z).
        moves: Velocity of the centre of gravity, then the rate of turn, whose last is of yaw.
    """
    w, x, y, z = place[3], place[4], place[5], place[6]
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    s.yaw += (yaw - s.yaw + math.pi) % (2.0 * math.pi) - math.pi
    cos, sin = math.cos(s.yaw), math.sin(s.yaw)
    s.x, s.y = place[0] - c.cog * cos, place[1] - c.cog * sin
    s.vx, s.vy = cos * moves[0] + sin * moves[1], cos * moves[1] - sin * moves[0]
    s.yaw_rate = moves[5]
    s.roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    s.pitch = math.asin(2.0 * (w * y - x * z))


class Engine(ABC):
    """A car on the floor that another engine moves, driven by commands of 20 Hz.

    Used as `motion.Moving`, which is not one of these: our equations need no other bodies.

    Attributes:
        lacks: Numbers, by name, that have no place in this engine: effects on them do nothing.
        fixed: Aspects of a family, with their values, that are always the same here.
        terms: In place of terms of the car file, those that this engine's car has.
        shaping: Numbers that the bodies are built with.
        least_throttle: Smallest that a driver gives: 0 where the car cannot drive backwards.
        step_s: The engine's own; None: that of the numbers.
    """

    lacks: ClassVar[frozenset[str]] = frozenset()
    fixed: ClassVar[dict[str, str]] = {"suspension": "sprung", "body": "semi_implicit"}
    terms: ClassVar[dict[str, str]] = {}
    shaping: ClassVar[tuple[str, ...]] = ()
    least_throttle: ClassVar[float] = -1.0
    step_s: ClassVar[float | None] = None

    def __init__(self, numbers, pose, commands, shake=None):
        self.numbers = np.zeros(1, NUMBERS)
        self._fill(numbers)
        self.state = np.zeros(1, STATE)
        self.state["x"], self.state["y"], self.state["yaw"] = pose
        self.wheels = np.zeros((4, len(WHEEL)))
        self.wheels[:, WHEEL.index("strength")] = 1.0
        self.throttle, self.steering = np.zeros(commands), np.zeros(commands)
        self.shake = np.zeros(commands) if shake is None else shake
        self._build(numbers)

    @classmethod
    def stated(cls, numbers):
        """Return what the file of a nominal car must say of this engine's car, by file key."""
        del numbers
        return {}

    def _fill(self, numbers):
        self.given = dict(numbers)
        for name in NUMBERS.names:
            self.numbers[name] = numbers[name]
        self.numbers["step"] = self.step_s or numbers["step"]

    def become(self, numbers):
        """Drive on with other numbers."""
        before = self.given
        self._fill(numbers)
        if any(before[name] != numbers[name] for name in self.shaping):
            self._build(numbers)

    @abstractmethod
    def _build(self, numbers):
        """Build the car of some numbers, or build it again where it drives already."""

    @abstractmethod
    def _row(self, row, out):
        """Advance by one row of 2.5 ms, and fill it."""

    def _note(self, row, out, gain, over):
        """Fill a row from our own state.

        Args:
            gain: Acceleration [m/s^2], the mean of the last `over` seconds.
        """
        s = self.state[0]
        middle = s["yaw"] - 0.5 * over * s["yaw_rate"]
        cos, sin = math.cos(middle), math.sin(middle)
        out[:4] = (row + 1) * ROW_S, *motion.under_axle(self.numbers[0], s), s["yaw"]
        out[4:7] = s["vx"], s["vy"], s["yaw_rate"]
        out[7:9] = cos * gain[0] + sin * gain[1], cos * gain[1] - sin * gain[0]
        out[9:11] = self.wheels[2, 1], self.wheels[3, 1]

    def command(self, k, throttle, steering):
        """Give command `k`, drive until the next one is due, and return the new rows."""
        self.throttle[k], self.steering[k] = throttle, steering
        count = motion.rows_per_command(self.numbers)
        out = np.empty((count, len(motion.ROW)))
        for row in range(count):
            self._row(k * count + row, out[row])
        return out
