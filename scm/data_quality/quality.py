"""What is found in a recording: its problems, what its sensors show of each other, and repairs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from msgspec import Struct, field, structs

Span = tuple[float, float]
MOST_NAMED = 3  # channels that one line names; of more it gives their number


class DataProblem(Struct, kw_only=True, frozen=True):
    """Something wrong with the recording itself, found by its sensors against each other.

    Attributes:
        channel: Where, `pose.x` or `imu.*`.
        name: Short and fixed: `gap`, `frozen`, `copied`, `jump`, `unit`, `time_backwards`,
            `missing`, `too_short`, `constant`, `not_finite` ...
        text: One sentence: what, where, how much.
        when_s: None: all the time.
        corrected: What was done about it before physics was blamed; empty: nothing.
        record_instead: What to record next time; empty where nothing helps.
    """

    channel: str
    name: str
    text: str = field(name="said")
    when_s: tuple[Span, ...] | None = None
    corrected: str = ""
    record_instead: str = ""


def folded(problems: Iterable[DataProblem]) -> tuple[DataProblem, ...]:
    """Return problems, those that say the same of several channels as one."""
    alike = dict[DataProblem, list[str]]()
    for problem in problems:
        channels = alike.setdefault(structs.replace(problem, channel=""), [])
        if problem.channel not in channels:
            channels.append(problem.channel)
    return tuple(structs.replace(one, channel=_together(names)) for one, names in alike.items())


def _together(channels: list[str]) -> str:
    if len(channels) <= MOST_NAMED:
        return ", ".join(channels)
    families = dict.fromkeys(name.partition(".")[0] + ".*" * ("." in name) for name in channels)
    return f"{len(channels)} channels ({', '.join(families)})"


def called(names: Sequence[str]) -> str:
    """Return one name for several channels: `imu.*`, or all of them."""
    families = {name.partition(".")[0] for name in names}
    if len(names) == 1:
        return names[0]
    return ", ".join(sorted(f"{f}.*" if f"{f}" not in names else f for f in families))


@dataclass(frozen=True, slots=True)
class Measured:
    """A number with its standard error.

    Attributes:
        leak: By how much the drive magnifies what the comparison leaves out: 1 where nothing else
            looks like this number, large where the drive hardly tells them apart.
    """

    value: float
    std: float
    leak: float = 1.0


@dataclass(frozen=True, slots=True)
class Relation:
    """Two sensors held against each other, whether or not anything is wrong with them.

    Attributes:
        pair: What was compared, such as `("pose.yaw", "imu.gyro_z")`.
        numbers: By name; what each means stands where the relation is made.
        step_s: Between rows of the slower one.
    """

    pair: tuple[str, str]
    numbers: Mapping[str, Measured]
    step_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Suspicion:
    """A fault of measurement that would explain how two sensors differ.

    Attributes:
        name: Of the library (`scm.vehicles.sensor_faults`).
        channels: Where it would act.
        values, std: By the measure's own parameter names.
        sigma: How far from its neutral value, in standard deviations; what the car file allows
            counts as one of them.
        shown_by: The pair of sensors that shows it.
        indistinguishable: Faults that explain the same pair just as well.
        text: One sentence.
        repaired: So gross that it is undone before anything else is looked at: the other values
            are those of the repaired recording.
    """

    name: str
    channels: tuple[str, ...]
    values: Mapping[str, float]
    std: Mapping[str, float]
    sigma: float
    shown_by: tuple[str, str]
    indistinguishable: tuple[str, ...] = ()
    text: str = ""
    repaired: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Repair:
    """A gross fault undone: `t = t + shift_s`, `value = factor * value + offset`.

    Attributes:
        channels: Exact names.
        signed: Only the size was recorded: the values take the sign of the pose's speed.
        out_s: The rows in these spans are left out.
    """

    channels: tuple[str, ...]
    factor: float = 1.0
    offset: float = 0.0
    shift_s: float = 0.0
    signed: bool = False
    out_s: tuple[Span, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Usable:
    """Which parts of a recording can be used, on each channel's own clock after repair.

    Attributes:
        spans: By channel, without gaps, jumps and frozen parts.
        lacks: What keeps the recording from being driven again at all; empty when nothing does.
    """

    spans: Mapping[str, tuple[Span, ...]]
    lacks: tuple[str, ...] = ()

    @property
    def can_diagnose(self) -> bool:
        """Return whether there is enough to hold a simulation against."""
        return not self.lacks


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """All that a recording's own sensors say about each other."""

    problems: tuple[DataProblem, ...]
    suspicions: tuple[Suspicion, ...]
    usable: Usable
    repairs: tuple[Repair, ...] = ()
    relations: tuple[Relation, ...] = ()
