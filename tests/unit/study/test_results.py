"""The folder of a study: rows are safe at once, and mean the same when they are read again."""

import json
import math

import pyarrow.parquet as pq
import pytest

from scm.errors import StudyError
from scm.study.results import Results, create_results, open_results
from scm.study.run import run_study
from scm.study.stored import read_manifest
from tests.unit.study.studying import Here, loaded


@pytest.fixture
def study(tmp_path):
    return loaded(
        tmp_path, factors='b = { uniform = [0, 1] }\n"junctions.0.plan" = ["calm", "brisk"]'
    )


def results_of(study, folder, engine=None, **options):
    results = create_results(study, folder, ["scm", "study", "run"])
    end = run_study(results, engine or Here(study), lambda _: None, **options)
    assert end.is_complete
    return results


def test_rows_are_as_they_were_when_read_again(study, tmp_path):
    written = results_of(study, tmp_path / "out").rows
    read = open_results(tmp_path / "out").rows
    assert read == written
    assert list(read) == list(range(len(study.design)))


def test_the_file_opens_as_a_plain_table_with_units(study, tmp_path):
    results_of(study, tmp_path / "out")
    table = pq.read_table(tmp_path / "out" / "cases.parquet")
    assert table.column_names == [
        "case", "replication", "seed", "a", "b", "junctions.crossing.plan", "total", "outcome",
        "detail", "seconds",
    ]  # fmt: skip
    assert table.schema.field("total").metadata[b"unit"] == b"1"
    assert table["case"].to_pylist() == list(range(24))
    assert set(table["junctions.crossing.plan"].to_pylist()) == {"calm", "brisk"}


def test_the_manifest_says_what_ran_where(study, tmp_path):
    results_of(study, tmp_path / "out")
    manifest = read_manifest(tmp_path / "out")
    assert manifest["name"] == "adding"
    assert manifest["cases"] == 24
    assert manifest["state"] == "complete"
    assert manifest["began"] <= manifest["ended"]
    assert {"scm", "git", "python", "packages", "machine"} <= set(manifest)


def test_a_study_goes_on_where_it_was_broken_off_and_ends_with_the_same_rows(study, tmp_path):
    whole = results_of(study, tmp_path / "whole").rows
    broken = create_results(study, tmp_path / "broken", [])
    with pytest.raises(KeyboardInterrupt):
        run_study(broken, Here(study, most=7), lambda _: None)
    broken.write()
    new = []
    again = create_results(study, tmp_path / "broken", [])
    assert len(again.rows) == 7
    run_study(again, Here(study), new.append)
    assert len(new) == 24 - 7
    for number, row in open_results(tmp_path / "broken").rows.items():
        assert (row.seed, row.values, row.measures) == (
            whole[number].seed, whole[number].values, whole[number].measures,
        )  # fmt: skip


def test_a_crash_while_writing_leaves_what_was_there(study, tmp_path, monkeypatch):
    results = create_results(study, tmp_path / "out", [])
    results.add(study.run(0))
    results.write()
    (tmp_path / "out" / "parts" / "000000002.new").write_bytes(b"half a file")
    assert list(open_results(tmp_path / "out").rows) == [0]


def test_a_crash_between_the_whole_file_and_its_parts_counts_no_case_twice(study, tmp_path):
    results = results_of(study, tmp_path / "out")
    folder = tmp_path / "out" / "parts"
    folder.mkdir()
    table = pq.read_table(tmp_path / "out" / "cases.parquet")
    pq.write_table(table.slice(0, 5), folder / "000000001.parquet")
    again = open_results(tmp_path / "out")
    assert again.rows == results.rows
    again.finish()
    assert pq.read_table(tmp_path / "out" / "cases.parquet").num_rows == 24


def test_a_row_that_comes_twice_counts_once(study, tmp_path):
    results = create_results(study, tmp_path / "out", [])
    for _ in range(2):
        results.add(study.run(3))
    results.write()
    assert len(open_results(tmp_path / "out").rows) == 1


def test_rows_of_a_changed_study_are_not_mixed(study, tmp_path):
    results_of(study, tmp_path / "out")
    changed = loaded(tmp_path, factors="b = { uniform = [0, 2] }")
    with pytest.raises(StudyError, match=r"study\.toml changed since .* use --out"):
        create_results(changed, tmp_path / "out", [])
    other = loaded(tmp_path, name="other")
    with pytest.raises(StudyError, match="expected results of other, got those of adding"):
        create_results(other, tmp_path / "out", [])


def test_rows_of_a_changed_scenario_are_not_mixed(study, tmp_path):
    results_of(study, tmp_path / "out")
    path = tmp_path / "adds.py"
    path.write_text(path.read_text() + "# better now\n")
    with pytest.raises(StudyError, match=r"adds\.py changed"):
        create_results(study, tmp_path / "out", [])


def test_a_folder_that_holds_no_study_is_refused(tmp_path):
    with pytest.raises(StudyError, match="expected the folder of a study"):
        open_results(tmp_path)


def test_a_damaged_manifest_or_table_is_refused_by_name(study, tmp_path):
    results_of(study, tmp_path / "out")
    manifest = tmp_path / "out" / "manifest.json"
    good = manifest.read_text()
    manifest.write_text("{}")
    with pytest.raises(StudyError, match=r"manifest\.json"):
        open_results(tmp_path / "out")
    manifest.write_text(good)
    (tmp_path / "out" / "cases.parquet").write_bytes(b"PAR1 no more")
    with pytest.raises(StudyError, match=r"cases\.parquet: .*rows of a study"):
        open_results(tmp_path / "out")


def test_measures_that_could_not_be_taken_are_nan_and_those_of_errors_are_missing(tmp_path):
    scenario = (
        "def run(case, a=1.0):\n    if a > 2.5: raise ValueError('too much')\n"
        "    return {'total': float('nan') if a > 1.5 else a}\n"
    )
    study = loaded(tmp_path, scenario=scenario, more="")
    results_of(study, tmp_path / "out")
    rows = open_results(tmp_path / "out").rows
    assert rows[0].outcome == "success"
    assert math.isnan(rows[1].measures["total"])
    assert rows[1].outcome == "failure"
    assert rows[2].outcome == "error"
    assert rows[2].measures == {}
    assert rows[2].detail == "ValueError: too much (adds.py:2)"


def test_a_folder_is_complete_only_with_its_study_file(study, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "manifest.json").write_text(json.dumps({"name": "adding"}))
    assert isinstance(create_results(study, folder, []), Results)
