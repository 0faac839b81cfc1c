"""The effects that a search may propose."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.effect_catalogue import candidates, placed, shown_by, terms_needed
from scm.mismatch.findings import Estimate
from scm.mismatch.validate.explain import sentence_of
from scm.replay.drive import Drive
from scm.vehicles.car import load_car
from tests.unit.mismatch.made_drive import big_nigel, made_drive, nigel
from tests.unit.mismatch.made_fit import by_name

PROMISED = (
    "accel_bias", "aero_drag", "battery_sag", "camera_tilt", "clock_drift", "clock_offset",
    "com_shift", "corner_drag", "drive_asymmetry", "drive_deadband", "drive_delay", "drive_gain",
    "drive_lag", "encoder_loss", "grade", "gyro_bias", "gyro_scale", "imu_misalignment",
    "load_transfer", "motor_fade", "payload", "pose_heading", "pose_latency", "pose_point",
    "pose_scale", "rolling_resistance", "steer_backlash", "steer_compliance", "steer_delay",
    "steer_gain", "steer_lag", "steer_rate", "steer_saturation", "steer_trim", "stiction",
    "surface_patch", "tyre_grip", "tyre_relaxation", "tyre_stiffness", "understeer",
    "viscous_drag", "wheel_radius", "wind",
)  # fmt: skip


@pytest.mark.parametrize("car_name", ["nigel", "f1tenth", "dart"])
def test_every_promised_effect_may_be_proposed_for_every_car(car_name):
    car = load_car(car_name)
    known = {c.name for c in candidates(car.with_terms(terms_needed(car)))}
    own = {"drive_deadband", "steer_saturation"} if car_name == "dart" else set()
    assert set(PROMISED) - known <= own


def test_poses_may_be_stamped_early_as_well_as_late():
    early, late = (by_name(candidates(big_nigel()), n) for n in ("clock_offset", "pose_latency"))
    assert early.parameters[0].bounds[0] < 0.0 == early.parameters[0].bounds[1]
    assert late.parameters[0].bounds[0] == 0.0


def test_starts_lie_within_bounds_and_away_from_neutral():
    for candidate in candidates(big_nigel()):
        for start in candidate.starts:
            assert len(start) == len(candidate.parameters)
            for value, parameter in zip(start, candidate.parameters, strict=True):
                assert parameter.bounds[0] <= value <= parameter.bounds[1], (
                    candidate.name,
                    parameter.name,
                )
            assert any(v != k.neutral for v, k in zip(start, candidate.parameters, strict=True))


def test_an_effect_is_told_as_what_is_added_to_the_cars_own_number():
    car = load_car("f1tenth")
    rolling = by_name(candidates(car.with_terms(terms_needed(car))), "rolling_resistance")
    assert rolling.numbers((0.03,)) == {"wheel.rolling_resistance": pytest.approx(0.042)}
    assert rolling.parameters[0].neutral == 0.0


def test_a_wheel_radius_is_a_factor_on_the_cars_own():
    scale = by_name(candidates(big_nigel()), "wheel_radius")
    radius = nigel().value("wheel.radius_m")
    assert scale.numbers((1.03,)) == {"wheel.radius_m": pytest.approx(1.03 * radius)}


def test_every_sentence_takes_its_numbers():
    for candidate in candidates(big_nigel()):
        estimates = {
            k.name: Estimate(value=0.1, low=0.0, high=0.2, unit=k.unit)
            for k in candidate.parameters
        }
        text = sentence_of(candidate, estimates)
        assert "{" not in text
        assert text.endswith(".")


def test_a_slow_drive_proposes_no_effect_of_sliding():
    drive = Drive(made_drive(seconds=8.0), big_nigel())
    names = {c.name for c in shown_by(candidates(big_nigel()), [drive])}
    assert "load_transfer" not in names
    assert "steer_trim" in names


def test_spots_begin_where_the_car_was():
    drive = Drive(made_drive(seconds=8.0), big_nigel())
    spots = [c for c in placed(candidates(big_nigel()), [drive]) if c.name == "surface_patch"]
    assert {c.parameters[-1].name for c in spots} == {"grip", "rolling"}
    x = drive.smoothed["pose.x"].value
    assert all(x.min() - 0.5 <= start[0] <= x.max() + 0.5 for c in spots for start in c.starts)
    assert np.ptp([start[0] for start in spots[0].starts]) > 0.0


@pytest.mark.parametrize("offset_s", [0.0, 0.004])
def test_effects_are_listed_where_position_and_heading_have_rates_of_their_own(offset_s):
    made = made_drive(seconds=8.0)
    sent = made.channel("command.throttle")
    channels, t = dict(made.channels), np.arange(0.02, 7.9, 1.0 / 12.0)
    for name in ("pose.x", "pose.y"):
        whole = channels[name]
        stamps = t + (offset_s if name == "pose.y" else 0.0)
        channels[name] = replace(whole, t=stamps, values=np.interp(stamps, whole.t, whole.values))
    early = sent.t < 6.0  # poses go on after the commands
    channels["command.throttle"] = replace(sent, t=sent.t[early], values=sent.values[early])
    drive = Drive(replace(made, channels=channels), big_nigel())
    assert placed(shown_by(candidates(big_nigel()), [drive]), [drive])


def test_a_centre_of_gravity_stays_above_the_floor():
    height = next(one for one in candidates(nigel()) if one.name == "load_transfer")
    (low, _), most = height.parameters[0].bounds, nigel().value("body.cog_height_m")
    assert -most < low < -0.9 * most


@pytest.mark.parametrize(
    ("without", "is_proposed"),
    [((), True), (("encoder", "imu.accel"), False), (("encoder",), True)],
)
def test_a_scale_of_the_poses_needs_another_measure_of_distance(without, is_proposed):
    made = made_drive(seconds=8.0)
    channels = {n: c for n, c in made.channels.items() if not n.startswith(without)}
    drive = Drive(replace(made, channels=channels), big_nigel())
    names = {c.name for c in shown_by(candidates(big_nigel()), [drive])}
    assert ("pose_scale" in names) == is_proposed
