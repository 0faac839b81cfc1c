"""Values at the end of a sensor's range, and spikes of a wrapped angle, are no measurements."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from scm.data_quality.check import check
from scm.data_quality.prepare import prepare
from scm.data_quality.quality import Quality
from scm.data_quality.repairs import corrected
from scm.recording.read import Channel, Recording
from scm.vehicles.car import Car

Make = Callable[[int], Recording]


def changed(recording: Recording, name: str, change: Callable[[Channel], Channel]) -> Recording:
    channel = change(recording.channels[name])
    return replace(recording, channels={**recording.channels, name: channel})


def clipped(recording: Recording, name: str, low: float, high: float) -> Recording:
    return changed(recording, name, lambda c: replace(c, values=np.clip(c.values, low, high)))


def with_speed(recording: Recording, noise: float = 0.0) -> Recording:
    """The same drive with an odometer: the mean of both wheels' way, differentiated."""
    left, right = (recording.channels[f"encoder.{side}"] for side in ("left", "right"))
    way = np.convolve(0.5 * (left.values + right.values), np.full(9, 1 / 9), mode="same")
    speed = np.gradient(way, left.t) * 2 * np.pi * 0.0325 / 1920
    values = speed + noise * np.random.default_rng(3).standard_normal(len(left.t))
    values[:10], values[-10:] = values[10], values[-10]
    channel = replace(left, values=values, dimension="speed")
    return replace(recording, channels={**recording.channels, "speed": channel})


def found_in(recording: Recording, car: Car) -> dict[str, str]:
    return {p.channel: p.text for p in check(recording, car).problems if p.name == "clipped"}


def size(recording: Recording, name: str, percent: float) -> float:
    return float(np.percentile(np.abs(recording.channels[name].values), percent))


@pytest.mark.parametrize("name", ["imu.gyro_z", "imu.accel_x", "imu.accel_y"])
@pytest.mark.parametrize("percent", [70.0, 95.0])
def test_a_sensor_that_stops_at_a_value_is_clipped_there(
    drive: Make, nigel: Car, name: str, percent: float
) -> None:
    limit = size(drive(0), name, percent)
    recording = clipped(drive(0), name, -limit, limit)
    found = check(recording, nigel)
    (problem,) = [p for p in found.problems if p.name == "clipped"]
    at_limit = int((np.abs(recording.channels[name].values) == limit).sum())
    assert problem.channel == name
    assert f"±{limit:.4g}" in problem.text
    assert f"{at_limit} of {len(recording.channels[name].t)} rows" in problem.text
    kept = corrected(recording, found).channels[name]
    assert len(kept.t) == len(recording.channels[name].t) - at_limit
    assert np.abs(kept.values).max() < limit
    assert {p.name for p in found.problems} == {"clipped"}
    assert not {s.name for s in found.suspicions} & {"gyro_scale", "clock_offset", "accel_bias"}


def test_one_side_alone_may_be_clipped(drive: Make, nigel: Car) -> None:
    limit = size(drive(0), "imu.gyro_z", 80.0)
    found = found_in(clipped(drive(0), "imu.gyro_z", -limit, np.inf), nigel)
    assert f"-{limit:.4g} rad/s" in found["imu.gyro_z"]
    assert "±" not in found["imu.gyro_z"]


def test_a_limit_is_named_as_the_data_sheet_names_it(drive: Make, nigel: Car) -> None:
    said = found_in(clipped(drive(0), "imu.gyro_z", -0.2, 0.2), nigel)["imu.gyro_z"]
    assert "±0.2 rad/s (11.46 deg/s)" in said
    limit = size(drive(0), "imu.accel_y", 80.0)
    said = found_in(clipped(drive(0), "imu.accel_y", -limit, limit), nigel)["imu.accel_y"]
    assert f"({limit / 9.80665:.3g} g)" in said


def test_a_clipped_sensor_without_noise_is_told_by_the_poses(drive: Make, nigel: Car) -> None:
    recording = changed(
        drive(0),
        "imu.gyro_z",
        lambda c: replace(c, values=np.convolve(c.values, np.hanning(41) / 20.0, mode="same")),
    )
    assert found_in(recording, nigel) == {}
    limit = size(recording, "imu.gyro_z", 75.0)
    assert "imu.gyro_z" in found_in(clipped(recording, "imu.gyro_z", -limit, limit), nigel)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_speed_with_a_ceiling_is_clipped(drive: Make, nigel: Car, noise: float) -> None:
    recording = with_speed(drive(0), noise)
    assert found_in(recording, nigel) == {}
    limit = size(recording, "speed", 75.0)
    found = found_in(clipped(recording, "speed", -9.0, limit), nigel)
    assert list(found) == ["speed"]
    assert f"+{limit:.4g} m/s" in found["speed"]


def test_a_clipped_sensor_in_a_wrong_unit_is_repaired_as_well(drive: Make, nigel: Car) -> None:
    limit = size(drive(0), "imu.gyro_z", 85.0)
    recording = changed(
        clipped(drive(0), "imu.gyro_z", -limit, limit),
        "imu.gyro_z",
        lambda c: replace(c, values=np.degrees(c.values)),
    )
    assert {p.name for p in check(recording, nigel).problems} == {"clipped", "unit"}


@pytest.mark.parametrize("share", [60.0, 85.0])
def test_the_unit_of_a_clipped_sensor_is_told_by_what_it_measures(
    drive: Make, nigel: Car, share: float
) -> None:
    limit = size(drive(0), "imu.gyro_z", share)
    recording = changed(
        clipped(drive(0), "imu.gyro_z", -limit, limit),
        "imu.gyro_z",
        lambda c: replace(c, values=np.degrees(c.values)),
    )
    (unit,) = [p for p in check(recording, nigel).problems if p.name == "unit"]
    assert "57.3" in unit.text
    assert "deg/s" in unit.text


