"""Running a study: stop rule, fail-fast, recordings; and a search."""

import pytest

from scm.errors import RunError, StudyError
from scm.study.results import create_results, open_results
from scm.study.run import run_study
from scm.study.search import run_search
from tests.unit.study.studying import Here, loaded

STOP = '[stop]\nmeasure = "total"\nhalf_width = 0.1\nat_least = 3'
SEARCH = '[search]\nmeasure = "total"\ngoal = "minimize"\ncases = {cases}\nstop_below = {below}'


def run(study, folder, engine=None, **options):
    rows = []
    results = create_results(study, folder, [])
    end = run_study(results, engine or Here(study), rows.append, **options)
    return rows, end


def test_it_stops_after_the_replication_with_which_enough_is_known(tmp_path):
    study = loaded(tmp_path, tables=STOP.replace("0.1", "1e-9"))
    rows, end = run(study, tmp_path / "narrow")
    assert (len(rows), end.why) == (12, "all cases are there")
    study = loaded(tmp_path, tables=STOP.replace("0.1", "10.0"))
    rows, end = run(study, tmp_path / "wide")
    assert (len(rows), end.why) == (9, "enough is known")


def test_the_stop_rule_does_not_depend_on_where_it_was_broken_off(tmp_path):
    study = loaded(tmp_path, tables=STOP.replace("0.1", "10.0"))
    with pytest.raises(KeyboardInterrupt):
        run(study, tmp_path / "out", Here(study, most=4))
    run(study, tmp_path / "out")
    assert len(open_results(tmp_path / "out").rows) == 9


def test_fail_fast_ends_at_the_first_error_and_says_it(tmp_path):
    scenario = (
        "def run(case, a=1.0):\n    if a > 2.5: raise ValueError('too much')\n"
        "    return {'total': a}\n"
    )
    study = loaded(tmp_path, scenario=scenario)
    rows, end = run(study, tmp_path / "all")
    assert end.is_complete
    assert sum(row.outcome == "error" for row in rows) == 4
    with pytest.raises(RunError, match=r"case 11: error: ValueError: too much \(adds\.py:2\)"):
        run(study, tmp_path / "fast", fail_fast=True)


@pytest.mark.parametrize(
    ("returned", "words"),
    [
        ("None", "the scenario returned NoneType, expected measures by name"),
        ("{}", "total: declared by the study, not returned"),
        ("{'total': 1.0, 'totl': 2.0}", "totl: returned by the scenario, not declared"),
        ("{'total': 'much'}", "total: expected a number, got 'much'"),
    ],
)
def test_measures_that_are_not_those_declared_are_an_error(tmp_path, returned, words):
    study = loaded(tmp_path, scenario=f"def run(case, a):\n    return {returned}\n")
    row = study.run(0)
    assert row.outcome == "error"
    assert words in row.detail


def test_numbers_of_numpy_are_numbers(tmp_path):
    scenario = "import numpy as np\ndef run(case, a):\n    return {'total': np.float32(1.5), }\n"
    row = loaded(tmp_path, scenario=scenario).run(0)
    assert (row.outcome, row.detail, row.measures) == ("success", "", {"total": 1.5})


def test_cases_are_recorded_by_running_them_again(tmp_path):
    scenario = (
        "MAP = 'driving_school'\n"
        "def run(case, a):\n"
        "    with case.lockstep([case.world(room=1)]) as city:\n"
        "        city.run_for(0.5)\n"
        "    return {'total': 3.0 * a}\n"
    )
    study = loaded(tmp_path, scenario=scenario, more='recordings = "failures"\nmax_recordings = 2')

    class Recording(Here):
        def run(self, tasks):
            for task in tasks:
                if task.record_to:
                    recorded.append((task.case, task.record_to))
                yield study.run(task.case)

    recorded = []
    run(study, tmp_path / "out", Recording(study))
    folder = (tmp_path / "out" / "recordings").resolve()
    assert recorded == [(n, str(folder / f"case-{n}.mcap")) for n in (1, 2)]


def search(folder, tables, cases, below, factors=""):
    study = loaded(folder, tables=tables.format(cases=cases, below=below), factors=factors)
    rows = []
    results = create_results(study, folder / "found", [])
    return rows, run_search(results, Here(study), rows.append)


def test_a_search_ends_with_the_first_case_beyond_the_limit(tmp_path):
    factors = "b = { uniform = [0.0, 10.0] }\nluck = [0.0]"
    rows, found = search(tmp_path, SEARCH, 100, 2.0, factors)
    assert found.is_beyond
    assert found.worst.measures["total"] < 2.0
    assert found.cases == len(rows) < 100


def test_a_search_goes_on_where_it_was_broken_off(tmp_path):
    factors = "b = { uniform = [0.0, 10.0] }\nluck = [0.0]"
    first, found = search(tmp_path, SEARCH, 10, -1.0, factors)
    assert (len(first), found.is_beyond) == (10, False)
    again, found = search(tmp_path, SEARCH, 10, -1.0, factors)
    assert (again, found.cases) == ([], 10)


def test_a_study_without_a_search_says_what_is_missing(tmp_path):
    study = loaded(tmp_path)
    with pytest.raises(StudyError, match=r"search: missing; expected \[search\]"):
        run_search(create_results(study, tmp_path / "out", []), Here(study), print)
