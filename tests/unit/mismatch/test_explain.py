"""What is said of a model that was found."""

import re
from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.changing_effect import changing
from scm.mismatch.effect_catalogue import candidates
from scm.mismatch.findings import Course, Estimate
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.select.round import Context, Round
from scm.mismatch.select.search import Selection, retune, select
from scm.mismatch.select.selected import Selected, tried_of
from scm.mismatch.validate.explain import (
    effect_of,
    includes_none,
    refitted,
    sentence_of,
    upright,
    widened_of,
)
from scm.mismatch.validate.found_car import patched
from scm.mismatch.varying_effect import DEPENDENCES, varying
from scm.replay.drive import Drive
from tests.unit.mismatch import made_fit
from tests.unit.mismatch.discovery.made_effect import law
from tests.unit.mismatch.made_drive import big_nigel, made_drive, nigel
from tests.unit.mismatch.made_fit import by_name


def test_what_was_taken_is_shown_with_the_gain_for_which_it_was_taken():
    made = made_drive(seconds=8.0)
    sent = made.channels["command.steering"]
    early = {**made.channels, "command.steering": replace(sent, t=sent.t - 0.06)}
    model = Likelihood.of([Drive(replace(made, channels=early), big_nigel())], big_nigel())
    listed = [c for c in candidates(big_nigel()) if c.name in {"steer_delay", "steer_trim"}]
    context = Context(np.ones(len(model.t)), tuple(listed))
    found = select(context, retune(context, model), lambda _: (False, None))
    assert found.best.names == ("steer_delay",)
    first = tried_of(context, found)[0]
    assert first.name == "steer_delay"
    assert first.gain > first.needed


def test_no_recording_makes_a_number_less_sure_than_its_file_or_unphysical():
    model, _, best = made_fit.healthy()
    unsure = replace(best, z=0.0 * best.z, covariance=25.0 * np.eye(len(best.z)))
    bounds = {own.key: own.bounds for own in model.nominal}
    for own in refitted(unsure, big_nigel()):
        prior = next(o for o in model.nominal if o.key == own.key)
        assert own.found.high - own.found.low <= 2.0 * 1.645 * prior.std + 1e-12
        assert bounds[own.key][0] <= own.found.low <= own.found.high <= bounds[own.key][1]


def test_a_floor_that_falls_to_one_side_is_told_to_rise_to_the_other():
    grade = made_fit.candidate("grade")
    assert upright(grade, (-0.06, -1.7)) == pytest.approx((0.06, np.pi - 1.7))
    assert upright(grade, (0.06, -1.7)) == (0.06, -1.7)
    assert upright(made_fit.candidate("pose_heading"), (-0.03,)) == (-0.03,)


def test_the_interval_of_a_direction_does_not_end_where_the_angle_wraps():
    model, _, best = made_fit.healthy()
    grade, n = made_fit.candidate("grade"), len(best.z)
    covariance = np.eye(n + 2) * np.append(np.ones(n), (0.01, 1.0))
    found = replace(best, effects=(grade,), values=np.array([0.02, np.pi]), covariance=covariance)
    context, selection = Context(np.ones(len(model.t)), (grade,)), Selection(found, best)
    selected = Selected((), (), big_nigel(), context, None, selection, (), None, None)
    uphill = effect_of(selected, found, grade).parameters["uphill_rad"]
    assert uphill.high - uphill.value == pytest.approx(uphill.value - uphill.low)


@pytest.mark.parametrize(
    ("behind", "ending"),
    [
        (5.9, "An even change over all of it explains the recording about as well."),
        (6.1, "straight ahead."),
    ],
)
def test_another_course_of_a_change_that_is_about_as_likely_is_named(behind, ending):
    model, retuned, best = made_fit.trimmed()
    (trim,), span_s = best.effects, (0.0, 30.0)
    step, ramp = (changing(trim, course, span_s) for course in (Course.STEP, Course.RAMP))
    fits = [
        replace(best, effects=(one,), values=np.append(best.values, moments))
        for one, moments in ((step, (12.0,)), (ramp, ()), (trim, ()))
    ]
    a_round = Round(retuned, tuple(fits), (100.0, 100.0 + behind, 300.0))
    n = len(best.z) + len(fits[0].values)
    found = replace(fits[0], covariance=np.eye(n))
    selection = Selection(found, retuned, rounds=(a_round,))
    context = Context(np.ones(len(model.t)), (step,))
    selected = Selected((), (), big_nigel(), context, None, selection, (), None, None)
    assert effect_of(selected, found, step).text.endswith(ending)


