"""Versions of a car's file: which is in force, and why."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from scm.mismatch.findings import Fit, PartErrors
from scm.records.twins import TwinEffect, TwinError, TwinParameter
from scm.twin.abilities import abilities_of, compared_abilities, strayed_m
from scm.twin.investigation import Compared, Explained, compare
from scm.twin.versions import BY_TWIN, CarVersions, differences, is_worse, meaning, verdict
from scm.vehicles.car import load_car
from scm.vehicles.correlated import Correlated
from tests.unit.mismatch.made_drive import made_drive, nigel

TRIM = -0.05
STOPS = TwinParameter(name="stopping_m", value=0.058, low=0.052, high=0.066, unit="m", before=0.007)
TRIMMED = TwinEffect(name="steer_trim", probability=0.9, parameters=())
FOUND = Explained((TRIMMED,), (), "", "", None, Path("1.toml"), (STOPS,))


def compared(*, better=(), worse=()):
    errors = (TwinError(name="position_m", before=0.03, now=0.004),)
    return Compared(100, errors, tuple(better), tuple(worse))


def states(versions):
    return [one.state for one in versions.newest]


def test_file_that_the_car_came_with_is_version_0_in_force():
    versions = CarVersions("nigel")
    assert (versions.in_force.number, versions.in_force.file) == (0, "nigel")
    assert versions.candidate is None


def test_candidate_is_adopted_with_errors_and_reason_and_can_be_taken_back():
    versions = CarVersions("nigel")
    made = versions.propose(FOUND, "report", 5)
    assert (made.number, made.after, versions.candidate) == (1, 0, made)
    assert (made.file, made.effects, made.abilities) == ("1.toml", ("steer_trim",), (STOPS,))
    changed = versions.put_in_force(1, BY_TWIN, "better", compared(better=["position_m"]))
    assert [(one.number, one.state) for one in changed] == [(0, "replaced"), (1, "adopted")]
    assert versions.in_force.windows == 100
    assert versions.in_force.errors == compared().errors
    versions.put_in_force(0, "anna", "I know better")
    assert states(versions) == ["adopted", "rolled_back"]
    assert (versions[1].by, versions[1].reason) == ("anna", "I know better")
    versions.put_in_force(1, "anna", "no")
    assert states(versions) == ["replaced", "adopted"]


def test_rejected_candidate_stays_in_the_list_and_the_next_has_a_new_number():
    versions = CarVersions("nigel")
    versions.propose(FOUND, "", 5)
    assert versions.reject("no better").state == "rejected"
    assert versions.reject("again") is None
    assert versions.propose(FOUND, "", 6).number == 2
    assert versions.in_force.number == 0


def test_stored_versions_come_back_but_not_those_of_another_file():
    stored = CarVersions("nigel")
    stored.propose(FOUND, "", 5)
    stored.put_in_force(1, BY_TWIN, "better")
    assert CarVersions("nigel", stored.newest).in_force.number == 1
    assert CarVersions("f1tenth", stored.newest).in_force.file == "f1tenth"


@pytest.mark.parametrize(
    ("better", "worse", "is_last", "action"),
    [
        (["position_m"], [], False, "adopt"),
        ([], [], False, "wait"),
        ([], [], True, "reject"),
        (["position_m"], ["gyro_rad"], False, "wait"),
        (["position_m"], ["gyro_rad"], True, "reject"),
    ],
)
def test_nothing_is_adopted_that_is_no_better_or_worse_in_anything(better, worse, is_last, action):
    found, reason = verdict(compared(better=better, worse=worse), is_last=is_last)
    assert found == action
    assert "position 30 to 4 mm after 3 s, 100 windows" in reason


def test_only_a_worse_pose_rolls_back():
    assert is_worse(compared(worse=["yaw_rad"]))
    assert not is_worse(compared(worse=["gyro_rad"]))


@pytest.fixture(scope="module")
def trimmed(tmp_path_factory):
    """The file of a Nigel with trimmed steering."""
    text = nigel().path.read_text("utf-8")
    text = text.replace("terms = [", 'terms = [\n    "steer_trim",', 1)
    path = tmp_path_factory.mktemp("cars") / "trimmed.toml"
    head, section, rest = text.partition("[steering]")
    path.write_text(f"{head}{section}\ntrim_rad = {{ value = {TRIM} }}{rest}", "utf-8")
    return path


def test_car_file_that_is_right_is_better_on_new_driving_and_the_wrong_one_worse(trimmed):
    drive = made_drive([("steering.trim_rad", TRIM)], seconds=40.0)
    right, wrong = (
        compare(drive, *files) for files in (("nigel", str(trimmed)), (str(trimmed), "nigel"))
    )
    assert {"position_m", "yaw_rad"} <= set(right.better)
    assert right.worse == ()
    assert {"position_m", "yaw_rad"} <= set(wrong.worse)
    assert right.windows > 20


def test_difference_of_two_files_names_effects_and_numbers(trimmed):
    now = load_car(trimmed)
    lines = differences(nigel(), now)
    assert lines == ["with steer_trim", f"steering.trim_rad {TRIM:g} rad"]
    mass = now.quantity("body.mass_kg")
    assert mass.std is not None
    for times, line in ((0.5, "1 numbers moved by less"), (2.0, "body.mass_kg 2.4 to ")):
        moved = mass.value + times * mass.std
        heavier = type(mass)(moved, mass.std, mass.unit, "test")
        other = replace(now, values={**now.values, "body.mass_kg": heavier})
        assert any(one.startswith(line) for one in differences(now, other))


def test_abilities_are_reported_where_they_changed():
    same = structs.replace(STOPS, before=0.055)
    turns = TwinParameter(
        name="turning_radius_m", value=0.281, low=0.271, high=0.287, unit="m", before=0.2493
    )
    assert meaning([same]) == []
    assert meaning([STOPS, turns]) == [
        "needs 58 mm from there to stop, 7 before",
        "turns in a radius of 281 mm at best, 249 before",
    ]


def test_late_throttle_lengthens_the_way_to_stop_and_trim_the_wider_circle(trimmed, tmp_path):
    text = nigel().path.read_text("utf-8").replace("terms = [", 'terms = ["drive_delay",', 1)
    late = tmp_path / "late.toml"
    late.write_text(text.replace("[drive]", "[drive]\ndelay_s = { value = 0.25 }", 1), "utf-8")
    speed, stopping, _ = compared_abilities(nigel(), load_car(late))
    assert stopping.before == pytest.approx(0.007, abs=0.001)
    assert stopping.value == pytest.approx(stopping.before + 0.25 * speed.value, rel=0.1)
    assert speed.low < speed.before < speed.high
    other_way = tmp_path / "other_way.toml"
    other_way.write_text(trimmed.read_text("utf-8").replace(f"{TRIM}", f"{-TRIM}"), "utf-8")
    for file in (trimmed, other_way):
        *_, radius = compared_abilities(nigel(), load_car(file))
        assert radius.low > 1.05 * radius.before


def test_nine_in_ten_other_cars_of_the_file_lie_in_the_interval_about_what_it_says():
    abilities = compared_abilities(nigel(), nigel())
    others = abilities_of(nigel(), count=400, seed=2)
    for one, values in zip(abilities, (others.speed, others.stopping, others.radius), strict=True):
        assert one.value == one.before == values[0]  # the first is as the file says
        about = values - np.median(values) + one.value
        assert 0.84 < np.mean((about >= one.low) & (about <= one.high)) < 0.96


def seen(after, floor, horizon_s=3.0):
    """How a car followed driving that no fit has seen, and driving that one has."""
    unseen = PartErrors(windows=18, before=after, after=after, noise_floor=floor)
    known = PartErrors(windows=18, before={}, after={"wheel_m": 9.0}, noise_floor={})
    return Fit(horizon_s=horizon_s, fit=known, choose=known, confirm=unseen)


def test_interval_contains_how_far_the_file_strays_on_unseen_driving_beyond_noise():
    strays = seen({"wheel_m": 0.005, "position_m": 0.1}, {"wheel_m": 0.003}, 2.0)
    without = compared_abilities(nigel(), nigel())
    now = compared_abilities(nigel(), nigel(), strays)
    for one, plain, more in zip(now, without, (0.004 / 2.0, 0.004, 0.0), strict=True):
        assert one.value == plain.value
        above, before = one.high - one.value, plain.high - plain.value
        assert above == pytest.approx(np.hypot(before, 1.645 * more))
        below, before = one.value - one.low, plain.value - plain.low
        assert below == pytest.approx(min(np.hypot(before, 1.645 * more), one.value))


@pytest.mark.parametrize(
    ("after", "floor", "strays_m"),
    [
        ({"position_m": 0.005}, {"position_m": 0.004}, 0.003),
        ({"wheel_m": 0.001}, {"wheel_m": 0.002}, 0.0),
        ({}, {}, 0.0),
    ],
)
def test_car_strays_by_its_wheels_or_else_its_poses_and_never_less_than_noise(
    after, floor, strays_m
):
    assert strayed_m(seen(after, floor).confirm) == pytest.approx(strays_m)


def test_errors_that_come_together_narrow_or_widen_what_a_car_may_do():
    numbers = ("drive.no_load_speed_rad_s", "wheel.damping_linear_nms")

    def spread(correlation):
        matrix = ((1.0, correlation), (correlation, 1.0))
        car = replace(nigel(), correlated=(Correlated(numbers, matrix),))
        return np.std(abilities_of(car).speed)

    assert spread(-0.99) > 1.1 * spread(0.99)
