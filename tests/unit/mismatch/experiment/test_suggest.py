"""What to drive next: explanations that a drive separates, and files to drive."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from scm.mismatch.effect_catalogue import candidates, terms_needed
from scm.mismatch.experiment.manoeuvres import MANOEUVRES, Floor, pace_of
from scm.mismatch.experiment.plan import Explanation, Leg, linear_separation, place, planned
from scm.mismatch.experiment.scenario import write_scenario
from scm.mismatch.experiment.suggest import (
    MIN_LAMBDA,
    SURE_LAMBDA,
    names_of,
    ramp_and_mass,
    suggest,
)
from scm.mismatch.fit.hypothesis import numbers_of
from scm.mismatch.fit.likelihood import Likelihood
from scm.recorder.play import read_drive
from scm.recording.read import Channel, Recording
from scm.replay.drive import Drive
from scm.vehicles.car import load_car
from tests.unit.mismatch.made_fit import by_name

FLOOR = Floor((0.0, 3.0), (0.0, 2.0))


@cache
def recorded():
    """A model of ten seconds on a circle: only its sensors, its noise and its speed matter here."""
    t, slow = np.arange(0.0, 10.0, 1.0 / 30.0), np.arange(0.0, 10.0, 0.05)
    at = 0.5 * t
    pose = {"pose.x": np.cos(at) * 0.5, "pose.y": np.sin(at) * 0.5, "pose.yaw": at + 0.5 * np.pi}
    stds = {"pose.x": 0.002, "pose.y": 0.002, "pose.yaw": 0.0087}
    channels = {k: Channel(t, v, stds[k], (0.0, 0.0), "") for k, v in pose.items()}
    gyro_t = np.arange(0.0, 10.0, 0.02)
    channels["imu.gyro_z"] = Channel(gyro_t, np.full(len(gyro_t), 0.5), 0.002, (0.0, 0.0), "")
    counts = 1920.0 / (2.0 * np.pi) * 0.25 / 0.0325 * gyro_t
    for side in ("left", "right"):
        channels[f"encoder.{side}"] = Channel(gyro_t, counts, 0.4, (0.0, 0.0), "")
    for name in ("throttle", "steering"):
        values = np.full(len(slow), 0.9 if name == "throttle" else 0.3)
        channels[f"command.{name}"] = Channel(slow, values, None, (0.0, 0.0), "ratio")
    car = load_car("nigel")
    big = car.with_terms(terms_needed(car))
    return Likelihood.of([Drive(Recording(Path("made-up"), "nigel", channels), big)], big)


def explanation(name, *values):
    return Explanation((by_name(candidates(recorded().car), name),), np.array(values))


def lambda_of(build, *explanations, change=None):
    model = recorded()
    numbers = [numbers_of(r.effects, r.values) for r in explanations]
    placed = place(Leg(build, change), model.car, pace_of(model.car, model.drives, FLOOR), numbers)
    return linear_separation(planned(model, [placed], numbers[0]), explanations).least


@cache
def suggested():
    return suggest(recorded(), [explanation("payload", 1.5), explanation("motor_gain", 0.6)], FLOOR)


def test_payload_and_a_weak_motor_call_for_a_ramp_or_a_known_mass():
    found = suggested()
    assert found.undecided.between == ("payload", "motor_gain")
    assert "no drive there tells them apart" in found.undecided.drive_this
    assert "ramp" in found.undecided.drive_this or "weighed" in found.undecided.drive_this
    assert found.undecided.expected_separation**2 > MIN_LAMBDA


def test_a_slope_or_a_wind_calls_for_a_spirit_level():
    found = suggest(
        recorded(), [explanation("grade", 0.021, 0.5), explanation("wind", -0.3, -0.2)], FLOOR
    )
    text = found.undecided.drive_this
    assert "spirit level" in text
    assert "rises by 2.1 cm a metre" in text
    assert "weigh" not in text


def test_long_drives_tell_a_sagging_battery_from_motors_that_fade():
    sag, fade = explanation("battery_sag", 0.08), explanation("motor_fade", 0.2)
    assert lambda_of(MANOEUVRES["shuttle"], sag, fade) < MIN_LAMBDA
    assert lambda_of(MANOEUVRES["long_laps"], sag, fade) > SURE_LAMBDA


def test_driving_to_and_fro_tells_a_trim_from_uneven_motors():
    trim, uneven = explanation("steer_trim", 0.03), explanation("drive_asymmetry", -0.08)
    assert lambda_of(MANOEUVRES["shuttle"], trim, uneven) > SURE_LAMBDA


def test_creeping_tells_a_dead_band_from_a_gain():
    explanations = explanation("drive_deadband", 0.06), explanation("drive_gain", 0.93)
    steady, creep = (lambda_of(MANOEUVRES[m], *explanations) for m in ("shuttle", "launches"))
    assert creep > max(steady, SURE_LAMBDA)


def test_an_explanation_does_not_come_apart_from_itself():
    one = explanation("steer_trim", 0.03)
    assert lambda_of(MANOEUVRES["slalom"], one, one) == pytest.approx(0.0, abs=1e-6)


def test_what_all_rivals_share_is_not_what_is_between_them():
    both = by_name(candidates(recorded().car), "steer_trim")
    first, second = explanation("payload", 1.0), explanation("motor_gain", 0.7)
    explanations = [
        Explanation((both, *r.effects), np.array([0.02, *r.values])) for r in (first, second)
    ]
    assert names_of(explanations) == ("payload", "motor_gain")


@pytest.mark.parametrize("name", MANOEUVRES)
def test_every_drive_stays_on_the_floor(name):
    model = recorded()
    pace = pace_of(model.car, model.drives, Floor((1.0, 4.5), (-2.0, 1.0)))
    placed = place(Leg(MANOEUVRES[name]), model.car, pace, [{}, {"steering.trim_rad": 0.02}])
    assert placed is not None
    x, y = placed.path[0], placed.path[1]
    assert 1.0 < x.min() <= x.max() < 4.5
    assert -2.0 < y.min() <= y.max() < 1.0


def test_a_drive_that_no_scale_makes_small_enough_is_left_out():
    model = recorded()
    pace = pace_of(model.car, model.drives, Floor((0.0, 0.5), (0.0, 0.5)))
    assert place(Leg(MANOEUVRES["circles"]), model.car, pace, [{}]) is None


def test_every_leg_of_a_suggestion_is_written_as_a_drive_to_play(tmp_path):
    found = suggested()
    written = write_scenario(found, "nigel", tmp_path)
    assert len(written) == len(found.best.legs)
    drive, rows = read_drive(written[0])
    assert drive.say == found.undecided.drive_this
    assert rows[-1][0] == pytest.approx(found.best.legs[0].manoeuvre.lasts_s, abs=0.1)


def test_a_ramp_adds_its_slope_to_one_that_is_there():
    change = ramp_and_mass(load_car("nigel")).legs[0].change
    level, there = change({}, 0.0), change({"grade.slope": 0.1, "grade.uphill_rad": np.pi}, 0.0)
    assert level["grade.slope"] == pytest.approx(0.1)
    assert there["grade.slope"] == pytest.approx(0.0)
