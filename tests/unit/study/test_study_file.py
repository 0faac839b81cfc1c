"""A study file that is wrong is refused with file, key, what was expected and what was found."""

import pytest

from scm.errors import StudyError
from scm.maps.load import MAPS_DIR
from scm.study.loaded_study import load
from tests.unit.study.studying import loaded, write


@pytest.mark.parametrize(
    ("old", "new", "where", "words"),
    [
        ("study = 1", "study = 2", "", "study: expected 1 (the study format), got 2"),
        ("replications = 4", "replications = 0", "replications", "Expected `int` >= 1"),
        ("replications = 4", "replication = 4", "", "did you mean 'replications'?"),
        ('"adds.py"', '"nowhere.py"', "scenario", "there is no such file"),
        ('"adds.py"', '"travel_tim"', "scenario", "did you mean 'travel_time'?"),
        ("a = [1.0, 2.0, 3.0]", "a = []", "factors.a", "expected at least one value"),
        ("a = [1.0, 2.0, 3.0]", "c = [1.0]", "factors.c", "no such argument"),
        ("a = [1.0, 2.0, 3.0]", "a = { uniform = [2.0, 1.0] }", "a.uniform", "lower value first"),
        ("a = [1.0, 2.0, 3.0]", "a = { uniform = [1.0] }", "factors.a.uniform", "2"),
        ("a = [1.0, 2.0, 3.0]", "a = { unifrom = [0, 1] }", "factors.a", "mean 'uniform'?"),
        ("a = [1.0, 2.0, 3.0]", "a = { std = 1.0, grid = [0, 1, 3] }", "a", "got grid and std"),
        ("a = [1.0, 2.0, 3.0]", "a = { log_uniform = [0, 1] }", "log_uniform", "above 0"),
        ("a = [1.0, 2.0, 3.0]", "a = { normal = [0, 0] }", "normal", "above 0"),
        ("a = [1.0, 2.0, 3.0]", "a = { values = [1], each = true }", "a.each", "a path with *"),
        ("a = [1.0, 2.0, 3.0]", "seed = [1]", "factors.seed", "a column of this name"),
        ("at_most = 4.5", "at_mots = 4.5", "measures.total", "did you mean 'at_most'?"),
        ("[measures.total]", "[measures.outcome]", "measures.outcome", "none of case"),
        ("[measures.total]", "[measures.a]", "measures.a", "a factor has this name"),
    ],
)
def test_a_wrong_file_is_refused_with_key_expected_and_got(tmp_path, old, new, where, words):
    path = write(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(StudyError) as refused:
        load(path)
    message = str(refused.value)
    assert message.startswith(str(path))
    assert where in message
    assert words in message


def test_all_problems_are_named_at_once(tmp_path):
    path = write(tmp_path, factors="b = { uniform = [3, 1] }\nluck = { normal = [0, -1] }")
    with pytest.raises(StudyError, match=r"factors\.b\.uniform(.|\n)*factors\.luck\.normal"):
        load(path)


@pytest.mark.parametrize(
    ("more", "tables", "words"),
    [
        ('sampling = "sobol"\nsamples = 12', "", "a power of two, which Sobol points need, got 12"),
        ("", '[stop]\nmeasure = "totl"\nhalf_width = 0.1', "did you mean 'total'?"),
        ("", '[search]\nmeasure = "totl"\ngoal = "minimize"', "did you mean 'total'?"),
    ],
)
def test_tables_that_name_no_measure_are_refused(tmp_path, more, tables, words):
    with pytest.raises(StudyError) as refused:
        loaded(tmp_path, more=more, tables=tables)
    assert words in str(refused.value)


def test_a_file_that_is_no_toml_and_none_at_all_are_refused(tmp_path):
    with pytest.raises(StudyError, match="nowhere"):
        load(tmp_path / "nowhere.toml")
    (tmp_path / "bad.toml").write_text("study = = 1")
    with pytest.raises(StudyError, match="a TOML file"):
        load(tmp_path / "bad.toml")


def test_a_scenario_that_cannot_be_imported_or_has_no_run_is_refused(tmp_path):
    path = write(tmp_path, scenario="import nowhere_at_all")
    with pytest.raises(StudyError, match=r"cannot be imported: ModuleNotFoundError"):
        load(path)
    path = write(tmp_path, scenario="walk = 1")
    with pytest.raises(StudyError, match=r"expected a function run\(case, \.\.\.\), got none"):
        load(path)


def test_an_argument_without_a_default_needs_a_factor(tmp_path):
    path = write(tmp_path, scenario="def run(case, a, b):\n    return {'total': a + b}")
    with pytest.raises(StudyError, match=r"factors\.b: the scenario needs it"):
        load(path)


def test_files_that_a_study_names_are_found_with_those_that_they_name(tmp_path):
    (tmp_path / "maps").mkdir()
    for name in ("proving_ground.toml", "proving_ground_hill.png", "proving_ground_wet.png"):
        (tmp_path / "maps" / name).write_bytes((MAPS_DIR / name).read_bytes())
    study = loaded(tmp_path, more='map = "maps/proving_ground.toml"')
    names = [str(path) for path in study.file.files()]
    assert names == [
        "adds.py", "maps/proving_ground.toml", "maps/proving_ground_hill.png",
        "maps/proving_ground_wet.png",
    ]  # fmt: skip
    assert study.base.city_map.name == "proving_ground"


def test_the_shortest_study_of_one_s_own(tmp_path):
    (tmp_path / "mine.py").write_text("def run(case):\n    return {'x': 1}\n")
    path = tmp_path / "mine.toml"
    path.write_text('study = 1\nscenario = "mine.py"\n[measures.x]\nunit = "m"\n')
    study = load(path)
    assert len(study.design) == 1
    assert study.run(0).measures == {"x": 1.0}
