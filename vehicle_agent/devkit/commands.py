"""A script's reply, read key by key: an invalid value is logged once and affects nothing else.

    V1 Throttle, Steering         -1 to 1, + = forward, + = left; clipped
    V1 Headlights                 0 off, 1 low, 2 high
    V1 Indicators                 0 off, 1 left, 2 right, 3 hazard
    V1 Brake, Handbrake           above 0: no throttle, the motors brake
    V1 Reset                      1: the car back to its place
    V1 CoSim, PosX ... RotW       1: the pose of the car [m], a quaternion
    TL1 State                     0 no request, 1 red, 2 yellow, 3 green

Scripts of version 0.1 send `Throttle` and `Traffic Light 1` for `V1 Throttle` and `TL1 State`.
Values are strings; numbers are accepted too. A car whose throttle cannot be read gets none.
"""

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from scm.log import event
from scm.vehicles.lights import Headlights, Indicators

MAX_UNKNOWN_KEYS = 100
MAX_SHOWN_CHARS = 40
Sign = Literal["left", "right"]
_HEADLIGHTS: tuple[Headlights, ...] = ("off", "low", "high")
_INDICATORS: tuple[Indicators, ...] = ("off", "left", "right", "hazard")
_COSIM = ("PosX", "PosY", "PosZ", "RotX", "RotY", "RotZ", "RotW")
_OF_CAR = (
    "Throttle", "Steering", "Headlights", "Indicators", "Brake", "Handbrake", "Reset", "CoSim",
    *_COSIM,
)  # fmt: skip
_OLD = {key: f"V1 {key}" for key in ("Throttle", "Steering", "Headlights", "Indicators")}
_OLD |= {f"Traffic Light {number}": f"TL{number} State" for number in range(1, 5)}
_NOT_CARRIED = ("Auto Time", "Time Scale", "Time", "Weather", "Clouds", "Fog", "Rain", "Snow")
_YES = ("1", "true")

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class CarCommand:
    """A script's command for one car.

    Attributes:
        throttle: -1 to 1, + = forward; likewise `steering`, + = left.
        pose: Where it places the car: x, y [m] and yaw [rad]; None: the car drives.
    """

    throttle: float = 0.0
    steering: float = 0.0
    headlights: Headlights | None = None
    indicators: Indicators | None = None
    reset: bool = False
    pose: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class ScriptCommand:
    """One reply of a script; `lights` as it numbers colours, None: not set."""

    cars: tuple[CarCommand, ...]
    lights: tuple[int | None, ...]


