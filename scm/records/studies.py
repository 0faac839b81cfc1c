"""Studies: how far each is, and what came of it."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.fields import Name, Text, Title

StudyState = Literal["running", "stopped", "complete", "unreadable"]
Level = float | int | str | bool
"""A value of a factor."""

_UNIT = Meta(description="SI unit; `1`: none.", examples=["s"])
_LEVELS = Meta(examples=[["fixed", "actuated"]])


class Estimate(msgspec.Struct, kw_only=True, frozen=True):
    """A share of successes with Wilson's 95 % interval, or a mean with Student's.

    Attributes:
        value: Of a share 0 to 1, else in the measure's unit; None: no case has any.
        low: Lower end of the interval; None: too few cases.
        high: Its upper end, likewise.
        cases: From how many.
    """

    value: float | None
    low: float | None
    high: float | None
    cases: int


class Outcomes(msgspec.Struct, kw_only=True, frozen=True):
    """How many cases ended in which way.

    Attributes:
        success: Every measure is within its limits, or has none.
        failure: A measure is beyond a limit.
        error: The scenario raised an error, or its process died.
        time_limit: Ended after the longest time that a case may take.
        memory_limit: Ended as it took too much memory.
    """

    success: int = 0
    failure: int = 0
    error: int = 0
    time_limit: int = 0
    memory_limit: int = 0


class StudyRow(msgspec.Struct, kw_only=True, frozen=True):
    """A study in the list.

    Attributes:
        name: Of its folder.
        scenario: A shipped one, or the Python file of its own.
        state: `running`; `stopped`: the same command goes on; `complete`; `unreadable`: `trouble`
            gives the reason.
        trouble: Why it cannot be read; empty: it can.
        cases: How many there are in all; a complete study may have stopped before the last.
        done: How many of them have been run.
        outcomes: These by how they ended.
        success: Share of successes; None: nothing was run, or no measure has a limit.
        began_ns: When it began, since 1970; None: unknown.
        ended_ns: When it became complete; None: not yet.
    """

    name: Name
    title: Title = ""
    scenario: Annotated[str, Meta(examples=["travel_time"])] = ""
    state: StudyState
    trouble: Annotated[str, Meta(examples=["it has no study.toml"])] = ""
    cases: int = 0
    done: int = 0
    outcomes: Outcomes = Outcomes()
    success: Estimate | None = None
    began_ns: int | None = None
    ended_ns: int | None = None


class StudyFactor(msgspec.Struct, kw_only=True, frozen=True):
    """A factor of a study.

    Attributes:
        path: What it varies; the column in its results.
        kind: How: `values`, `grid`, `uniform`, `normal`, `log_uniform` or `std`.
        values: Each value; of `grid` lowest, highest and count, of the others as in the study
            file: two limits, mean and standard deviation, or the number of standard deviations.
        apply: Whether a number is `set`, `add`ed to, or used to `scale` what the files have.
    """

    path: Annotated[str, Meta(examples=["radio.loss"])]
    kind: Annotated[str, Meta(examples=["values"])]
    values: Annotated[tuple[Level, ...], _LEVELS]
    apply: Annotated[str, Meta(examples=["set"])]


class StudyMeasure(msgspec.Struct, kw_only=True, frozen=True):
    """A measure of a study.

    Attributes:
        at_least: Least value of a success; None: no limit.
        at_most: Highest value of a success; None: no limit.
    """

    name: Name
    unit: Annotated[str, _UNIT]
    about: Text
    at_least: float | None
    at_most: float | None


class FactorLevel(msgspec.Struct, kw_only=True, frozen=True):
    """What came of the cases with one value of a factor, over all other factors.

    Attributes:
        level: The value; of a factor that is drawn a fifth of its draws.
        cases: How many there are.
        estimates: `success`, if any measure has a limit, and each measure.
    """

    level: Annotated[str, Meta(examples=["fixed"])]
    cases: int
    estimates: dict[str, Estimate]


class FactorTable(msgspec.Struct, kw_only=True, frozen=True):
    """Success and measures by the value of one factor.

    Attributes:
        factor: Its path.
        levels: In their order, the first 200.
    """

    factor: Annotated[str, Meta(examples=["radio.loss"])]
    levels: tuple[FactorLevel, ...]


class StudyCase(msgspec.Struct, kw_only=True, frozen=True):
    """One case of a study.

    Attributes:
        case: Its number: `scm study replay FOLDER NUMBER` shows it again.
        seed: Of all its luck.
        outcome: As in `Outcomes`.
        detail: Why it did not end; empty: it did.
        seconds: How long it took on the clock on the wall [s].
        factors: Their values.
        measures: Empty: it did not end; null: it could not be taken.
        recorded: Whether there is a recording of it in the study's folder.
    """

    case: int
    seed: int
    outcome: Annotated[str, Meta(examples=["failure"])]
    detail: Annotated[str, Meta(examples=["ValueError: no way (mine.py:12)"])]
    seconds: float
    factors: dict[str, Level]
    measures: dict[str, float | None]
    recorded: bool


class Study(msgspec.Struct, kw_only=True, frozen=True):
    """A study and what came of it.

    Attributes:
        row: As in the list.
        factors: What varies, and what is the same in all cases.
        measures: What is measured in each case.
        tables: Success and measures by each factor that varies.
        worst: Cases that did not end, then failures, the worst first; at most 50.
    """

    row: StudyRow
    factors: tuple[StudyFactor, ...]
    measures: tuple[StudyMeasure, ...]
    tables: tuple[FactorTable, ...]
    worst: tuple[StudyCase, ...]
