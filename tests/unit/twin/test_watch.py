"""A car's recording goes in, and since when it has changed comes out."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from scm.mismatch.fit.residual_windows import LENGTH_S
from scm.recording.read import Channel
from scm.twin.detector import threshold_of
from scm.twin.evidence import Evidence
from scm.twin.watch import ANEW_S, CarWatch, watch
from scm.twin.windows import WatchedCar
from tests.unit.mismatch.made_drive import made_drive, nigel

SINCE_S, LASTS_S = 250.0, 300.0
BIAS = 0.02
THRESHOLD = threshold_of(200.0)


@pytest.fixture(scope="module")
def predictor():
    return WatchedCar(nigel())


def biased(name, t, values):
    return values + BIAS * (t >= SINCE_S) if name == "imu.gyro_z" else values


@pytest.fixture(scope="module")
def changed():
    return made_drive(seconds=LASTS_S, sense=biased)


def without(recording, names, first_s=-np.inf, last_s=np.inf):
    """Return a recording without what some channels recorded between two times."""
    channels = dict[str, Channel]()
    for name, channel in recording.channels.items():
        stays = ~((channel.t >= first_s) & (channel.t < last_s)) | (name not in names)
        if stays.any():
            channels[name] = channel.at(stays)
    return replace(recording, channels=channels)


def test_bias_of_the_gyro_is_noticed_named_and_dated(predictor, changed):
    car = CarWatch(predictor, THRESHOLD)
    (noticed,) = watch(changed, car)
    assert (noticed.number.effect, noticed.number.name) == ("gyro_bias", "bias_rad_s")
    assert noticed.change.size == pytest.approx(BIAS, rel=0.2)
    at, first, last = noticed.change.onset_s
    assert first <= SINCE_S <= last < first + 5.0
    assert at == pytest.approx(SINCE_S, abs=2.0)
    assert SINCE_S < noticed.change.noticed_s < SINCE_S + 30.0
    assert car.driven_s == pytest.approx(LASTS_S, abs=10.0)
    assert car.is_learning  # the car is another one


def test_same_drive_without_it_is_silent_though_the_camera_lost_the_car(predictor):
    recording = without(made_drive(seconds=LASTS_S), ("pose.x", "pose.y", "pose.yaw"), 230.0, 260.0)
    car = CarWatch(predictor, THRESHOLD)
    assert watch(recording, car) == []
    assert LASTS_S - 45.0 < car.driven_s < LASTS_S - 25.0


def test_spans_in_which_a_sensor_is_missing_do_not_count(predictor, changed):
    car = CarWatch(predictor, THRESHOLD)
    assert watch(without(changed, ("imu.gyro_z",), SINCE_S - 10.0), car) == []
    assert car.driven_s < SINCE_S


def test_sensor_that_comes_later_is_watched_from_then_on(predictor, changed):
    late = without(changed, ("imu.gyro_z",), last_s=40.0)
    car = CarWatch(predictor, THRESHOLD)
    (noticed,) = watch(late, car)
    assert noticed.number.effect == "gyro_bias"
    assert car.driven_s == pytest.approx(LASTS_S - 40.0, abs=10.0)


def test_window_in_which_another_camera_takes_over_is_left_out(predictor, changed):
    car = CarWatch(predictor, THRESHOLD)
    seen = []
    car._remember = lambda windows, cameras: seen.append((windows.begin_s, cameras))
    car.look(changed, 0.0, 10.0, lambda t_s: "west" if t_s < 4.2 else "east")
    begin_s, cameras = (np.concatenate(one) for one in zip(*seen, strict=True))
    over = (begin_s < 4.2) & (begin_s + LENGTH_S >= 4.2)
    assert not over.any()
    assert len(begin_s) > 10
    np.testing.assert_array_equal(cameras, np.where(begin_s < 4.2, "west", "east"))


def test_single_reading_of_a_sensor_is_as_none(predictor, changed):
    gyro = changed.channels["imu.gyro_z"]
    one = replace(changed, channels=changed.channels | {"imu.gyro_z": gyro.at(gyro.t == gyro.t[9])})
    car = CarWatch(predictor, THRESHOLD)
    assert car.look(one, 0.0, 10.0) is None
    assert car.driven_s > 5.0


def test_numbers_of_all_parts_of_a_car_are_watched(predictor):
    names = {(one.effect, one.name) for one in predictor.watched}
    assert {
        ("drive_gain", "gain"), ("steer_trim", "offset_rad"), ("payload", "mass_kg"),
        ("camera_tilt", "tilt_x"), ("grade", "slope_x"), ("grade", "slope_y"),
    } <= names  # fmt: skip
    assert "surface_patch" not in {effect for effect, _ in names}
    assert all(one.step for one in predictor.watched)


def test_fewer_false_alarms_take_a_higher_score():
    assert threshold_of(20.0) < threshold_of(200.0) < threshold_of(2000.0)


def test_windows_are_weighed_by_what_was_learned_first_until_long_after_a_change(
    predictor, monkeypatch
):
    """How a car strays is learned twice; windows weighed otherwise could not be compared."""
    used, car = [], CarWatch(predictor, THRESHOLD)
    monkeypatch.setattr(Evidence, "add", lambda evidence, windows, usual, by: used.append(usual))
    detector = car._detector = SimpleNamespace(usual=None)

    def drive(until_s, learned):
        car.driven_s, detector.usual = until_s, learned
        car._remember(None, "west")
        return used[-1:]

    assert drive(10.0, None) == []
    assert drive(200.0, "first") == ["first"]
    assert len(used) == 2
    assert drive(600.0, "well") == ["first"]
    car.evidence.is_steady, car._changed_s = False, 600.0
    assert drive(610.0, None) == ["first"]
    assert drive(600.0 + ANEW_S, "anew") == ["first"]
    assert not car.evidence.is_steady
    assert drive(601.0 + ANEW_S, "anew") == ["anew"]
    assert car.evidence.is_steady
