"""A problem of a recording itself, as a report names it."""

from collections.abc import Iterable

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
