"""Studies over REST: how far each is, what came of it, its page; nobody's scenario is run."""

import os
import shutil
import subprocess
import sys

import pytest

from scm.api import study_repository
from scm.api.app import create_app
from scm.api.folders import folders_in
from scm.study import record
from scm.study.record import study_record, study_row
from scm.study.results import create_results, open_results
from scm.study.run import run_study
from scm.study.stored import read_results
from tests.unit.study.studying import Here, loaded

SCENARIO = """from pathlib import Path
Path(__file__).with_name("was_imported").touch()

def run(case, a=1.0, b=0.0):
    if b > 0.9: raise ValueError('<too> much')
    return {'total': float('nan') if b > 0.8 else a + b}
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A complete study of 60 cases."""
    folder = tmp_path_factory.mktemp("made")
    study = loaded(
        folder, scenario=SCENARIO, factors="b = { uniform = [0.0, 1.0] }", more="samples = 5"
    )
    run_study(create_results(study, folder / "adding", []), Here(study), lambda _: None)
    return study, folder / "adding"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "runs" / "studies").mkdir(parents=True)
    return tmp_path / "runs" / "studies"


@pytest.fixture
def stored(made, folder):
    return shutil.copytree(
        made[1], folder / "adding", ignore=shutil.ignore_patterns("was_imported", "__pycache__")
    )


@pytest.fixture
def half(made, folder):
    """A study of which 7 cases have been run, by this process."""
    study, _ = made
    results = create_results(study, folder / "half", [])
    with pytest.raises(KeyboardInterrupt):
        run_study(results, Here(study, most=7), lambda _: None)
    results.write()
    return results


@pytest.fixture
def get(view, fake_city, city_map, folder, client_of):
    client = client_of(create_app(view, fake_city.ask, city_map, folders=folders_in(folder.parent)))

    def call(path="", status=200):
        answer = client("GET", f"/api/v1/studies{path}")
        assert answer.status_code == status, answer.text
        return answer

    return call


def test_a_city_without_studies_has_an_empty_list(get, folder):
    assert get().json() == {"items": [], "next": None}
    folder.rmdir()
    assert get().json() == {"items": [], "next": None}


def test_the_list_says_how_far_a_study_is_and_how_its_cases_ended(get, made, stored):
    rows = open_results(made[1]).rows.values()
    (row,) = get().json()["items"]
    assert (row["name"], row["title"], row["scenario"]) == ("adding", "Adding", "adds.py")
    assert (row["state"], row["cases"], row["done"]) == ("complete", 60, 60)
    for outcome, count in row["outcomes"].items():
        assert count == sum(one.outcome == outcome for one in rows), outcome
    assert row["success"]["cases"] == 60
    assert row["success"]["low"] < row["outcomes"]["success"] / 60 < row["success"]["high"]
    assert 0 < row["began_ns"] <= row["ended_ns"]
    assert row["trouble"] == ""


def test_a_study_runs_while_its_process_lives(get, half):
    (row,) = get().json()["items"]
    assert (row["state"], row["cases"], row["done"], row["ended_ns"]) == ("running", 60, 7, None)
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    half.note(pid=ended.pid)
    assert get().json()["items"][0]["state"] == "stopped"


def test_a_study_on_another_machine_has_stopped_when_no_case_can_take_so_long(get, half):
    half.note(host="elsewhere")
    assert get().json()["items"][0]["state"] == "running"
    for path in (half.folder / "manifest.json", half.folder / "parts"):
        os.utime(path, (0.0, 0.0))
    assert get().json()["items"][0]["state"] == "stopped"


def test_rows_that_were_counted_are_not_read_again(get, half):
    get()
    before = record._outcomes_in.cache_info()
    get()
    after = record._outcomes_in.cache_info()
    assert (after.misses, after.hits) == (before.misses, before.hits + 1)
    half.add(half.study.run(0))
    half.write()
    assert get().json()["items"][0]["done"] == 8
    assert record._outcomes_in.cache_info().misses == before.misses + 1


def test_a_study_that_is_begun_anew_in_the_same_folder_is_counted_anew(get, made, stored, half):
    assert sorted(row["done"] for row in get().json()["items"]) == [7, 60]
    for folder in (stored, half.folder):
        shutil.rmtree(folder)
        results = create_results(made[0], folder, [])
        results.add(results.study.run(0))
        results.write()
    assert [row["done"] for row in get().json()["items"]] == [1, 1]


@pytest.mark.parametrize(
    ("file", "content", "why"),
    [
        ("study.toml", None, "expected the folder of a study, with study.toml"),
        ("study.toml", b"study = 1\nscenario = 3", "study.toml"),
        ("manifest.json", b"{}", "manifest.json: not a study's manifest"),
        ("manifest.json", b'{"name": "adding", "cases": "many"}', "manifest.json"),
        ("cases.parquet", b"PAR1 no more", "cases.parquet: not rows of a study"),
    ],
)
def test_a_study_that_cannot_be_read_is_listed_with_the_reason(get, stored, file, content, why):
    shutil.copytree(stored, stored.with_name("good"))
    if content is None:
        (stored / file).unlink()
    else:
        (stored / file).write_bytes(content)
    rows = {row["name"]: row for row in get().json()["items"]}
    assert rows["good"]["state"] == "complete"
    assert rows["adding"]["state"] == "unreadable"
    assert why in rows["adding"]["trouble"]
    assert str(stored.parent) not in rows["adding"]["trouble"]


