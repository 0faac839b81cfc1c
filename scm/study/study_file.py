"""A study file: a scenario, the factors that vary, how often, and what counts as success.

study = 1
scenario = "travel_time"             # a shipped one, or the Python file of your own: "mine.py"
replications = 20

[factors]
cars = 4                                               # always
plan = ["fixed", "actuated"]                           # each
"radio.loss" = { grid = [0.0, 1.0, 11] }               # each of 11 values, evenly spaced
"cars.nigel.tyre.slip_extremum" = { uniform = [0.1, 0.3] }

[measures.travel_time_s]
unit = "s"
at_most = 60.0
"""

import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from scm.errors import StudyError, nearest, reading
from scm.toml_file import record_of

Value = float | int | str | bool
Sampling = Literal["random", "latin_hypercube", "sobol"]
Apply = Literal["set", "add", "scale"]
DISTRIBUTIONS = ("uniform", "normal", "log_uniform", "std")
MAX_CASES = 10_000_000
RESERVED = ("case", "replication", "seed", "outcome", "detail", "seconds")
"""Columns that every result has; no factor and no measure may have these names."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,59}")

Share = Annotated[float, Meta(gt=0.0, lt=1.0)]
Above0 = Annotated[float, Meta(gt=0.0)]


class _Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of a study file."""


class Factor(_Table, frozen=True, kw_only=True):
    """How one factor varies: exactly one of the first six.

    Attributes:
        values: Each of these.
        grid: Lowest, highest and number of evenly spaced values: each of these.
        uniform: Drawn between two values.
        normal: Drawn with this mean and standard deviation, within the target's bounds.
        log_uniform: Drawn between two values above 0, evenly in the logarithm.
        std: Drawn around the car file's value, with so many times the standard deviation that it
            states there.
        apply: Whether a number replaces, is added to, or scales what stands in the file.
        each: Of a path with `*`: each match is a factor of its own. Else all get the same value.
    """

    values: tuple[Value, ...] | None = None
    grid: tuple[float, float, Annotated[int, Meta(ge=2, le=100_000)]] | None = None
    uniform: tuple[float, float] | None = None
    normal: tuple[float, float] | None = None
    log_uniform: tuple[float, float] | None = None
    std: Above0 | None = None
    apply: Apply = "set"
    each: bool = False

    @property
    def is_drawn(self) -> bool:
        """Whether its values are drawn; else each of a list is used."""
        return any(getattr(self, name) is not None for name in DISTRIBUTIONS)

    @property
    def levels(self) -> tuple[Value, ...]:
        """The values of one that is not drawn."""
        if self.grid is not None:
            low, high, count = self.grid
            return tuple(low + (high - low) * i / (count - 1) for i in range(count))
        return self.values or ()


class Measure(_Table, frozen=True, kw_only=True):
    """One number that the scenario returns for each case.

    Attributes:
        unit: SI, such as `m/s`; "1": none.
        about: Short meaning.
        at_least, at_most: A case is a success if every measure is within its limits.
    """

    unit: str
    about: str = ""
    at_least: float | None = None
    at_most: float | None = None

    def is_met(self, value: float) -> bool:
        """Return whether a value is within the limits; NaN never is, if there are any."""
        if self.at_least is None and self.at_most is None:
            return True
        low = -math.inf if self.at_least is None else self.at_least
        return low <= value <= (math.inf if self.at_most is None else self.at_most)


class StopRule(_Table, frozen=True, kw_only=True):
    """When to stop before all replications: checked after each whole replication.

    Attributes:
        measure: Whose mean is known well enough; `success`: the share of successes.
        half_width: Of its 95 % interval, in its unit: the widest of all factor combinations.
        at_least: Replications to run in any case.
    """

    measure: str
    half_width: Above0
    at_least: Annotated[int, Meta(ge=2)] = 5


