"""Where an error lies: by sensor, in time, on the floor; what is left over; effects as curves."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.findings import Equation
from scm.mismatch.fit.data_split import split
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.validate.curves import curve
from scm.mismatch.validate.free_runs import judge
from scm.mismatch.validate.locate import chance, locate
from scm.mismatch.validate.residuals import honest, on_one_axis, residual_forces
from tests.unit.mismatch import made_fit
from tests.unit.mismatch.made_drive import big_nigel, driven


def rms(values):
    return float(np.sqrt(np.nanmean(np.square(values))))


def by_channel(residuals):
    return {residual.channel: residual for residual in residuals}


def test_nothing_is_located_where_nothing_was_found():
    located, residuals = locate(*made_fit.healthy()[1:])
    assert located == ()
    assert {r.channel for r in residuals} == {"drive force", "wheel angle"}


def test_an_effect_that_acts_all_the_time_has_neither_time_nor_place():
    (found,), _ = locate(*made_fit.trimmed()[1:])
    assert (found.when_s, found.where) == (None, None)
    assert found.equation is Equation.STEERING
    assert found.share_of_error == pytest.approx(1.0)


def test_the_sensors_that_show_an_effect_are_named():
    (found,), _ = locate(*made_fit.trimmed()[1:])
    assert "imu.gyro_z" in found.channels
    (found,), _ = locate(*made_fit.biased()[1:])
    assert found.channels == ("imu.gyro_z",)


def test_a_spot_of_floor_is_located_where_it_is():
    (found,), _ = locate(*made_fit.patched()[1:])
    assert found.equation is Equation.SURFACE
    assert found.where.x_m[0] < 0.0 < found.where.x_m[1]
    assert found.where.y_m[0] < 0.0 < found.where.y_m[1]


def test_what_lasts_for_a_part_of_the_drive_is_located_in_time():
    model, retuned, best = made_fit.patched()
    (found,), _ = locate(retuned, best)
    drive = model.drives[0]
    near = [np.hypot(drive.smoothed["pose.x"].at(np.array([t])), drive.smoothed["pose.y"].at(
        np.array([t])))[0] for span in found.when_s for t in span]  # fmt: skip
    assert min(near) < 0.6
    assert sum(b - a for a, b in found.when_s) < 0.5 * (drive.edges[-1] - drive.edges[0])


def test_two_effects_share_the_error():
    located, _ = locate(*made_fit.both()[1:])
    assert {found.equation for found in located} == {Equation.STEERING, Equation.SENSOR}
    assert sum(found.share_of_error for found in located) == pytest.approx(1.0)
    assert located[0].share_of_error >= located[1].share_of_error


def test_more_places_looked_at_need_more_gain():
    assert chance(100) == pytest.approx(chance(1) + 2.0 * np.log(100))


def test_the_angle_left_over_is_the_one_that_the_wheels_stand_off_by():
    drive = driven((("steering.trim_rad", 0.05),))
    residuals = by_channel(residual_forces([drive], big_nigel(), {}, {"steering.trim_rad": 0.05}))
    assert np.nanmedian(residuals["wheel angle"].before) == pytest.approx(0.05, rel=0.2)
    assert rms(residuals["wheel angle"].after) < 0.01
    assert rms(residuals["drive force"].before) < 3.0 * rms(residuals["drive force"].std)


def test_the_force_left_over_is_the_one_that_acted():
    (parameter,) = made_fit.candidate("viscous_drag").parameters
    brake = {parameter.key: 4.0}
    drive = driven(tuple(brake.items()))
    residual = by_channel(residual_forces([drive], big_nigel(), {}, brake))["drive force"]
    x, y = drive.smoothed["pose.x"], drive.smoothed["pose.y"]
    speed = np.interp(residual.t_s, x.t, np.hypot(x.rate, y.rate))
    acted, sure = -4.0 * speed, np.isfinite(residual.before)
    assert np.median(residual.before[sure] - acted[sure]) == pytest.approx(0.0, abs=0.1)


def test_a_healthy_car_stays_within_the_band():
    for residual in residual_forces([driven()], big_nigel(), {}, {}):
        inside = np.abs(residual.before) < 1.645 * residual.std
        assert np.mean(inside[np.isfinite(residual.before)]) > 0.85


def test_a_band_is_never_narrower_than_what_is_left():
    after = np.full(50, 3.0)
    assert honest(after, np.ones(50))[0] == pytest.approx(3.0 / 1.645)
    assert honest(0.0 * after, np.ones(50))[0] == pytest.approx(0.5)


def test_a_sensor_s_fault_is_drawn_as_what_the_sensor_reads_too_much():
    _, residuals = locate(*made_fit.biased()[1:])
    gyro = residuals[0]
    assert (gyro.channel, gyro.unit) == ("yaw rate (gyro)", "rad/s")
    assert np.nanmean(gyro.before) == pytest.approx(0.05, abs=0.01)
    assert abs(np.nanmean(gyro.after)) < 0.005


def test_a_camera_s_fault_that_was_found_is_no_force():
    spoilt = driven(sense=lambda name, _, v: 1.2 * v if name in ("pose.x", "pose.y") else v)
    found = residual_forces([spoilt], big_nigel(), {}, {"measure.pose_scale": 1.2})
    for residual, healthy in zip(
        found, residual_forces([driven()], big_nigel(), {}, {}), strict=True
    ):
        assert rms(residual.before) < 1.5 * rms(healthy.before)


def test_no_force_is_made_up_beyond_the_poses_of_a_late_camera():
    late = {"measure.pose_delay_s": 0.3}
    drive = driven(sense=lambda name, t, v: np.interp(t - 0.3, t, v) if "pose" in name else v)
    for residual in residual_forces([drive], big_nigel(), late, late):
        assert residual.t_s[-1] < drive.edges[-1] - 0.3
        known = np.isfinite(residual.after)
        assert np.mean(np.abs(residual.after[known]) > 4.0 * residual.std[known]) < 0.02


def test_drives_follow_one_another_on_one_axis_for_lines_windows_and_places():
    drives = [driven(seconds=12.0), driven(seconds=12.0, seed=2)]
    end = drives[0].edges[-1]
    assert on_one_axis(drives)[0] == 0.0
    t = residual_forces(drives, big_nigel(), {}, {})[0].t_s
    parts = split(Likelihood.of(drives, big_nigel()), 3.0)
    _, runs = judge(drives, big_nigel(), big_nigel(), parts, 1.0)
    second = [times[times > end] for times in (t, runs.start_s)]
    assert len(second[0]) == pytest.approx(0.5 * len(t), abs=1)
    assert len(second[1]) == pytest.approx(0.5 * len(runs.start_s), abs=1)
    assert np.all(np.diff(t) > 0.0)
    assert abs(second[0][0] - second[1][0]) < 2.0


def test_a_trim_is_a_level_curve_at_its_angle():
    _, _, best = made_fit.trimmed()
    found = curve(best, best.effects[0])
    assert (found.x_name, found.y_name, found.y_unit) == ("speed", "wheel angle", "rad")
    assert np.allclose(found.y, best.values[0], rtol=0.3)
    assert np.all((found.low <= found.y) & (found.y <= found.high))


def test_a_gyro_s_bias_is_a_curve_over_the_turning_seen():
    _, _, best = made_fit.biased()
    found = curve(best, best.effects[0])
    assert found.x_name == "yaw rate"
    assert np.allclose(found.y, best.values[0])
    assert np.all(found.low < 0.05 + 0.01)
    assert np.all(found.high > 0.05 - 0.01)


@pytest.mark.parametrize("name", ["pose_latency", "steer_delay", "drive_lag"])
def test_an_effect_that_no_curve_would_tell_has_none(name):
    _, _, best = made_fit.biased()
    with_it = replace(best, effects=(made_fit.candidate(name),))
    assert curve(with_it, with_it.effects[0]) is None
