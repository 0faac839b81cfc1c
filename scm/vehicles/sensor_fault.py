"""The contract of a sensor fault: how a true channel becomes the one that was recorded.

A function's argument names are its wiring, as for a physical effect: `value` and `t` are the
channel's own values and stamps, `pose_yaw` is the channel `pose.yaw`, `start` is the recording's
first stamp, and any other name is a parameter. The functions work on whole arrays.
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
from scm.vehicles.identification import Identification
from scm.vehicles.param import Param

SENSOR_FAULTS = "scm.vehicles.sensor_faults"

ArrayFunction = Callable[..., Floats]


@dataclass(frozen=True, slots=True)
class Series:
    """One channel: stamps in ascending order [s] and as many values."""

    t_s: Floats
    values: Floats


@dataclass(frozen=True, slots=True)
class SensorFault:
    """One kind of sensor fault.

    Attributes:
        functions: By channel that it changes; `pose.*` is every channel of the pose.
        stamps: Whether the functions return stamps instead of values.
        params: Numbers that the functions read, from the car file.
        neutral: Parameter values at which the fault changes nothing, bit for bit.
        shows_in: Manoeuvres that make the fault visible.
        acts_on: Channels it changes by default. None: all that have a function. Empty: the user
            must name them.
        stands_for: Key of the car file that its first parameter multiplies. A simulation changes
            either that number or the parameter, never both.
        identification: How recordings show it; None: a search never proposes it.
    """

    functions: Mapping[str, ArrayFunction]
    params: tuple[Param, ...]
    neutral: Mapping[str, float]
    shows_in: tuple[str, ...]
    stamps: bool = False
    acts_on: tuple[str, ...] | None = None
    stands_for: str = ""
    identification: Identification | None = None

    @property
    def function(self) -> ArrayFunction:
        """The function of its first channel."""
        return next(iter(self.functions.values()))

    @property
    def name(self) -> str:
        """The name of its file."""
        return self.function.__module__.rpartition(".")[2]

    @property
    def about(self) -> str:
        """What the fault is: the first line of its file."""
        return effect_text.about(self.function)

    @property
    def equation(self) -> str:
        """The indented lines of the file's docstring, joined."""
        return effect_text.equation(self.function)

    def doc_line(self, heading: str) -> str:
        """Return the file's text after `Holds:`, `Shows in:` or `Source:`, or an empty string."""
        return effect_text.after_heading(self.function, heading)


@dataclass(frozen=True, slots=True)
class AppliedFault:
    """A fault with its parameter values; missing ones are at their defaults.

    Attributes:
        channels: Where it acts, such as `("imu.gyro_z",)` or `("imu.*",)`. Empty: the kind's
            default.
    """

    kind: SensorFault
    values: Mapping[str, float] = field(default_factory=dict)
    channels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names = [param.name for param in self.kind.params]
        for name in self.values:
            if name not in names:
                msg = f"{self.kind.name}: no parameter {name!r}{nearest(name, names)}"
                raise TermError(msg)
        if self.kind.acts_on == () and not self.channels:
            msg = f"{self.kind.name}: expected the channels where it acts, got none"
            raise TermError(msg)

    def function_for(self, channel: str) -> ArrayFunction | None:
        """Return the function that changes this channel, or None if the channel stays as it is."""
        functions = self.kind.functions
        where = self.channels or self.kind.acts_on or tuple(functions)
        if not any(fnmatch(channel, pattern) for pattern in where):
            return None
        if channel in functions:
            return functions[channel]
        fitting = (function for pattern, function in functions.items() if fnmatch(channel, pattern))
        return next(fitting, None)

    @property
    def numbers(self) -> dict[str, float]:
        """Every parameter's value."""
        return {param.name: param.default for param in self.kind.params} | dict(self.values)


@cache
def all_sensor_faults() -> Mapping[str, SensorFault]:
    """Return every known kind of fault, by name."""
    names = registry.names(SENSOR_FAULTS)
    return {name: registry.load(SENSOR_FAULTS, name, "SENSOR_FAULT", SensorFault) for name in names}


def read_faults(entries: object, problems: list[str]) -> tuple[AppliedFault, ...]:
    """Parse a car file's list such as `["gyro_bias", "unit_error on imu.gyro_z"]`.

    Errors are appended to `problems`. The faults have default parameters.
    """
    if not isinstance(entries, list) or not all(isinstance(entry, str) for entry in entries):
        problems.append(f"measures: expected a list of names, got {entries!r}")
        return ()
    known, found = all_sensor_faults(), list[AppliedFault]()
    for entry in entries:
        name, _, channels = (part.strip() for part in entry.partition(" on "))
        where = tuple(channel.strip() for channel in channels.split(",") if channel.strip())
        if name not in known:
            hint = nearest(name, list(known))
            problems.append(f"measures: no sensor fault {name!r}{hint}")
        elif any(fault.kind is known[name] for fault in found):
            problems.append(f"measures: {name!r} is listed twice")
        elif known[name].acts_on == () and not where:
            problems.append(f"measures: expected {name!r} as '{name} on CHANNEL', got {entry!r}")
        else:
            found.append(AppliedFault(known[name], {}, where))
    return tuple(found)


def apply_faults(
    channels: Mapping[str, Series], faults: Iterable[AppliedFault], start_s: float | None = None
) -> dict[str, Series]:
    """Return the channels as they are measured with these faults.

    Args:
        channels: True channels by name; channels without a fault are returned unchanged.
        faults: In the order in which they act; each sees the result of the ones before.
        start_s: Time at which drifting clocks still agree; by default the earliest stamp.

    Raises:
        TermError: when a function needs a channel that is missing.
    """
    if start_s is None:
        stamps = [float(series.t_s[0]) for series in channels.values() if len(series.t_s)]
        start_s = min(stamps, default=0.0)
    now = dict(channels)
    for fault in faults:
        functions = {name: fault.function_for(name) for name in now}
        now |= {
            name: _changed(name, function, now, fault, start_s)
            for name, function in functions.items()
            if function is not None
        }
    return now


def _changed(
    name: str,
    function: ArrayFunction,
    now: Mapping[str, Series],
    fault: AppliedFault,
    start_s: float,
) -> Series:
    series = now[name]
    known: dict[str, float | Floats] = {**fault.numbers, "start": start_s}
    known |= {"value": series.values, "t": series.t_s}
    names = tuple(inspect.signature(function).parameters)
    for channel in _needed(names, known, now, fault):
        known[channel.replace(".", "_", 1)] = _at(channel, now[channel], series.t_s)
    result = np.asarray(
        function(**{argument: known[argument] for argument in names}), dtype=np.float64
    )
    return replace(series, t_s=result) if fault.kind.stamps else replace(series, values=result)


def _needed(
    names: Sequence[str],
    known: Mapping[str, object],
    now: Mapping[str, Series],
    fault: AppliedFault,
) -> list[str]:
    by_argument = {channel.replace(".", "_", 1): channel for channel in now}
    missing = [name for name in names if name not in known and name not in by_argument]
    if missing:
        channels = ", ".join(name.replace("_", ".", 1) for name in missing)
        msg = f"{fault.kind.name}: needs the channel {channels}, which is missing"
        raise TermError(msg)
    return [by_argument[name] for name in names if name not in known]


def _at(channel: str, series: Series, t_s: Floats) -> Floats:
    """Interpolate a channel at other stamps; angles are unwrapped first."""
    if np.array_equal(series.t_s, t_s):
        return series.values
    values = np.unwrap(series.values) if channel.endswith(("yaw", "roll", "pitch")) else None
    return np.interp(t_s, series.t_s, series.values if values is None else values)
