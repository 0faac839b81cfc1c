"""The contract of a fault of measurement: how a true channel becomes the one that was recorded.

A law's argument names are its wiring, as those of a physical effect: `value` and `t` are the
channel's own values and stamps, `pose_yaw` is the channel `pose.yaw`, `start` the recording's
first stamp, anything else a parameter. Laws work on whole arrays at once.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatch
from functools import cache

import numpy as np

from scm import registry
from scm.arrays import Floats
from scm.errors import TermError, nearest
from scm.vehicles import effect_text
from scm.vehicles.param import Param

MEASURES = "scm.vehicles.measures"

ArrayLaw = Callable[..., Floats]


@dataclass(frozen=True, slots=True)
class Series:
    """One channel: stamps in ascending order [s] and as many values."""

    t_s: Floats
    values: Floats


@dataclass(frozen=True, slots=True)
class Measure:
    """One fault of measurement.

    Attributes:
        laws: Law of each channel that it changes; `pose.*` is every channel of the pose.
        stamps: The laws give stamps instead of values.
        params: Numbers the laws read; a car file fills them.
        neutral: Parameter values at which it does nothing, bit for bit.
        shows_in: Manoeuvres that make the fault visible.
        acts_on: Channels it changes where its user names none; None is all that have a law, and
            an empty tuple says that its user must name them.
        stands_for: The key of the car that its first parameter multiplies; a simulation may
            change that number instead, but must not do both.
    """

    laws: Mapping[str, ArrayLaw]
    params: tuple[Param, ...]
    neutral: Mapping[str, float]
    shows_in: tuple[str, ...]
    stamps: bool = False
    acts_on: tuple[str, ...] | None = None
    stands_for: str = ""

    @property
    def law(self) -> ArrayLaw:
        """The first law."""
        return next(iter(self.laws.values()))

    @property
    def name(self) -> str:
        """The name of its file."""
        return self.law.__module__.rpartition(".")[2]

    @property
    def about(self) -> str:
        """The first line of the file: what the fault is."""
        return effect_text.about(self.law)

    @property
    def equation(self) -> str:
        """The indented lines of the file's docstring, joined."""
        return effect_text.equation(self.law)

    def doc_line(self, heading: str) -> str:
        """Return what the file says after `Holds:`, `Shows in:`, `Source:`; empty when nothing."""
        return effect_text.after_heading(self.law, heading)


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault with its numbers, by parameter name; what is not given is at its default.

    Attributes:
        channels: Where it acts, such as `("imu.gyro_z",)` or `("imu.*",)`; empty leaves it to the
            measure.
    """

    measure: Measure
    values: Mapping[str, float] = field(default_factory=dict)
    channels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names = [param.name for param in self.measure.params]
        for name in self.values:
            if name not in names:
                msg = f"{self.measure.name}: no parameter {name!r}{nearest(name, names)}"
                raise TermError(msg)
        if self.measure.acts_on == () and not self.channels:
            msg = f"{self.measure.name}: expected the channels where it acts, got none"
            raise TermError(msg)

    def law_of(self, channel: str) -> ArrayLaw | None:
        """Return the law that changes this channel, None where it stays as it is."""
        laws = self.measure.laws
        where = self.channels or self.measure.acts_on or tuple(laws)
        if not any(fnmatch(channel, pattern) for pattern in where):
            return None
        if channel in laws:
            return laws[channel]
        fitting = (law for pattern, law in laws.items() if fnmatch(channel, pattern))
        return next(fitting, None)

    @property
    def numbers(self) -> dict[str, float]:
        """Every parameter's value."""
        return {param.name: param.default for param in self.measure.params} | dict(self.values)


@cache
def all_measures() -> Mapping[str, Measure]:
    """Return every fault known, by name."""
    names = registry.names(MEASURES)
    return {name: registry.load(MEASURES, name, "MEASURE", Measure) for name in names}


def read_faults(entries: object, problems: list[str]) -> tuple[Fault, ...]:
    """Make faults of a car file's list such as `["gyro_bias", "unit_error on imu.gyro_z"]`.

    Problems of the list are added to `problems`; the faults stand at their defaults.
    """
    if not isinstance(entries, list) or not all(isinstance(entry, str) for entry in entries):
        problems.append(f"measures: expected a list of names, got {entries!r}")
        return ()
    known, found = all_measures(), list[Fault]()
    for entry in entries:
        name, _, channels = (part.strip() for part in entry.partition(" on "))
        where = tuple(channel.strip() for channel in channels.split(",") if channel.strip())
        if name not in known:
            hint = nearest(name, list(known))
            problems.append(f"measures: no fault of measurement {name!r}{hint}")
        elif any(fault.measure is known[name] for fault in found):
            problems.append(f"measures: {name!r} stands twice")
        elif known[name].acts_on == () and not where:
            problems.append(f"measures: expected {name!r} as '{name} on CHANNEL', got {entry!r}")
        else:
            found.append(Fault(known[name], {}, where))
    return tuple(found)


def measure(
    channels: Mapping[str, Series], faults: Iterable[Fault], start_s: float | None = None
) -> dict[str, Series]:
    """Return the channels as they are measured, faults one after the other.

    Args:
        channels: True channels by name; those that no fault touches are passed on as they are.
        faults: In the order in which they act; a later one sees what earlier ones left.
        start_s: Where drifting clocks still agree; the earliest stamp where it is not given.

    Raises:
        TermError: when a law needs a channel that is not there.
    """
    if start_s is None:
        stamps = [float(series.t_s[0]) for series in channels.values() if len(series.t_s)]
        start_s = min(stamps, default=0.0)
    now = dict(channels)
    for fault in faults:
        laws = {name: fault.law_of(name) for name in now}
        now |= {
            name: _changed(name, law, now, fault, start_s)
            for name, law in laws.items()
            if law is not None
        }
    return now


def _changed(
    name: str, law: ArrayLaw, now: Mapping[str, Series], fault: Fault, start_s: float
) -> Series:
    series = now[name]
    known: dict[str, float | Floats] = {**fault.numbers, "start": start_s}
    known |= {"value": series.values, "t": series.t_s}
    names = tuple(inspect.signature(law).parameters)
    for channel in _needed(names, known, now, fault):
        known[channel.replace(".", "_", 1)] = _at(channel, now[channel], series.t_s)
    result = np.asarray(law(**{argument: known[argument] for argument in names}), dtype=np.float64)
    return replace(series, t_s=result) if fault.measure.stamps else replace(series, values=result)


def _needed(
    names: Sequence[str], known: Mapping[str, object], now: Mapping[str, Series], fault: Fault
) -> list[str]:
    by_argument = {channel.replace(".", "_", 1): channel for channel in now}
    missing = [name for name in names if name not in known and name not in by_argument]
    if missing:
        channels = ", ".join(name.replace("_", ".", 1) for name in missing)
        msg = f"{fault.measure.name}: needs the channel {channels}, which is not there"
        raise TermError(msg)
    return [by_argument[name] for name in names if name not in known]


def _at(channel: str, series: Series, t_s: Floats) -> Floats:
    """Return a channel at other stamps, angles taken the short way round."""
    if np.array_equal(series.t_s, t_s):
        return series.values
    values = np.unwrap(series.values) if channel.endswith(("yaw", "roll", "pitch")) else None
    return np.interp(t_s, series.t_s, series.values if values is None else values)