class Commands:
    """Reads a script's replies.

    Args:
        cars: Number of cars it drives.
        sign: Direction of positive steering.
    """

    def __init__(self, cars: int, sign: Sign = "left") -> None:
        self._cars = cars
        self._sign = 1.0 if sign == "left" else -1.0
        self._steering = [0.0] * cars
        self._keys = hash(frozenset[str]())
        self._complaints: set[str] = set()
        self._unknown_keys = 0
        self.lights = 0

    @property
    def complaints(self) -> frozenset[str]:
        """The complaints logged so far, each once."""
        return frozenset(self._complaints)

    def read(self, data: Any) -> ScriptCommand:
        """Return the commands in a payload."""
        if not isinstance(data, Mapping):
            self._complain(f"a reply is {type(data).__name__}, expected an object of keys")
            data = {}
        values = {_OLD.get(str(key), str(key)): value for key, value in data.items()}
        keys = frozenset(values)
        if hash(keys) != self._keys:
            self._check_keys(keys)
            self._keys = hash(keys)
        return ScriptCommand(
            tuple(self._car(values, number) for number in range(self._cars)),
            tuple(
                self._choice(values, f"TL{number} State", (0, 1, 2, 3))
                for number in range(1, self.lights + 1)
            ),
        )

    def _check_keys(self, keys: frozenset[str]) -> None:
        known = {f"V{n}": _OF_CAR for n in range(1, self._cars + 1)}
        for key in sorted(keys):
            what, _, name = key.partition(" ")
            if key in _NOT_CARRIED:
                self._complain(f"{key!r}: not supported, the city has no such thing")
            elif what in known and name not in known[what]:
                self._complain_unknown(key, f"not known, expected one of {', '.join(_OF_CAR)}")
            elif what not in known and not self._is_light(key):
                here = f"V1 to V{self._cars}, TL1 to TL{self.lights}"
                self._complain_unknown(key, f"unknown, expected {here}")

    def _is_light(self, key: str) -> bool:
        return key in {f"TL{n} State" for n in range(1, self.lights + 1)}

    def _car(self, values: Mapping[str, Any], index: int) -> CarCommand:
        prefix = f"V{index + 1}"
        throttle = self._unit(values, f"{prefix} Throttle")
        steering = self._unit(values, f"{prefix} Steering")
        if steering is not None:
            self._steering[index] = self._sign * steering
        brake = self._number(values, f"{prefix} Brake") or 0.0
        braked = max(brake, self._number(values, f"{prefix} Handbrake") or 0.0) > 0.0
        head = self._choice(values, f"{prefix} Headlights", (0, 1, 2))
        turn = self._choice(values, f"{prefix} Indicators", (0, 1, 2, 3))
        return CarCommand(
            throttle=0.0 if braked or throttle is None else throttle,
            steering=self._steering[index],
            headlights=None if head is None else _HEADLIGHTS[head],
            indicators=None if turn is None else _INDICATORS[turn],
            reset=_is_yes(values.get(f"{prefix} Reset")),
            pose=self._pose(values, prefix),
        )

    def _pose(self, values: Mapping[str, Any], prefix: str) -> tuple[float, float, float] | None:
        if not _is_yes(values.get(f"{prefix} CoSim")):
            return None
        keys = [f"{prefix} {key}" for key in _COSIM]
        numbers = [self._number(values, key) for key in keys]
        missing = [key for key, number in zip(keys, numbers, strict=True) if number is None]
        if missing:
            self._complain(f"{prefix} CoSim: needs all of {', '.join(_COSIM)}")
            return None
        x, y, _, qx, qy, qz, qw = (number or 0.0 for number in numbers)
        if not 0.5 < math.hypot(qx, qy, qz, qw) < 2.0:
            self._complain(f"{prefix} RotX to RotW: no rotation, expected a quaternion of length 1")
            return None
        return x, y, math.atan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)

    def _number(self, values: Mapping[str, Any], key: str) -> float | None:
        if key not in values:
            return None
        value = values[key]
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if not math.isfinite(number):
            got = repr(value[:MAX_SHOWN_CHARS]) if isinstance(value, str) else type(value).__name__
            self._complain(f"{key}: got {got}, expected a number")
            return None
        return number

    def _unit(self, values: Mapping[str, Any], key: str) -> float | None:
        if key not in values:
            self._complain(f"{key}: missing, expected a number from -1 to 1")
            return None
        number = self._number(values, key)
        if number is not None and abs(number) > 1.0:
            self._complain(f"{key}: got {number:g}, expected -1 to 1: it is clipped")
            number = math.copysign(1.0, number)
        return number

    def _choice(self, values: Mapping[str, Any], key: str, choices: tuple[int, ...]) -> int | None:
        number = self._number(values, key)
        if number is None:
            return None
        if number not in choices:
            self._complain(f"{key}: got {number:g}, expected one of {choices}")
            return None
        return int(number)

    def _complain_unknown(self, key: str, why: str) -> None:
        """Log an unknown key, shortened; their number is limited."""
        if self._unknown_keys < MAX_UNKNOWN_KEYS:
            self._unknown_keys += self._complain(f"{key[:MAX_SHOWN_CHARS]!r}: {why}")

    def _complain(self, what: str) -> bool:
        """Log a complaint once; return whether it is new."""
        where = what.partition(": got")[0]
        is_new = where not in self._complaints
        if is_new:
            self._complaints.add(where)
            event(_log, "devkit_command", level=logging.WARNING, why=repr(what))
        return is_new


def _is_yes(value: Any) -> bool:
    if isinstance(value, int | float):
        return value == 1
    return isinstance(value, str) and value.strip().lower() in _YES
