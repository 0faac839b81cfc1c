"""A problem of a recording itself, as a report names it."""

from dataclasses import dataclass

Span = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class DataProblem:
    """Something wrong with the recording itself, found by its sensors against each other.

    Attributes:
        channel: Where, `pose.x` or `imu.*`.
        name: Short and fixed: `gap`, `frozen`, `copied`, `jump`, `unit`, `time_backwards`,
            `missing`, `too_short`, `constant`, `not_finite` ...
        said: One sentence: what, where, how much.
        when_s: None: all the time.
        corrected: What was done about it before physics was blamed; empty: nothing.
        record_instead: What to record next time; empty where nothing helps.
    """

    channel: str
    name: str
    said: str
    when_s: tuple[Span, ...] | None = None
    corrected: str = ""
    record_instead: str = ""