class Search(_Table, frozen=True, kw_only=True):
    """What `scm study search` looks for.

    Attributes:
        measure: Which measure.
        goal: Whether the worst case has its lowest or its highest value.
        cases: How many to run.
        stop_below, stop_above: End as soon as one case goes beyond.
    """

    measure: str
    goal: Literal["minimize", "maximize"]
    cases: Annotated[int, Meta(ge=1)] = 100
    stop_below: float | None = None
    stop_above: float | None = None


class Study(_Table, frozen=True, kw_only=True):
    """A study.

    Attributes:
        study: The format of the file.
        title: One line for people.
        scenario: A shipped one by name, or a Python file beside the study file.
        map: A shipped one by name, or a map file beside the study file; empty: the scenario's own.
        cars: Car files beside the study file, known by their names in its cases.
        replications: How often each combination of factors is run.
        samples: How many points are drawn for the factors that are drawn, in each combination of
            the others.
        sampling: How: `random`, or evenly by `latin_hypercube` or `sobol`.
        seed: Of all draws and of all cases.
        paired: Whether a replication has the same seed in each combination of factors, so that
            combinations are compared under equal luck.
        time_limit_s: Longest time that a case may take on the clock on the wall.
        memory_limit_mb: How much memory a case may use on top of what its process had.
        stop: When to stop early.
        recordings: Which cases are recorded: `none`, all `failures`, or a list of numbers.
        max_recordings: Recordings of failures, at most.
    """

    study: Literal[1]
    title: str = ""
    scenario: str
    map: str = ""
    cars: tuple[str, ...] = ()
    replications: Annotated[int, Meta(ge=1)] = 1
    samples: Annotated[int, Meta(ge=1)] = 1
    sampling: Sampling = "random"
    seed: Annotated[int, Meta(ge=0)] = 0
    paired: bool = False
    time_limit_s: Above0 = 600.0
    memory_limit_mb: Above0 = 2000.0
    factors: dict[str, Any] = {}
    measures: dict[str, Any]
    stop: StopRule | None = None
    recordings: Literal["none", "failures"] | tuple[int, ...] = "none"
    max_recordings: Annotated[int, Meta(ge=0)] = 20
    search: Search | None = None


class StudyFile(msgspec.Struct, frozen=True, kw_only=True):
    """A study file that was read and checked; its text is what defines the study.

    Attributes:
        name: Of the file, without its ending.
        folder: Where it is: names of files in it are relative to this.
        text: Its content.
        factors, measures: Those of `study`, as records.
    """

    name: str
    folder: Path
    text: str
    study: Study
    factors: Mapping[str, Factor]
    measures: Mapping[str, Measure]

    @property
    def replications(self) -> int:
        """How often each combination of factors is run."""
        return self.study.replications

    def files(self) -> list[Path]:
        """Return the files that it names, relative to its folder: scenario, map and cars."""
        named = [self.study.scenario, self.study.map, *self.study.cars]
        found = [Path(name) for name in named if (self.folder / name).is_file()]
        return sorted({*found, *(more for name in found for more in self._named_in(name))})

    def _named_in(self, name: Path) -> list[Path]:
        """Return what a map or car file names in turn: pictures, and effects of its own."""
        if name.suffix != ".toml":
            return []
        data = tomllib.loads((self.folder / name).read_text("utf-8"))
        floor = data.get("floor", {})
        more = [floor[key]["image"] for key in ("friction_map", "height_map") if key in floor]
        more += [term for term in data.get("terms", ()) if str(term).endswith(".py")]
        return [name.parent / one for one in more]


