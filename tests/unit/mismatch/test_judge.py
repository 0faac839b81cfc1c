"""The judge: free runs before and after, against the recording and against noise alone."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from scm.errors import RecordingError
from scm.mismatch.fit.data_split import split
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.validate.free_runs import judge, nothing_got_worse
from scm.mismatch.validate.stages import Stage
from tests.unit.mismatch.made_drive import big_nigel, car_with, driven

TRIM = {"steering.trim_rad": 0.05}


def judged(drive, after, before=(), horizon_s=2.0):
    parts = split(Likelihood.of([drive], big_nigel()), 5.0)
    return judge([drive], car_with(before), car_with(after), parts, horizon_s)


@pytest.fixture(scope="module")
def trimmed():
    return judged(driven(tuple(TRIM.items())), TRIM)


def test_the_true_car_comes_down_to_what_noise_alone_makes(trimmed):
    fit, _ = trimmed
    for part in (fit.fit, fit.choose, fit.confirm):
        assert part.after["position_m"] < 2.5 * part.noise_floor["position_m"]
        assert part.after["yaw_rad"] < 2.5 * part.noise_floor["yaw_rad"]


def test_the_wrong_car_stays_far_from_the_recording(trimmed):
    fit, _ = trimmed
    assert fit.confirm.before["yaw_rad"] > 10.0 * fit.confirm.after["yaw_rad"]
    assert fit.confirm.before["position_m"] > 5.0 * fit.confirm.after["position_m"]


def test_every_sensor_has_its_error(trimmed):
    fit, _ = trimmed
    names = {"position_m", "yaw_rad", "wheel_m", "gyro_rad", "accel_x_mps", "accel_y_mps"}
    assert set(fit.confirm.before) == set(fit.confirm.noise_floor) == names


def test_windows_lie_within_blocks_of_their_part(trimmed):
    fit, runs = trimmed
    assert (fit.fit.windows, fit.choose.windows, fit.confirm.windows) == tuple(
        runs.part.count(name) for name in ("fit", "choose", "confirm")
    )
    assert runs.t_s[-1] == pytest.approx(2.0)
    assert np.all(np.diff(runs.t_s) > 0.0)


def test_drawn_runs_start_where_the_recording_was_and_show_the_errors_told(trimmed):
    fit, runs = trimmed
    apart = np.hypot(runs.before["x"] - runs.measured["x"], runs.before["y"] - runs.measured["y"])
    assert apart[:, 0].max() < 1e-3
    mine = np.array(runs.part) == "confirm"
    told = fit.confirm.before["position_m"]
    assert np.sqrt(np.mean(apart[mine, -1] ** 2)) == pytest.approx(told, rel=1e-6)


def test_a_car_that_changes_with_time_is_judged_by_its_own_time():
    sag = {"drive.sag_per_min": 0.4}
    fit, _ = judged(driven(tuple(sag.items())), sag)
    assert fit.confirm.after["position_m"] < 2.5 * fit.confirm.noise_floor["position_m"]
    assert fit.confirm.before["position_m"] > 3.0 * fit.confirm.after["position_m"]


def test_windows_in_which_something_changed_at_once_do_not_count():
    drive = driven(tuple(TRIM.items()))
    parts = split(Likelihood.of([drive], big_nigel()), 5.0)
    change_s, (usual, trimmed) = 8.0, (car_with(), car_with(TRIM))
    stages = (Stage(usual, "before.toml", until_s=change_s), Stage(trimmed, from_s=change_s))
    starts = {}
    for at_once in (False, True):
        each = (stages[0], replace(stages[1], at_once=at_once))
        _, runs = judge([drive], usual, each, parts, 2.0)
        starts[at_once] = set(np.round(runs.start_s, 3))
    left = {start for start in starts[False] if not start < change_s < start + 2.0}
    assert starts[True] == left < starts[False]


def late(by, scale):
    def sense(name, t, values):
        if not name.startswith("pose."):
            return values
        values = np.interp(t - by, t, values)
        return values if name == "pose.yaw" else scale * values

    return sense


def test_faults_of_the_camera_are_put_into_what_is_predicted():
    drive = driven(sense=late(0.1, 1.05))
    faults = {"measure.pose_delay_s": 0.1, "measure.pose_scale": 1.05}
    fit, _ = judged(drive, faults)
    assert fit.confirm.after["position_m"] < 0.4 * fit.confirm.before["position_m"]
    assert fit.confirm.after["position_m"] < 2.5 * fit.confirm.noise_floor["position_m"]


def test_a_gyro_that_reads_too_much_shows_in_the_gyro_alone():
    drive = driven(sense=lambda name, _, v: v + 0.05 if name == "imu.gyro_z" else v)
    fit, _ = judged(drive, {"measure.gyro_bias_rad_s": 0.05})
    assert fit.confirm.before["gyro_rad"] == pytest.approx(0.1, rel=0.2)
    assert fit.confirm.after["gyro_rad"] < 0.02
    assert fit.confirm.after["position_m"] == pytest.approx(fit.confirm.before["position_m"])


def test_a_channel_that_got_worse_is_named():
    fit, _ = judged(driven(), TRIM)
    assert {"position_m", "yaw_rad", "gyro_rad"} <= set(nothing_got_worse(fit))


def test_nothing_is_named_where_everything_got_better(trimmed):
    assert nothing_got_worse(trimmed[0]) == ()


def test_what_noise_may_change_is_not_called_worse(trimmed):
    fit = trimmed[0]
    floor = fit.confirm.noise_floor
    more = {name: 1.1 * value for name, value in floor.items()}
    same = structs.replace(
        fit, confirm=structs.replace(fit.confirm, before=dict(floor), after=more)
    )
    assert nothing_got_worse(same) == ()


def test_two_drives_are_judged_together():
    drives = [driven(seed=seed) for seed in (1, 2)]
    parts = split(Likelihood.of(drives, big_nigel()))
    fit, runs = judge(drives, big_nigel(), big_nigel(), parts, 2.0)
    alone, _ = judged(drives[0], {})
    assert fit.fit.windows + fit.confirm.windows > alone.fit.windows + alone.confirm.windows
    assert len(runs.start_s) == len(runs.part) == len(runs.measured["x"])


def test_a_window_longer_than_any_block_is_refused_with_the_recording_s_name():
    with pytest.raises(RecordingError, match=r"made.recording\.yaml: no window of 9 s"):
        judged(driven(), {}, horizon_s=9.0)
