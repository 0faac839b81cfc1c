"""What a diagnosis finds: the contract between the search and the report, and `report.json`.

Where an attribute has another name in `report.json`, `field(name=...)` gives it. A `low`..`high` is
a 90 % interval.
"""

from collections.abc import Mapping, Sequence
from enum import StrEnum

from msgspec import Struct, field

from scm.data_quality.quality import DataProblem, Span

DRIVE_FOLDER = "next_drive"
MIN_OFFERED_STDS = 3.2  # of separation; a drive that separates less is not written


class Verdict(StrEnum):
    """What a recording shows beyond noise and the standard deviations of the car file."""

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


class Course(StrEnum):
    """How an effect goes over a recording.

    Always the same, from a moment on, growing evenly, or there between two moments only.
    """

    CONSTANT = "constant"
    STEP = "step"
    RAMP = "ramp"
    INTERMITTENT = "intermittent"


class Estimate(Struct, kw_only=True, frozen=True):
    """A parameter's value with its 90 % interval, in `unit`."""

    value: float
    low: float
    high: float
    unit: str


class Range(Struct, kw_only=True, frozen=True):
    """Between which values a variable was while the car moved, in `unit`."""

    low: float
    high: float
    unit: str


class Alternative(Struct, kw_only=True, frozen=True):
    """An effect that was tried in place of one that was found, and what rules it out."""

    name: str
    probability: float
    ruled_out_by: str


class Effect(Struct, kw_only=True, frozen=True):
    """One effect that the simulator left out.

    Attributes:
        name: In the catalogue, or what it depends on, such as `drive force against heading`.
        is_known: Whether the catalogue of effects has it.
        depends_on: Physical variables, such as `("time",)`.
        parameters: By their public names.
        probability: Among all alternatives that were tried.
        text: One or two sentences that a mechanic understands.
        formula: Of an effect outside the catalogue.
        course: How it goes over the recording. `parameters` are those in the end, or while it was
            there if it came and went.
        since_s: When it changed, on the recording's clock; None: it did not, or evenly all along.
        until_s: When an effect that came and went was last there; None of any other.
        before: Its parameters before the change; empty: it was not there, or did not change.
        stated: Its parameters as the given car file has them; empty: the file lacks the effect.
        recorded_range: Where it was seen, by variable: what it depends on, in the recordings.
    """

    name: str
    is_known: bool = field(name="listed")
    equation: Equation
    depends_on: tuple[str, ...]
    parameters: Mapping[str, Estimate]
    probability: float
    text: str = field(name="said")
    formula: str | None = field(default=None, name="law")
    alternatives: tuple[Alternative, ...] = field(default=(), name="rivals")
    course: Course = Course.CONSTANT
    since_s: Estimate | None = None
    until_s: Estimate | None = None
    before: Mapping[str, Estimate] = {}
    stated: Mapping[str, float] = {}
    recorded_range: Mapping[str, Range] = {}

    @property
    def is_of_recording(self) -> bool:
        """Whether it is a law against the recording's own time, which no other drive has."""
        is_outside = not self.is_known and self.equation is not Equation.SENSOR
        return is_outside and "time" in self.depends_on


class Place(Struct, kw_only=True, frozen=True):
    """A box of the floor [m]."""

    x_m: Span
    y_m: Span


class Located(Struct, kw_only=True, frozen=True):
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


class Undecided(Struct, kw_only=True, frozen=True):
    """Effects that this recording cannot tell apart, and the drive that would.

    Attributes:
        expected_separation: In standard deviations, under the manoeuvre.
    """

    between: tuple[str, ...]
    drive_this: str
    expected_separation: float


class PartErrors(Struct, kw_only=True, frozen=True):
    """Free-run errors of one part of the recording: root mean squares by name with unit.

    Names are `position_m`, `yaw_rad`, `wheel_m`, `speed_mps` ... as the recording allows.
    """

    windows: int
    before: Mapping[str, float]
    after: Mapping[str, float]
    noise_floor: Mapping[str, float]


class Witness(Struct, kw_only=True, frozen=True):
    """A kinematic bicycle fitted to `fit` and `choose`: its errors on `confirm`, as in `Fit`.

    Attributes:
        numbers: That were fitted, by name with unit.
    """

    position_m: float
    yaw_rad: float
    numbers: Mapping[str, float]


class Fit(Struct, kw_only=True, frozen=True):
    """How well free runs of `horizon_s` fit before and after, on three disjoint parts.

    Attributes:
        retuned: Errors on `confirm` of the given car with its own numbers refitted and no effect;
            None where no effect was found.
        witness: What a plain model makes of `confirm`; None where windows are too few.
        stated: Errors on `confirm` to be expected of a car as accurate as the given file states;
            None where it states nothing.
    """

    horizon_s: float
    fit: PartErrors
    choose: PartErrors
    confirm: PartErrors
    retuned: Mapping[str, float] | None = None
    witness: Witness | None = None
    stated: Mapping[str, float] | None = None


class Dropped(Struct, kw_only=True, frozen=True):
    """An effect that was selected, and that the car handed out does not have.

    Attributes:
        text: One sentence: what does not hold on driving that no fit has seen.
    """

    name: str
    text: str = field(name="said")


class Failure(Struct, kw_only=True, frozen=True):
    """A plain model follows the car better than what was fitted.

    Attributes:
        text: By how much, and which car is handed out.
        reasons: Sentences on what can be read off the fit.
    """

    text: str = field(name="said")
    reasons: tuple[str, ...] = ()


class Unanswered(Struct, kw_only=True, frozen=True):
    """A question that the search had no time to answer.

    Attributes:
        name: Short and fixed: `effects`, `further_effects`, `calm`, `laws`, `beside_law`,
            `strides`, `from_witness`, `wider_numbers`.
        text: One sentence: what was not searched for, and why.
    """

    name: str
    text: str = field(name="said")


class Diagnosis(Struct, kw_only=True, frozen=True):
    """Everything that was found, and the questions left open; the fields of `report.json`.

    Attributes:
        dropped: Effects that do not hold on driving that no fit has seen.
        failure: Why no effect is handed out; None where none has to be held back.
        processor_share: Share of one processor that the search got; None if it was not measured.
        compared_s: The longest recordings that the budget allows to compare as a whole; longer
            ones are sampled. None without a budget.
    """

    verdict: Verdict
    located: tuple[Located, ...]
    effects: tuple[Effect, ...]
    undecided: tuple[Undecided, ...]
    fit: Fit | None
    runtime_s: float
    data: tuple[DataProblem, ...] = ()
    unanswered: tuple[Unanswered, ...] = field(default=(), name="unasked")
    processor_share: float | None = None
    compared_s: float | None = None
    dropped: tuple[Dropped, ...] = ()
    failure: Failure | None = None


def folders_of(undecided: Sequence[Undecided]) -> tuple[str, ...]:
    """Return the folder of each question's drive, numbered from the second on; empty: no drive."""
    found, count = list[str](), 0
    for question in undecided:
        offered = question.expected_separation >= MIN_OFFERED_STDS
        count += offered
        found.append((DRIVE_FOLDER if count < 2 else f"{DRIVE_FOLDER}_{count}") if offered else "")
    return tuple(found)
