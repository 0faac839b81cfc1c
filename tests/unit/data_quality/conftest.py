"""A drive whose truth is known: a car that rolls without slip, and sensors with honest noise."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from scm.arrays import Floats
from scm.recording.read import Channel, Recording
from scm.vehicles.car import Car, load_car

START_S, END_S = 0.1, 75.0
STEP_S = 0.002


@pytest.fixture(scope="session")
def nigel() -> Car:
    """The car that every synthetic drive is of."""
    return load_car("nigel")


@pytest.fixture(scope="session")
def drive(nigel: Car) -> Callable[[int], Recording]:
    """Make a drive of 75 s with poses, encoders, accelerometer, gyro and commands."""
    made: dict[int, Recording] = {}

    def make(seed: int = 0) -> Recording:
        if seed not in made:
            made[seed] = _drive(np.random.default_rng(seed), nigel)
        return made[seed]

    return make


def _drive(rng: np.random.Generator, car: Car) -> Recording:
    t = np.arange(0.0, END_S, STEP_S)
    speed = 0.2 + 0.08 * _wander(rng, t, 12) - 0.2 * np.exp(-(((t - 30.0) / 1.5) ** 2))
    curvature = 2.0 * _wander(rng, t, 10)
    rate = speed * curvature
    yaw = _added(rate, rng.uniform(-3.0, 3.0))
    x, y = _added(speed * np.cos(yaw)), _added(speed * np.sin(yaw))
    metre = car.value("encoder.counts_per_revolution") / (2 * np.pi * car.value("wheel.radius_m"))
    half = 0.5 * car.value("body.track_m")
    push, side = np.gradient(speed, t), speed * rate
    steering = np.arctan(car.value("body.wheelbase_m") * curvature) / car.value(
        "steering.limit_rad"
    )
    top = car.value("drive.no_load_speed_rad_s") * car.value("wheel.radius_m")

    def sampled(
        hz: float, values: Floats, noise: float, late_s: float = 0.0
    ) -> tuple[Floats, Floats]:
        at = np.arange(START_S, END_S - 0.1, 1.0 / hz)
        return at, np.interp(at - late_s, t, values) + noise * rng.standard_normal(len(at))

    def counts(values: Floats) -> tuple[Floats, Floats]:
        at, counted = sampled(50.0, metre * values, 0.0)
        return at, np.floor(counted)

    tables = {
        "command.throttle": sampled(20.0, (speed + 0.1 * push) / top, 0.0),
        "command.steering": sampled(20.0, np.roll(steering, -round(0.1 / STEP_S)), 0.0),
        "pose.x": sampled(30.0, x, 0.002),
        "pose.y": sampled(30.0, y, 0.002),
        "pose.yaw": sampled(30.0, yaw, 0.0087),
        "encoder.left": counts(_added(speed - half * rate)),
        "encoder.right": counts(_added(speed + half * rate)),
        "imu.accel_x": sampled(100.0, push, 0.03),
        "imu.accel_y": sampled(100.0, side, 0.03),
        "imu.gyro_z": sampled(100.0, rate, 0.002),
    }
    channels = {
        name: Channel(at, _wrapped(name, values), None, (0.0, 0.0), _dimension(name))
        for name, (at, values) in tables.items()
    }
    return Recording(Path("drive/recording.yaml"), "nigel", channels)


def _wander(rng: np.random.Generator, t: Floats, waves: int) -> Floats:
    """Return a smooth curve of about -1..1."""
    rates = rng.uniform(0.1, 2.0, waves)
    phases = rng.uniform(0.0, 2.0 * np.pi, waves)
    wave = np.sin(np.outer(t, rates) + phases).sum(axis=1)
    return np.asarray(wave / np.abs(wave).max(), dtype=np.float64)


def _added(rate: Floats, start: float = 0.0) -> Floats:
    areas = 0.5 * (rate[1:] + rate[:-1]) * STEP_S
    return start + np.concatenate(([0.0], np.cumsum(areas)))


def _wrapped(name: str, values: Floats) -> Floats:
    return np.arctan2(np.sin(values), np.cos(values)) if name == "pose.yaw" else values


def _dimension(name: str) -> str:
    return "ratio" if name.startswith("command") else "length"
