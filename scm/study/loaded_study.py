"""A study with all that its cases share, and one case of it run in this process."""

import numbers
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scm.clock import WallClock, seconds
from scm.errors import StudyError, nearest
from scm.study.case import Case, MakeLockstep, plain_lockstep
from scm.study.design import Design, design_of
from scm.study.row import Outcome, Row
from scm.study.scenario import Scenario, load_scenario
from scm.study.study_file import StudyFile, Value, load_study
from scm.study.targets import Setting, base_setting, checked_map
from scm.vehicles.car import varied_cars

DETAIL_CHARACTERS = 500


@dataclass(frozen=True, slots=True)
class LoadedStudy:
    """A study that was read: file, scenario, what it starts from, and its cases."""

    file: StudyFile
    scenario: Scenario
    base: Setting
    design: Design

    def case(self, number: int, make: MakeLockstep = plain_lockstep) -> Case:
        """Return a case for its scenario.

        Raises:
            StudyError: when there is none of this number, or its values do not fit together.
        """
        if not 0 <= number < len(self.design):
            msg = f"case {number}: {self.file.name} has the cases 0 to {len(self.design) - 1}"
            raise StudyError(msg)
        return self.case_of(number, self.design.values(number), make)

    def case_of(
        self, number: int, values: Mapping[str, Value], make: MakeLockstep = plain_lockstep
    ) -> Case:
        """Return a case whose factors have given values, as a search chooses them.

        Raises:
            StudyError: when the values do not fit together.
        """
        setting = self.design.setting(values, self.base)
        if setting.city_map is not self.base.city_map:
            setting = checked_map(setting)
        return Case(self.file.name, number, self.design.seed(number), values, setting, make)

    def run(
        self,
        number: int,
        values: Mapping[str, Value] | None = None,
        make: MakeLockstep = plain_lockstep,
    ) -> Row:
        """Run one case here; whatever its scenario raises becomes its row.

        Args:
            number: Which case.
            values: Of its factors; None: as the design has them.
            make: How it makes a city.
        """
        clock = WallClock()
        began_ns = clock.now_ns()
        given = self.design.values(number) if values is None else values
        measures, detail = dict[str, float](), ""
        outcome: Outcome
        try:
            case = self.case_of(number, given, make)
            with varied_cars(case.cars):
                returned = self.scenario.run(case, **case.setting.arguments)
            measures = self._checked(returned)
            outcome = self._outcome(measures)
        except (Exception, SystemExit) as cause:  # noqa: BLE001  somebody else's code
            outcome, detail = "error", _detail(cause)
        return self.row(
            number, given, outcome, seconds(clock.now_ns() - began_ns), detail, measures
        )

    def row(
        self,
        number: int,
        values: Mapping[str, Value] | None,
        outcome: Outcome,
        took_s: float,
        detail: str = "",
        measures: Mapping[str, float] | None = None,
    ) -> Row:
        """Return the row of a case."""
        return Row(
            case=number,
            replication=self.design.replication(number),
            seed=self.design.seed(number),
            outcome=outcome,
            detail=detail,
            seconds=took_s,
            values=self.design.values(number) if values is None else values,
            measures=measures or {},
        )

    def _checked(self, returned: object) -> dict[str, float]:
        """Return a scenario's measures as numbers.

        Raises:
            StudyError: when it returned others than the study declares.
        """
        declared = self.file.measures
        if not isinstance(returned, Mapping):
            msg = f"the scenario returned {type(returned).__name__}, expected measures by name"
            raise StudyError(msg)
        problems = [
            f"{name}: declared by the study, not returned by the scenario"
            for name in declared
            if name not in returned
        ]
        for name, value in returned.items():
            if name not in declared:
                problems.append(
                    f"{name}: returned by the scenario, not declared by the study"
                    f"{nearest(str(name), list(declared))}"
                )
            elif not isinstance(value, numbers.Real | np.bool_):
                problems.append(f"{name}: expected a number, got {value!r}")
        if problems:
            raise StudyError("; ".join(problems))
        return {name: float(returned[name]) for name in declared}

    def _outcome(self, measures: Mapping[str, float]) -> Outcome:
        is_met = (limits.is_met(measures[name]) for name, limits in self.file.measures.items())
        return "success" if all(is_met) else "failure"


def load(path: Path, name: str = "") -> LoadedStudy:
    """Read a study file and all that it names.

    Args:
        path: Of the file.
        name: Of the study; empty: the file's.

    Raises:
        ScmError: It is wrong, with every reason that can be found without running it.
    """
    file = load_study(path, name)
    try:
        scenario = load_scenario(file.study.scenario, file.folder)
    except StudyError as cause:
        raise StudyError(f"{path}: {cause}") from cause
    base = base_setting(file, file.study.map or scenario.map)
    return LoadedStudy(file, scenario, base, design_of(file, base, scenario.parameters))


def _detail(cause: BaseException) -> str:
    """Return an error in one line: what it says, and the line of the scenario where it arose."""
    text = " ".join(f"{type(cause).__name__}: {cause}".split())
    frames = traceback.extract_tb(cause.__traceback__)
    own = [frame for frame in frames if "scm_study" in frame.filename or _is_own(frame.filename)]
    at = own[-1] if own else (frames[-1] if frames else None)
    where = "" if at is None else f" ({Path(at.filename).name}:{at.lineno})"
    return text[: DETAIL_CHARACTERS - len(where)] + where


def _is_own(filename: str) -> bool:
    """Return whether code is a scenario's: neither this package's nor a library's."""
    here = Path(__file__).parents[1]
    path = Path(filename)
    return "site-packages" not in path.parts and (
        here not in path.parents or path.parent.name == "scenarios"
    )
