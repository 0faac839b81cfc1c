"""Faults of a cheap cable and a weak battery: planned, or random from a seed.

noise=HZ  flip=P  lose=P  cut=P         random bytes per second; per byte; per burst
reset=HZ  brownout=HZ  unplug=HZ        on average so often
reset@T   brownout@T   unplug@T[:FOR]   at T seconds after the start, for FOR seconds
"""

import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

from scm.clock import nanoseconds, seconds
from scm.errors import RunError, nearest

EventKind = Literal["reset", "brownout", "unplug"]
EVENTS: tuple[str, ...] = get_args(EventKind)
RATES = ("noise", "flip", "lose", "cut", *EVENTS)
PER_SECOND = ("noise", *EVENTS)
DEFAULT_UNPLUGGED_S = 3.0


@dataclass(frozen=True, slots=True)
class Event:
    """A fault of the whole device.

    Attributes:
        at_s: After the start.
        for_s: How long the cable is unplugged, for `unplug`.
    """

    at_s: float
    kind: str
    for_s: float = DEFAULT_UNPLUGGED_S


@dataclass(frozen=True, slots=True)
class Faults:
    """A plan of faults.

    Attributes:
        rates: By name: per second, per byte or per burst, see the module.
        events: In the order of their times.
    """

    rates: dict[str, float] = field(default_factory=dict)
    events: tuple[Event, ...] = ()


def read_faults(texts: Sequence[str]) -> Faults:
    """Parse the plan of the command line.

    Raises:
        RunError: naming the invalid word.
    """
    rates, events = dict[str, float](), list[Event]()
    for text in texts:
        name, is_at, value = text.partition("@" if "@" in text else "=")
        if name not in (EVENTS if is_at == "@" else RATES):
            hint = nearest(name, RATES)
            msg = f"--faults {text}: expected one of {', '.join(RATES)}{hint}"
            raise RunError(msg)
        at, _, lasts = value.partition(":")
        numbers = [_number(text, one) for one in (at, lasts) if one]
        if not numbers or (lasts and name != "unplug") or (name in ("flip", "lose", "cut")
                                                           and numbers[0] > 1.0):  # fmt: skip
            _refuse(text)
        if is_at == "@":
            events.append(Event(numbers[0], name, *numbers[1:]))
        else:
            rates[name] = numbers[0]
    return Faults(rates, tuple(sorted(events, key=lambda event: event.at_s)))


def _number(text: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = -1.0
    if not 0.0 <= number < 1e9:
        _refuse(text)
    return number


def _refuse(text: str) -> None:
    msg = f"--faults {text}: expected NAME=RATE, NAME@SECONDS or unplug@SECONDS:SECONDS"
    raise RunError(msg)


class FaultInjector:
    """Injects the faults of a plan.

    Args:
        faults: The plan.
        seed: Of all that is random.
        now_ns: When it starts.
    """

    def __init__(self, faults: Faults, seed: int, now_ns: int) -> None:
        self._rates = faults.rates
        self._planned = list(faults.events)
        self._draw = random.Random(seed)
        self._start_ns = self._now_ns = now_ns
        self._next_s = {kind: self._wait(kind) for kind in PER_SECOND if self._rate(kind)}

    def due(self, now_ns: int) -> tuple[list[Event], bytes]:
        """Return the device faults due now, and the noise on the line since the last call."""
        now_s = seconds(now_ns - self._start_ns)
        happens, noise = list[Event](), bytearray()
        while self._planned and self._planned[0].at_s <= now_s:
            happens.append(self._planned.pop(0))
        for kind in self._next_s:
            while self._next_s[kind] <= now_s:
                if kind == "noise":
                    noise.append(self._draw.randrange(256))
                else:
                    happens.append(Event(self._next_s[kind], kind))
                self._next_s[kind] += self._wait(kind)
        return happens, bytes(noise)

    def corrupt(self, data: bytes) -> bytes:
        """Return a burst of bytes as it arrives."""
        if not data or not self._rates:
            return data
        if self._happens("cut"):
            data = data[: self._draw.randrange(len(data))]
        out = bytearray()
        for byte in data:
            if not self._happens("lose"):
                out.append(byte ^ (1 << self._draw.randrange(8) if self._happens("flip") else 0))
        return bytes(out)

    def _rate(self, kind: str) -> float:
        return self._rates.get(kind, 0.0)

    def _happens(self, kind: str) -> bool:
        rate = self._rate(kind)
        return rate > 0.0 and self._draw.random() < rate

    def _wait(self, kind: str) -> float:
        return max(self._draw.expovariate(self._rate(kind)), 1e-6)


def lasts_ns(event: Event) -> int:
    """Return how long the cable is unplugged [ns]."""
    return nanoseconds(event.for_s)