@pytest.mark.parametrize(
    ("name", "values", "stds", "probability", "has_none"),
    [
        ("drive_asymmetry", (0.1,), (0.1 / 1.3,), 0.841, True),  # intervals are 1.3 times as wide
        ("drive_asymmetry", (-0.1,), (0.1 / 1.3,), 0.841, True),
        ("pose_point", (0.001, 0.1), (1.0, 0.1 / 2.6), 0.977, False),  # its surest number counts
        ("grade", (0.02, 3.0), (1e-6, 1.0), 1.0, False),  # a direction is no amount
    ],
)
def test_an_effect_whose_intervals_include_none_is_not_sure(
    name, values, stds, probability, has_none
):
    model, _, best = made_fit.healthy()
    effect, n = made_fit.candidate(name), len(best.z)
    steps = [one.step for one in effect.parameters]
    covariance = np.diag(np.append(np.ones(n), (np.array(stds) / steps) ** 2))
    found = replace(best, effects=(effect,), values=np.array(values), covariance=covariance)
    context, selection = Context(np.ones(len(model.t)), (effect,)), Selection(found, best)
    selected = Selected((), (), big_nigel(), context, None, selection, (), None, None)
    stated = effect_of(selected, found, effect)
    assert stated.probability == pytest.approx(probability, abs=0.005)
    assert includes_none(effect, stated) is has_none


def lag_against_throttle(most):
    by = next(one for one in DEPENDENCES if one.name == "throttle")
    return varying(made_fit.candidate("steer_lag"), by, most)


@pytest.mark.parametrize(
    ("effect", "value", "variable"),
    [
        (law("yaw moment against speed", "squared"), 0.02, "speed"),
        (lag_against_throttle(0.9), 0.1, "throttle"),
    ],
)
def test_the_range_reported_is_the_one_that_the_car_s_file_is_limited_to(
    effect, value, variable, tmp_path
):
    model, _, best = made_fit.healthy()
    found = replace(best, effects=(effect,), values=np.array([value]), covariance=np.zeros((0, 0)))
    context, selection = Context(np.ones(len(model.t)), (effect,)), Selection(found, best)
    selected = Selected((), (), big_nigel(), context, None, selection, (), None, None)
    (name, seen), *_ = effect_of(selected, found, effect).recorded_range.items()
    assert (name, seen.low > 0.0) == (variable, True)
    patched(nigel(), found, tmp_path)
    (file,) = tmp_path.glob("*.py")
    limits = re.search(r"_in_range = min\(max\(\w+, (.+)\), (.+)\)", file.read_text())
    ends = tuple(map(float, limits.groups()))
    assert ends == pytest.approx((-seen.high, seen.high), abs=1e-4)


