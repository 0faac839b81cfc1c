"""Plug-ins by file: found without importing, loaded by name, wrong ones refused by name."""

import sys

import pytest

from scm.errors import MapError, TermError
from scm.registry import load, names


@pytest.fixture
def package(tmp_path, monkeypatch):
    folder = tmp_path / "plugged"
    folder.mkdir()
    files = {
        "__init__": "",
        "beta": "THING = 2",
        "alpha": "THING = 1",
        "wrong": "THING = 'one'",
        "empty": "",
        "broken": "raise RuntimeError('imported')",
    }
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    yield "plugged"
    for name in [name for name in sys.modules if name.split(".")[0] == "plugged"]:
        del sys.modules[name]


def test_names_are_the_files_sorted_and_nothing_is_imported(package):
    assert names(package) == ["alpha", "beta", "broken", "empty", "wrong"]


def test_a_plug_in_is_loaded_by_the_name_of_its_file(package):
    assert load(package, "beta", "THING", int) == 2


def test_an_unknown_name_is_refused_with_the_nearest_one(package):
    with pytest.raises(TermError, match=r"plugged: no thing named 'alfa' \(did you mean 'alpha'"):
        load(package, "alfa", "THING", int)


@pytest.mark.parametrize("name", ["wrong", "empty"])
def test_a_constant_of_another_type_is_refused_with_its_file(package, name):
    with pytest.raises(TermError, match=rf"plugged\.{name}: expected THING = int"):
        load(package, name, "THING", int)


def test_the_error_is_the_one_the_caller_asks_for(package):
    with pytest.raises(MapError):
        load(package, "nothing", "THING", int, error=MapError)


def test_an_error_inside_a_plug_in_is_not_hidden(package):
    with pytest.raises(RuntimeError, match="imported"):
        load(package, "broken", "THING", int)
