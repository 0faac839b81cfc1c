"""Cars under one camera: what all see is the camera's, what one sees is its own."""

from functools import cache

import numpy as np
import pytest

from scm.mismatch.several.effect_in_car import EffectInCar
from scm.mismatch.several.findings import Agreement, Cause
from scm.mismatch.several.shared_effects import compared
from tests.unit.mismatch.made_cars import drive_of, selected, tagged, tilted

CARS = ("a", "b", "c")
TILT, WEAK, TAG_M = 0.04, 0.022, 0.03


@cache
def drives():
    return {name: drive_of(seed) for seed, name in enumerate(CARS, start=1)}


@cache
def healthy():
    return {name: selected(drive) for name, drive in drives().items()}


@cache
def under_one_tilted_camera():
    """Only the first car's search found the tilt."""
    found = {"a": {"camera_tilt": (0.02, 0.0)}}
    cars = {
        name: selected(tilted(drive, TILT, 0.0), **found.get(name, {}))
        for name, drive in drives().items()
    }
    return cars, *compared(cars, lambda _: None)


def test_what_all_cars_see_is_the_cameras():
    _, (tilt,), _ = under_one_tilted_camera()
    assert (tilt.name, tilt.cause, tilt.shared) == ("camera_tilt", Cause.CAMERA, True)
    assert [one.agreement for one in tilt.cars] == [Agreement.CONFIRMS] * 3
    assert [one.alone for one in tilt.cars] == [True, False, False]
    assert tilt.conclusion == "All 3 cars see it alike: it is the camera, not the cars."


def test_all_cars_together_know_the_tilt_better_than_each_alone():
    _, (tilt,), _ = under_one_tilted_camera()
    together = tilt.parameters["tilt_x"]
    assert together.low < TILT < together.high
    for one in tilt.cars:
        own = one.own["tilt_x"]
        assert together.high - together.low < 0.7 * (own.high - own.low)


def test_a_car_that_found_nothing_gets_what_all_share_at_the_shared_value():
    _, (tilt,), adopted = under_one_tilted_camera()
    for searched_again in adopted.values():
        assert searched_again.best.names == ("camera_tilt",)
        assert searched_again.best.values[0] == pytest.approx(tilt.parameters["tilt_x"].value)


def test_a_wrong_tag_is_the_car_s_own():
    wrong = selected(tagged(drives()["b"], TAG_M, 0.0), pose_point=(0.02, 0.0))
    (point,), adopted = compared({**healthy(), "b": wrong}, lambda _: None)
    assert not point.shared
    assert [one.agreement for one in point.cars] == [
        Agreement.CONTRADICTS,
        Agreement.CONFIRMS,
        Agreement.CONTRADICTS,
    ]
    assert point.conclusion == (
        "Only b sees it, a and c would have to and do not: it is that car's own tag or its "
        "mounting, not the camera."
    )
    assert point.parameters["x_m"].low < TAG_M < point.parameters["x_m"].high
    assert [one.best.names for one in adopted.values()] == [(), ("pose_point",), ()]


def test_a_tilt_too_weak_for_one_car_is_found_by_all_together():
    cars = {name: selected(tilted(drive, WEAK, 0.0)) for name, drive in drives().items()}
    (tilt,), adopted = compared(cars, lambda _: None)
    for name, one in zip(CARS, tilt.cars, strict=True):
        context = cars[name].context
        assert one.gain < context.penalty((context.catalogue[0],))
    assert tilt.shared
    assert tilt.parameters["tilt_x"].low < WEAK < tilt.parameters["tilt_x"].high
    assert all(one.best.names == ("camera_tilt",) for one in adopted.values())
    assert tilt.conclusion.startswith("Too weak for one car alone, all 3 cars together show it")


def test_healthy_cars_have_nothing_in_common():
    common, adopted = compared(healthy(), lambda _: None)
    assert not common
    assert adopted == healthy()


def test_cars_with_tags_wrong_by_unlike_amounts_share_nothing():
    cars = {
        name: selected(tagged(drives()[name], ahead, 0.0), pose_point=(ahead, 0.0))
        for name, ahead in (("a", 0.03), ("b", -0.03))
    }
    (point,), _ = compared(cars, lambda _: None)
    assert not point.shared
    assert "each by another amount" in point.conclusion


def test_a_car_s_slope_and_precision_are_those_of_its_cost():
    cars, _, _ = under_one_tilted_camera()
    effect = cars["a"].best.effects[0]
    in_car = EffectInCar(cars["b"], effect, np.array([TILT, 0.0]))
    at, step = np.array([TILT - 0.012, 0.0]), effect.parameters[0].step
    here, (low, high) = in_car.at(at), (
        in_car.at(at + np.array([way, 0.0])).cost for way in (-0.5 * step, 0.5 * step)
    )  # fmt: skip
    assert high - low == pytest.approx(2.0 * here.slope[0], rel=0.15)
    assert high + low - 2.0 * here.cost == pytest.approx(0.5 * here.precision[0, 0], rel=0.3)
    assert in_car.gain(in_car.free) >= in_car.gain(here)
