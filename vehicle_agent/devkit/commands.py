"""What a script says, read key by key: what cannot be read is told once and costs nothing else.

    V1 Throttle, Steering         -1 to 1, + = forward, + = left; beyond that they are cut
    V1 Headlights                 0 off, 1 low, 2 high
    V1 Indicators                 0 off, 1 left, 2 right, 3 hazard
    V1 Brake, Handbrake           above 0: no throttle, the motors brake
    V1 Reset                      1: the car back to its place
    V1 CoSim, PosX ... RotW       1: the pose of the car [m], a quaternion
    TL1 State                     0 no wish, 1 red, 2 yellow, 3 green

Scripts of version 0.1 say `Throttle` and `Traffic Light 1` for `V1 Throttle` and `TL1 State`.
Everything is a string; numbers are taken too. A car whose throttle cannot be read gets none.
"""

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from scm.log import event
from scm.vehicles.lights import Headlights, Indicators

MOST_STRANGE = 100
MOST_SHOWN = 40
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
class CarWish:
    """What a script wants of one car.

    Attributes:
        throttle: -1 to 1, + = forward; likewise `steering`, + = left.
        pose: Where it puts the car itself: x, y [m] and yaw [rad]; None: it drives.
    """

    throttle: float = 0.0
    steering: float = 0.0
    headlights: Headlights | None = None
    indicators: Indicators | None = None
    reset: bool = False
    pose: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class Wishes:
    """What a script said at once; `lights` as it numbers colours, None: nothing."""

    cars: tuple[CarWish, ...]
    lights: tuple[int | None, ...]


class Commands:
    """Reads what a script says.

    Args:
        cars: How many it drives.
        sign: Which way + steers.
    """

    def __init__(self, cars: int, sign: Sign = "left") -> None:
        self._cars = cars
        self._sign = 1.0 if sign == "left" else -1.0
        self._steering = [0.0] * cars
        self._keys = hash(frozenset[str]())
        self._told: set[str] = set()
        self._strange = 0
        self.lights = 0

    @property
    def complaints(self) -> frozenset[str]:
        """What was told so far, each once."""
        return frozenset(self._told)

    def read(self, data: Any) -> Wishes:
        """Return what a payload wishes."""
        if not isinstance(data, Mapping):
            self._complain(f"a reply is {type(data).__name__}, expected an object of keys")
            data = {}
        said = {_OLD.get(str(key), str(key)): value for key, value in data.items()}
        keys = frozenset(said)
        if hash(keys) != self._keys:
            self._check_keys(keys)
            self._keys = hash(keys)
        return Wishes(
            tuple(self._car(said, number) for number in range(self._cars)),
            tuple(
                self._choice(said, f"TL{number} State", (0, 1, 2, 3))
                for number in range(1, self.lights + 1)
            ),
        )

    def _check_keys(self, keys: frozenset[str]) -> None:
        known = {f"V{n}": _OF_CAR for n in range(1, self._cars + 1)}
        for key in sorted(keys):
            what, _, name = key.partition(" ")
            if key in _NOT_CARRIED:
                self._complain(f"{key!r}: not carried, the city has no such thing")
            elif what in known and name not in known[what]:
                self._complain_strange(key, f"not known, expected one of {', '.join(_OF_CAR)}")
            elif what not in known and not self._is_light(key):
                here = f"V1 to V{self._cars}, TL1 to TL{self.lights}"
                self._complain_strange(key, f"nothing here is called so, only {here}")

    def _is_light(self, key: str) -> bool:
        return key in {f"TL{n} State" for n in range(1, self.lights + 1)}

    def _car(self, said: Mapping[str, Any], index: int) -> CarWish:
        prefix = f"V{index + 1}"
        throttle = self._unit(said, f"{prefix} Throttle")
        steering = self._unit(said, f"{prefix} Steering")
        if steering is not None:
            self._steering[index] = self._sign * steering
        brake = self._number(said, f"{prefix} Brake") or 0.0
        braked = max(brake, self._number(said, f"{prefix} Handbrake") or 0.0) > 0.0
        head = self._choice(said, f"{prefix} Headlights", (0, 1, 2))
        turn = self._choice(said, f"{prefix} Indicators", (0, 1, 2, 3))
        return CarWish(
            throttle=0.0 if braked or throttle is None else throttle,
            steering=self._steering[index],
            headlights=None if head is None else _HEADLIGHTS[head],
            indicators=None if turn is None else _INDICATORS[turn],
            reset=_is_yes(said.get(f"{prefix} Reset")),
            pose=self._pose(said, prefix),
        )

    def _pose(self, said: Mapping[str, Any], prefix: str) -> tuple[float, float, float] | None:
        if not _is_yes(said.get(f"{prefix} CoSim")):
            return None
        keys = [f"{prefix} {key}" for key in _COSIM]
        numbers = [self._number(said, key) for key in keys]
        missing = [key for key, number in zip(keys, numbers, strict=True) if number is None]
        if missing:
            self._complain(f"{prefix} CoSim: needs all of {', '.join(_COSIM)}")
            return None
        x, y, _, qx, qy, qz, qw = (number or 0.0 for number in numbers)
        if not 0.5 < math.hypot(qx, qy, qz, qw) < 2.0:
            self._complain(f"{prefix} RotX to RotW: no rotation, expected a quaternion of length 1")
            return None
        return x, y, math.atan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)

    def _number(self, said: Mapping[str, Any], key: str) -> float | None:
        if key not in said:
            return None
        value = said[key]
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if not math.isfinite(number):
            got = repr(value[:MOST_SHOWN]) if isinstance(value, str) else type(value).__name__
            self._complain(f"{key}: got {got}, expected a number")
            return None
        return number

    def _unit(self, said: Mapping[str, Any], key: str) -> float | None:
        if key not in said:
            self._complain(f"{key}: not said, expected a number from -1 to 1")
            return None
        number = self._number(said, key)
        if number is not None and abs(number) > 1.0:
            self._complain(f"{key}: got {number:g}, expected -1 to 1: it is cut")
            number = math.copysign(1.0, number)
        return number

    def _choice(self, said: Mapping[str, Any], key: str, choices: tuple[int, ...]) -> int | None:
        number = self._number(said, key)
        if number is None:
            return None
        if number not in choices:
            self._complain(f"{key}: got {number:g}, expected one of {choices}")
            return None
        return int(number)

    def _complain_strange(self, key: str, why: str) -> None:
        """Tell of a key that nobody knows, cut; there may be no end of them."""
        if self._strange < MOST_STRANGE:
            self._strange += self._complain(f"{key[:MOST_SHOWN]!r}: {why}")

    def _complain(self, what: str) -> bool:
        """Tell it once; return whether it is new."""
        where = what.partition(": got")[0]
        is_new = where not in self._told
        if is_new:
            self._told.add(where)
            event(_log, "devkit_command", level=logging.WARNING, why=repr(what))
        return is_new


def _is_yes(value: Any) -> bool:
    if isinstance(value, int | float):
        return value == 1
    return isinstance(value, str) and value.strip().lower() in _YES
