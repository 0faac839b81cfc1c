"""A car file may list an effect of its own, in a file beside it."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from scm.errors import CarError
from scm.vehicles.car import all_terms, load_car
from scm.vehicles.describe import describe_car
from scm.vehicles.fleet import Fleet

EXAMPLE = Path(__file__).parents[3] / "examples" / "own_car"


@pytest.fixture
def folder(tmp_path):
    for name in ("buggy.toml", "carpet_nap.py"):
        shutil.copy(EXAMPLE / name, tmp_path)
    return tmp_path


def change(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_an_effect_beside_the_car_file_is_listed_and_its_keys_are_known(folder):
    car = load_car(folder / "buggy.toml")
    assert car.terms[-1].name == "carpet_nap"
    assert car.value("carpet_nap.coefficient_ns_m") == 1.5
    assert "\n  carpet_nap " in describe_car(car)


def test_a_changed_file_is_another_effect(folder):
    before = load_car(folder / "buggy.toml").terms[-1]
    change(folder / "carpet_nap.py", "return -vx *", "return -2.0 * vx *")
    after = load_car(folder / "buggy.toml").terms[-1]
    assert after.module != before.module


def test_the_same_file_is_the_same_effect_every_time(folder):
    assert load_car(folder / "buggy.toml").terms[-1] is load_car(folder / "buggy.toml").terms[-1]


def test_own_effects_are_given_as_objects_too(folder):
    term = load_car(folder / "buggy.toml").terms[-1]
    car = load_car("nigel").with_terms([term], {"carpet_nap.coefficient_ns_m": 2.0})
    assert car.value("carpet_nap.coefficient_ns_m") == 2.0


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("buggy.toml", "carpet_nap.py", "carpet_map.py", r"carpet_map\.py: no such file in"),
        ("buggy.toml", "carpet_nap.py", "../nap.py", r"\.\./nap\.py: expected a file beside"),
        ("carpet_nap.py", "TERM = ", "OTHER = ", r"carpet_nap\.py: expected TERM = Term"),
        (
            "carpet_nap.py",
            "import kernel_function",
            "import lore",
            r"does not run: ImportError: .*'lore'",
        ),
        ("carpet_nap.py", 'adds="force_x"', 'adds="force_xx"', r"'force_xx' is no such sum"),
        ("carpet_nap.py", "cos_yaw", "cos_yav", r"'cos_yav', .* mean 'cos_yaw'"),
        ("carpet_nap.py", "-vx *", "-math.sin(vx) *", r"nap\.py:27: .*, got 'math\.sin\(vx\)'"),
        ("carpet_nap.py", "-vx *", "-vx**2 *", r"carpet_nap\.py:27: .*, got 'vx \*\* 2'"),
        ("carpet_nap.py", "-vx *", "-cos_yav *", r":27: .* mean 'cos_yaw'\?\), got 'cos_yav'"),
        (
            "carpet_nap.py",
            "(along)",
            "(along, 1.0)",
            r":18: .*: expected 1 arguments, got 'sin_cos",
        ),
        ("carpet_nap.py", "sin_along, cos_along =", "both =", r":18: .* expected 2 names"),
        ("buggy.toml", "coefficient_ns_m", "coeficient", r"mean 'carpet_nap\.coefficient_ns_m'"),
        ("buggy.toml", "value = 1.5,", "value = 99.0,", r"expected 0 to 50 N\*s/m, got 99"),
    ],
)
def test_a_wrong_file_is_refused_by_name(folder, file, old, new, said):
    change(folder / file, old, new)
    with pytest.raises(CarError, match=said):
        load_car(folder / "buggy.toml")


@pytest.mark.parametrize(
    ("old", "new"),
    [("TERM = ", "OTHER = "), ("import kernel_function", "import lore"), ("-vx *", "-vx**2 *")],
)
def test_an_effect_that_cannot_be_loaded_is_one_problem_not_two(folder, old, new):
    change(folder / "carpet_nap.py", old, new)
    with pytest.raises(CarError) as refused:
        load_car(folder / "buggy.toml")
    assert "no such section" not in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_law_may_use_whole_numbers_and_the_numbers_of_math(folder):
    change(folder / "carpet_nap.py", "-vx *", "-2 * vx * (1 / math.pi) *")
    term = load_car(folder / "buggy.toml").terms[-1]
    few = [all_terms()[name] for name in ("suspension_spring", "tyre_contact")]
    Fleet(replace(load_car("nigel").with_terms([term]), terms=(*few, term)), 1)


def test_a_car_file_that_came_with_data_may_not_run_code(folder):
    with pytest.raises(CarError, match=r"carpet_nap\.py is code; if you trust it"):
        load_car(folder / "buggy.toml", trusted=False)


def test_an_effect_may_not_take_the_name_of_another(folder):
    text = (folder / "carpet_nap.py").read_text(encoding="utf-8")
    (folder / "wind.py").write_text(text.replace("def carpet_nap(", "def wind(").replace(
        "    carpet_nap,\n", "    wind,\n").replace("damping=carpet_nap_damping,\n", ""),
        encoding="utf-8")  # fmt: skip
    change(folder / "buggy.toml", '"carpet_nap.py"', '"carpet_nap.py", "wind.py"')
    with pytest.raises(CarError, match=r"wind\.py: 'wind' is an effect already"):
        load_car(folder / "buggy.toml")
