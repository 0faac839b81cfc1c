"""What a diagnosis finds: the contract between the search and the report.

Field names are those of `report.json`; a `low`..`high` is a 90 % interval.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from scm.data_quality.problem import DataProblem, Span


class Verdict(StrEnum):
    """What a recording shows beyond noise and the car file's own scatter."""

    NONE = "none"
    MISMATCH = "mismatch"
    UNDECIDED = "undecided"


class Equation(StrEnum):
    """Which part of the model an effect belongs to."""

    DRIVE = "drive"
    STEERING = "steering"
    TYRE = "tyre"
    BODY = "body"
    SURFACE = "surface"
    SENSOR = "sensor"


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A parameter's value with its 90 % interval, in `unit`."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Rival:
    """An effect that was tried in place of one that was found, and what rules it out."""

    name: str
    probability: float
    ruled_out_by: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One effect that the simulator left out.

    Attributes:
        name: Of the library, or what it depends on, such as `drive force against heading`.
        listed: Whether the library has it.
        depends_on: Physical variables, such as `("time",)`.
        parameters: By their public names.
        probability: Over all rival models that were tried.
        said: One or two sentences that a mechanic understands.
        law: The formula of an effect outside the library.
    """

    name: str
    listed: bool
    equation: Equation
    depends_on: tuple[str, ...]
    parameters: Mapping[str, Estimate]
    probability: float
    said: str
    law: str | None = None
    rivals: tuple[Rival, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A box of the floor [m]."""

    x_m: Span
    y_m: Span


@dataclass(frozen=True, slots=True, kw_only=True)
class Located:
    """Where the error of the simulator as it was lies.

    Attributes:
        channels: That show it.
        when_s: Spans on the recording's clock; None: all the time. Of several recordings those of
            the first, which the others follow.
        where: None: everywhere.
        share_of_error: Of the squared error beyond noise, 0..1.
    """

    equation: Equation
    channels: tuple[str, ...]
    depends_on: tuple[str, ...]
    when_s: tuple[Span, ...] | None
    where: Place | None
    share_of_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Undecided:
    """Effects that this recording cannot tell apart, and the drive that would.

    Attributes:
        expected_separation: In standard deviations, under the manoeuvre.
    """

    between: tuple[str, ...]
    drive_this: str
    expected_separation: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PartErrors:
    """Free-run errors of one part of the recording: root mean squares by name with unit.

    Names are `position_m`, `yaw_rad`, `wheel_m`, `speed_mps` ... as the recording allows.
    """

    windows: int
    before: Mapping[str, float]
    after: Mapping[str, float]
    noise_floor: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """How well free runs of `horizon_s` fit before and after, on three disjoint parts."""

    horizon_s: float
    fit: PartErrors
    choose: PartErrors
    confirm: PartErrors


@dataclass(frozen=True, slots=True, kw_only=True)
class Unasked:
    """A question that there was no time for.

    Attributes:
        name: Short and fixed: `effects`, `further_effects`, `calm`, `laws`, `beside_law`,
            `strides`.
        said: One sentence: what was not sought, and why.
    """

    name: str
    said: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """All that was found, and what was not asked; `report.json` holds these fields.

    Attributes:
        processor_share: How much of one processor the search got; None where nobody measured.
        compared_s: How long the recordings could be that the budget let be compared whole; of
            longer ones pieces are. None where there was no budget.
    """

    verdict: Verdict
    located: tuple[Located, ...]
    effects: tuple[Effect, ...]
    undecided: tuple[Undecided, ...]
    fit: Fit | None
    runtime_s: float
    data: tuple[DataProblem, ...] = field(default=())
    unasked: tuple[Unasked, ...] = field(default=())
    processor_share: float | None = None
    compared_s: float | None = None