@pytest.mark.parametrize(
    ("name", "numbers", "sentence"),
    [
        ("steer_trim", {"offset_rad": (0.0638, "rad")},
         "The wheels stand 3.66° to the left when the command is straight ahead."),
        ("steer_delay", {"delay_s": (0.08, "s")}, "The steering answers 80 ms late."),
        ("battery_sag", {"fraction_per_min": (0.126, "1/min")},
         "The drive weakens by 12.6 % a minute, as a battery that runs down."),
        ("grade", {"slope": (0.066, "1"), "uphill_rad": (1.414, "rad")},
         "The floor rises by 6.6 % towards 81° from world x."),
        ("steer_trim", {"offset_rad": (-0.0638, "rad")},
         "The wheels stand 3.66° to the right when the command is straight ahead."),
        ("pose_point", {"x_m": (0.031, "m"), "y_m": (-0.116, "m")},
         "The tracked point lies 3.1 cm ahead and 11.6 cm right of where it is said to be."),
        ("drive_asymmetry", {"difference": (-0.0812, "1")},
         "The left motor pulls 8.12 % less than nominal, the right one as much more."),
        ("pose_scale", {"scale": (1.03, "1")},
         "The camera shows 103 cm for every 100 cm on the floor."),
        ("steer_gain", {"gain": (0.9, "1")}, "The wheels turn by 90 % of the commanded angle."),
        ("gyro_bias", {"bias_rad_s": (-0.02, "rad/s")}, "The gyro reads 0.02 rad/s too little."),
    ],
)  # fmt: skip
def test_a_sentence_holds_numbers_as_a_mechanic_says_them(name, numbers, sentence):
    estimates = {
        key: Estimate(value=value, low=value, high=value, unit=unit)
        for key, (value, unit) in numbers.items()
    }
    assert sentence_of(by_name(candidates(big_nigel()), name), estimates) == sentence


def test_an_effect_that_the_car_file_has_is_reported_with_what_the_file_states():
    model, retuned, best = made_fit.trimmed()
    context = Context(np.ones(len(model.t)), best.effects)
    before = big_nigel().with_terms(["steer_trim"], {"steering.trim_rad": 0.02})
    for car, stated, ending in (
        (before, {"offset_rad": 0.02}, "The car file states 1.15°."),
        (before.with_terms([], {"steering.trim_rad": 0.0}), {}, "straight ahead."),
        (big_nigel(), {}, "straight ahead."),
    ):
        selected = Selected((), (), car, context, None, Selection(best, retuned), (), None, None)
        found = effect_of(selected, best, best.effects[0])
        assert found.stated == pytest.approx(stated)
        assert found.text.endswith(ending)


def weighed_to(std_kg):
    car = big_nigel()
    mass = replace(car.quantity("body.mass_kg"), std=std_kg)
    return replace(car, values={**car.values, "body.mass_kg": mass})


def test_a_std_of_the_car_file_that_was_widened_is_said_with_the_reason():
    car = weighed_to(0.01)
    model = Likelihood.of([Drive(made_drive(seconds=6.0), car)], car)
    (said,) = [line for line in widened_of(model, car) if "body.mass_kg" in line]
    assert "std of body.mass_kg, 0.01, was taken as 0.192 kg, 8 % of the value: cars are" in said
    assert not any("body.mass_kg" in line for line in widened_of(model, weighed_to(0.5)))


def test_a_number_that_no_file_states_is_said_to_be_assumed():
    model, _, _ = made_fit.healthy()
    (said,) = [line for line in widened_of(model, big_nigel()) if "axle_lock" in line]
    assert "states no std of drive.axle_lock: it was taken as 0.5 ± 0.5" in said
    assert any("3 ms" in line for line in widened_of(model, big_nigel()))


def test_a_stated_std_of_an_axle_lock_is_used():
    car = big_nigel()
    lock = replace(car.quantity("drive.axle_lock"), value=0.8, std=0.1)
    car = replace(car, values={**car.values, "drive.axle_lock": lock})
    model = Likelihood.of([Drive(made_drive(seconds=6.0), car)], car)
    (own,) = [own for own in model.nominal if own.key == "drive.axle_lock"]
    assert (own.mean, own.std) == (0.8, 0.1)


def test_noise_that_is_larger_than_the_recording_states_is_said():
    made = made_drive(seconds=6.0)
    model = Likelihood.of([Drive(made, big_nigel())], big_nigel())
    assert not any("recording's std" in line for line in widened_of(model, big_nigel()))
    loud = replace(model.noise, scale={**model.noise.scale, "pose.x": 3.0, "pose.y": 3.0})
    lines = widened_of(model.under(loud), big_nigel())
    (said,) = [line for line in lines if "recording's std" in line]
    assert "std of pose.x and pose.y, 0.002, was taken as 0.006" in said