def test_an_accelerometer_that_is_shaken_to_its_range_is_clipped(drive: Make, nigel: Car) -> None:
    g, shaken = 9.80665, drive(0).channels["imu.accel_x"]
    values = g + 6.0 * np.random.default_rng(1).standard_normal(len(shaken.t))
    shaken = replace(shaken, values=np.clip(values, -2.0 * g, 2.0 * g))
    recording = replace(drive(0), channels={**drive(0).channels, "imu.accel_z": shaken})
    assert "+19.61 m/s^2 (2 g)" in found_in(recording, nigel)["imu.accel_z"]


def steady(recording: Recording, speed: Callable[[np.ndarray], np.ndarray]) -> Recording:
    """A car that drives straight ahead, without any noise."""
    channels = dict(recording.channels)
    t = channels["pose.x"].t
    way = np.concatenate(([0.0], np.cumsum(np.diff(t) * speed(t[1:]))))
    for name in ("pose.y", "pose.yaw", "imu.gyro_z", "imu.accel_x", "imu.accel_y"):
        channels[name] = replace(channels[name], values=0.0 * channels[name].values)
    channels["pose.x"] = replace(channels["pose.x"], values=way)
    channels["speed"] = replace(channels["pose.x"], values=speed(t), dimension="speed")
    return replace(recording, channels=channels)


@pytest.mark.parametrize(
    "speed",
    [
        lambda t: np.clip(0.3 * (t % 20.0), 0.0, 1.0),
        lambda t: np.round(1.0 - np.exp(-0.5 * t), 2),
        lambda t: np.round(np.clip(0.3 * (t % 20.0), 0.0, 1.0) + 0.02 * np.sin(9.0 * t), 1),
    ],
    ids=["trapezoids", "approach", "coarse"],
)
def test_a_car_that_holds_its_speed_is_not_clipped(
    drive: Make, nigel: Car, speed: Callable[[np.ndarray], np.ndarray]
) -> None:
    assert found_in(steady(drive(0), speed), nigel) == {}


def slope_of_wrapped(recording: Recording, name: str, share: float) -> Recording:
    """A yaw rate that a low-pass filter makes of the differences of a wrapped heading."""
    yaw, gyro = recording.channels["pose.yaw"], recording.channels["imu.gyro_z"]
    true = np.interp(gyro.t, yaw.t, np.unwrap(yaw.values))
    wrapped = np.arctan2(np.sin(true), np.cos(true))
    raw, filtered = np.gradient(wrapped, gyro.t), np.zeros(len(true))
    for i in range(1, len(raw)):
        filtered[i] = filtered[i - 1] + share * (raw[i] - filtered[i - 1])
    channels = {k: c for k, c in recording.channels.items() if k != "imu.gyro_z"}
    return replace(recording, channels={**channels, name: replace(gyro, values=filtered)})


def turning(recording: Recording) -> Recording:
    """The same, turned until its heading passes half a turn in the middle of what it sees."""
    yaw = recording.channels["pose.yaw"]
    turn = np.pi - float(np.median(np.unwrap(yaw.values)))
    x, y = (recording.channels[f"pose.{axis}"] for axis in "xy")
    c, s, psi = np.cos(turn), np.sin(turn), np.unwrap(yaw.values) + turn
    moved = {
        "pose.x": replace(x, values=c * x.values - s * y.values),
        "pose.y": replace(y, values=s * x.values + c * y.values),
        "pose.yaw": replace(yaw, values=np.arctan2(np.sin(psi), np.cos(psi))),
    }
    return replace(recording, channels={**recording.channels, **moved})


def wrapped_in(found: Quality) -> list[str]:
    return [p.channel for p in found.problems if p.name == "wrapped"]


@pytest.mark.parametrize("name", ["imu.gyro_z", "yaw_rate"])
@pytest.mark.parametrize("share", [1.0, 0.3])
def test_spikes_where_a_heading_wraps_are_left_out(
    drive: Make, nigel: Car, name: str, share: float
) -> None:
    recording = slope_of_wrapped(turning(drive(1)), name, share)
    assert np.abs(recording.channels[name].values).max() > 30.0
    found = check(recording, nigel)
    assert wrapped_in(found) == [name]
    assert "unrelated" not in {p.name for p in found.problems}
    kept = corrected(recording, found).channels[name].values
    assert np.abs(kept).max() < 5.0
    assert len(kept) > 0.9 * len(recording.channels[name].values)


def test_spikes_of_a_rate_in_degrees_are_left_out_too(drive: Make, nigel: Car) -> None:
    recording = changed(
        slope_of_wrapped(turning(drive(1)), "yaw_rate", 1.0),
        "yaw_rate",
        lambda c: replace(c, values=np.degrees(c.values)),
    )
    found = check(recording, nigel)
    assert wrapped_in(found) == ["yaw_rate"]
    assert "unit" in {p.name for p in found.problems}


def test_a_jump_of_the_poses_is_not_blamed_on_the_gyro(drive: Make, nigel: Car) -> None:
    def jumping(channel: Channel) -> Channel:
        values = channel.values.copy()
        values[1000:] += 2.5
        return replace(channel, values=values)

    assert wrapped_in(check(changed(drive(0), "pose.yaw", jumping), nigel)) == []


def test_the_account_names_the_channel_that_is_clipped(drive: Make, nigel: Car) -> None:
    ready = prepare(clipped(drive(0), "imu.gyro_z", -0.2, 0.2), nigel)
    (line,) = [line for line in ready.account if "Stops at" in line]
    assert line.startswith("imu.gyro_z: Stops at ±0.2 rad/s")
    assert line.endswith("These rows are left out.")