def load_study(path: Path, name: str = "") -> StudyFile:
    """Read a study file.

    Args:
        path: Of the file.
        name: Of the study; empty: the file's.

    Raises:
        StudyError: It is wrong, with every reason that can be found without running it.
    """
    with reading(path, "a TOML file", StudyError):
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    study = record_of(data, Study, path, StudyError, _KEYS)
    factors = {key: _factor(entry, key, path) for key, entry in study.factors.items()}
    measures = {
        key: record_of(entry, Measure, path, StudyError, _keys_of(Measure), f"measures.{key}")
        for key, entry in study.measures.items()
    }
    problems = [*_factor_problems(factors), *_problems(path, study, factors, measures)]
    if problems:
        raise StudyError("\n".join(f"{path}: {problem}" for problem in problems))
    return StudyFile(
        name=name or path.stem, folder=path.parent, text=text, study=study, factors=factors,
        measures=measures,
    )  # fmt: skip


def _is_name(text: str) -> bool:
    return _NAME.fullmatch(text) is not None


def _keys_of(kind: type[msgspec.Struct]) -> list[str]:
    return sorted(kind.__struct_fields__)


_KEYS = sorted({key for kind in (Study, Search, StopRule) for key in kind.__struct_fields__})


def _factor(entry: Any, key: str, path: Path) -> Factor:
    """Return a factor: a table, a list of values, or one value."""
    if isinstance(entry, dict):
        return record_of(entry, Factor, path, StudyError, _keys_of(Factor), f"factors.{key}")
    values = entry if isinstance(entry, list) else [entry]
    return record_of(
        {"values": values}, Factor, path, StudyError, _keys_of(Factor), f"factors.{key}"
    )


def _factor_problems(factors: Mapping[str, Factor]) -> list[str]:
    problems = []
    for key, factor in factors.items():
        kinds = ("values", "grid", *DISTRIBUTIONS)
        given = [name for name in kinds if getattr(factor, name) is not None]
        if len(given) != 1:
            got = " and ".join(given) or "none"
            problems.append(f"factors.{key}: expected one of {', '.join(kinds)}, got {got}")
        for name in ("uniform", "log_uniform", "grid"):
            limits = getattr(factor, name)
            if limits is not None and not limits[0] < limits[1]:
                problems.append(
                    f"factors.{key}.{name}: expected the lower value first, got {[*limits]}"
                )
        if factor.log_uniform is not None and factor.log_uniform[0] <= 0.0:
            problems.append(
                f"factors.{key}.log_uniform: expected values above 0, got {factor.log_uniform[0]:g}"
            )
        if factor.normal is not None and factor.normal[1] <= 0.0:
            problems.append(
                f"factors.{key}.normal: expected a standard deviation above 0, "
                f"got {factor.normal[1]:g}"
            )
        if factor.values == ():
            problems.append(f"factors.{key}: expected at least one value, got none")
        if key in RESERVED:
            problems.append(f"factors.{key}: every result has a column of this name")
        if factor.each and "*" not in key:
            problems.append(f"factors.{key}.each: expected a path with *, got none in {key!r}")
    return problems


def _problems(
    path: Path, study: Study, factors: Mapping[str, Factor], measures: Mapping[str, Measure]
) -> list[str]:
    problems = []
    if not _is_name(path.stem):
        problems.append(
            f"expected a file name of letters, digits, _ and -, which names the study, "
            f"got {path.stem!r}"
        )
    if not measures:
        problems.append("measures: expected at least one, got none")
    for key in measures:
        if key in factors:
            problems.append(f"measures.{key}: a factor has this name already")
        if not _is_name(key) or key in RESERVED:
            problems.append(
                f"measures.{key}: expected a name of letters, digits and _, none of "
                f"{', '.join(RESERVED)}"
            )
    if study.stop is not None and study.stop.measure not in {*measures, "success"}:
        problems.append(
            f"stop.measure: no measure {study.stop.measure!r}"
            f"{nearest(study.stop.measure, [*measures, 'success'])}"
        )
    if study.search is not None and study.search.measure not in measures:
        problems.append(
            f"search.measure: no measure {study.search.measure!r}"
            f"{nearest(study.search.measure, list(measures))}"
        )
    if study.sampling == "sobol" and study.samples & (study.samples - 1):
        problems.append(
            f"samples: expected a power of two, which Sobol points need, got {study.samples}"
        )
    return problems