def test_stored_results_are_those_of_the_run_without_its_scenario(made):
    study, folder = made
    stored, results = read_results(folder), open_results(folder)
    assert repr(stored.rows) == repr(results.rows)
    assert [(axis.path, axis.factor) for axis in stored.axes] == [
        (axis.path, axis.factor) for axis in study.design.axes
    ]
    assert (stored.cases, stored.about) == (results.cases, results.about)


def test_each_match_of_a_factor_is_an_axis_of_its_own_when_it_is_read_again(tmp_path):
    study = loaded(tmp_path, factors='"spawns.*.x" = { normal = [0, 0.1], each = true }')
    create_results(study, tmp_path / "out", [])
    axes = read_results(tmp_path / "out").axes
    assert [axis.path for axis in axes] == [axis.path for axis in study.design.axes]
    assert len(axes) > 3


def test_a_record_has_factors_measures_tables_and_the_worst_cases(made):
    found = study_record(read_results(made[1]))
    assert [(one.path, one.kind, one.values) for one in found.factors] == [
        ("a", "values", (1.0, 2.0, 3.0)),
        ("b", "uniform", (0.0, 1.0)),
    ]
    assert [(one.name, one.unit, one.at_most) for one in found.measures] == [("total", "1", 4.5)]
    by_a, by_b = found.tables
    assert [level.level for level in by_a.levels] == ["1", "2", "3"]
    assert len(by_b.levels) == 5
    rows = read_results(made[1]).rows.values()
    two = [row for row in rows if row.values["a"] == 2.0]
    estimates = by_a.levels[1].estimates
    assert estimates["success"].value == sum(row.outcome == "success" for row in two) / 20
    assert estimates["total"].low < estimates["total"].value < estimates["total"].high
    assert {case.outcome for case in found.worst} == {"error", "failure"}
    ended = [case.outcome != "error" for case in found.worst]
    assert ended == sorted(ended)
    assert "<too> much" in found.worst[0].detail


def test_too_few_cases_have_no_interval(made, folder):
    results = create_results(made[0], folder / "one", [])
    results.add(results.study.run(0))
    results.write()
    (level,) = study_record(read_results(folder / "one")).tables[0].levels
    assert level.estimates["total"].low is None


def test_a_study_is_shown_without_its_scenario_being_imported(get, stored):
    (stored / "study.html").write_text("an old page")
    os.utime(stored / "study.html", (0.0, 0.0))
    get()
    study = get("/adding").json()
    assert study["row"] == get().json()["items"][0]
    assert study["worst"][-1]["measures"]["total"] is None  # NaN
    page = get("/adding/page")
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    assert page.headers["content-security-policy"].startswith("sandbox; default-src 'none'; ")
    assert "&lt;too&gt; much" in page.text
    assert not (stored / "was_imported").exists()
    (stored / "study.html").write_text("of this moment")
    assert get("/adding/page").text == "of this moment"


def test_a_study_that_cannot_be_shown_is_refused_in_words(get, stored):
    (stored / "manifest.json").write_text("{}")
    answer = get("/adding/page", 409).json()
    assert answer["code"] == "unreadable"
    assert "manifest.json: not a study's manifest" in answer["detail"]
    assert str(stored.parent) not in answer["detail"]


@pytest.mark.parametrize(("name", "status"), [("other", 404), (".hidden", 422), ("a%2F..", 404)])
def test_a_study_that_is_not_there_is_not_found(get, stored, name, status):
    (stored.parent / ".hidden").mkdir()
    for path in (f"/{name}", f"/{name}/page"):
        assert "code" in get(path, status).json()


def test_without_the_extra_the_routes_say_what_to_install(get, monkeypatch):
    real = study_repository.find_spec
    monkeypatch.setattr(
        study_repository, "find_spec", lambda name: None if name == "pyarrow" else real(name)
    )
    for path in ("", "/adding", "/adding/page"):
        answer = get(path, 409).json()
        assert answer["code"] == "not_installed"
        assert answer["detail"] == "studies need pyarrow: `pip install 'scm[study]'`"


def test_the_server_starts_without_what_studies_need():
    program = (
        "import sys; from scm.api.app import create_app; from scm.api.view import CityView; "
        "from scm.maps.load import load_map; "
        "create_app(CityView(), None, load_map('driving_school')); "
        "names = ('pyarrow', 'scipy.special', 'scipy.stats', 'matplotlib', 'scm.study'); "
        "print([name for name in names if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert done.stdout.decode().strip() == "[]"


def test_a_listed_study_is_the_row_of_its_folder(made):
    assert study_row(made[1]) == study_record(read_results(made[1])).row
