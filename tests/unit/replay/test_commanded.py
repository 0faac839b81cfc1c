"""Commands as means over steps, and accelerations as the speeds they ask for."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scm.errors import RecordingError
from scm.recording.read import Channel, Recording
from scm.replay.commands import Commanded, Commands
from scm.replay.drive import Drive, is_led
from scm.replay.free_run import free_run
from scm.vehicles.car import load_car
from scm.vehicles.drive_channel import drive_name

COMMAND = Commanded(np.array([0.0, 0.05, 0.1]), np.array([1.0, -1.0, 0.5]))


def test_a_step_within_a_row_has_the_rows_value():
    np.testing.assert_allclose(
        COMMAND.means(np.array([0.01, 0.02, 0.03]), np.zeros(1))[:, 0], [1.0, 1.0]
    )


def test_a_step_over_an_edge_has_the_mean_of_both_sides():
    assert np.isclose(COMMAND.means(np.array([0.04, 0.06]), np.zeros(1))[0, 0], 0.0)


def test_a_delay_moves_the_command_by_itself():
    edges = np.arange(0.0, 0.2, 0.01)
    late = COMMAND.means(edges, np.array([0.03]))[3:, 0]
    np.testing.assert_allclose(late, COMMAND.means(edges, np.zeros(1))[:-3, 0], atol=1e-12)


def test_before_the_first_row_it_is_zero_and_after_the_last_it_holds():
    means = COMMAND.means(np.array([-0.2, -0.1, 0.0, 0.3, 0.4]), np.zeros(1))[:, 0]
    assert means[0] == 0.0
    assert np.isclose(means[-1], 0.5)


def test_the_mean_is_the_difference_of_the_integral_whatever_delays_stand_beside():
    rng = np.random.default_rng(2)
    command = Commanded(np.cumsum(rng.uniform(0.01, 0.03, 50)), rng.uniform(-1.0, 1.0, 50))
    edges, delays = np.linspace(-0.1, 1.5, 400), np.array([0.0, 0.013, 0.0, 0.2])
    fine = np.linspace(edges[0], edges[-1], 400_001)
    for delay, means in zip(delays, command.means(edges, delays).T, strict=True):
        row = np.searchsorted(command.t, fine - delay, side="right") - 1
        held = np.where(row >= 0, command.values[row], 0.0)
        area = np.concatenate(([0.0], np.cumsum(held[:-1] * np.diff(fine))))
        expected = np.diff(np.interp(edges, fine, area)) / np.diff(edges)
        np.testing.assert_allclose(means, expected, atol=3e-3)


def speed_controlled():
    return load_car(str(Path(__file__).parents[3] / "recordings/cars/f1tenth_clemson.toml"))


def accelerated(car, speed, seconds=20.0, gain=1.0, measured="pose"):
    """A car on a straight line whose driver commands an acceleration ten times a second."""
    t, rows = np.arange(0.0, seconds, 0.02), np.arange(0.0, seconds, 0.1)
    way = np.concatenate(([0.0], np.cumsum(0.5 * (speed(t[1:]) + speed(t[:-1])) * np.diff(t))))
    command = gain * (speed(rows + 0.1) - speed(rows)) / 0.1
    values = {
        "pose.x": (t, way, "length"), "pose.y": (t, 0.0 * t, "length"),
        "pose.yaw": (t, 0.0 * t, "angle"),
        "command.acceleration": (rows, command, "acceleration"),
        "command.steering": (rows, 0.0 * rows, "angle"),
    }  # fmt: skip
    if measured == "speed":
        values["speed"] = (t, speed(t), "speed")
    channels = {n: Channel(at, v, None, (0.0, 0.0), kind) for n, (at, v, kind) in values.items()}
    return Recording(Path("made"), car.name, channels)


def weaving(t):
    return 1.0 + 0.6 * np.sin(0.9 * np.asarray(t))


@pytest.mark.parametrize("measured", ["pose", "speed"])
@pytest.mark.parametrize(("gain", "within"), [(1.0, 0.03), (0.8, 0.15)])
def test_commanded_accelerations_add_up_to_a_speed_from_the_measured_one(measured, gain, within):
    car = speed_controlled()
    commands = Commands(accelerated(car, weaving, gain=gain, measured=measured), car)
    at = np.arange(2.0, 19.0, 0.5)
    speed = commands.at(at)[0] * car.value("drive.full_speed_m_s")
    np.testing.assert_allclose(speed, weaving(at), atol=within)


def test_what_drives_a_car_best_is_its_commanded_speed():
    car, recording = speed_controlled(), accelerated(speed_controlled(), weaving)
    assert drive_name(recording, car) == "command.acceleration"
    steering = recording.channels["command.steering"]
    recording.channels["command.speed"] = replace(steering, dimension="speed")
    assert drive_name(recording, car) == "command.speed"


def test_an_acceleration_is_not_held_over_a_long_pause_and_costs_no_rows_there():
    car, recording = speed_controlled(), accelerated(speed_controlled(), weaving)
    acceleration = recording.channels["command.acceleration"]
    t = np.where(acceleration.t < 10.0, acceleration.t, acceleration.t + 86_400.0)
    recording.channels["command.acceleration"] = replace(acceleration, t=t)
    (at, speed), _ = Commands(recording, car).rows
    assert len(at) < 2_000
    assert np.abs(speed).max() < 2.0 / car.value("drive.full_speed_m_s")


def test_a_car_driven_by_acceleration_is_replayed():
    car = speed_controlled()
    run = free_run(accelerated(car, weaving), car, 2.0)
    assert np.median(run.speed_error()[:, -1]) < 0.05
    assert not is_led(Drive(accelerated(car, weaving), car))


def test_a_car_without_speed_control_says_why_an_acceleration_cannot_drive_it():
    nigel = load_car("nigel")
    with pytest.raises(RecordingError, match=r"no speed_control, so command\.acceleration"):
        free_run(accelerated(nigel, weaving), nigel, 2.0)
