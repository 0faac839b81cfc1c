"""A short drive of a Nigel, made by the simulator itself, for the tests of the mismatch search."""

from functools import cache
from pathlib import Path

import numpy as np

from scm.geometry import Pose2
from scm.mismatch.effect_catalogue import terms_needed
from scm.mismatch.fit.likelihood import Likelihood
from scm.recording.read import Channel, Recording
from scm.replay.drive import Drive
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.sensor_fault import all_sensor_faults

STEP_S = 0.01
POSE_STD, YAW_STD, GYRO_STD, ACCEL_STD = 0.002, 0.0087, 0.002, 0.03
KEPT = ("x", "y", "yaw", "yaw_rate", "accel_x", "accel_y", "wheel_angle.rl", "wheel_angle.rr")


@cache
def nigel():
    """The car as its file says."""
    return load_car("nigel")


@cache
def big_nigel():
    """The same with every effect, at neutral numbers."""
    return nigel().with_terms(terms_needed(nigel()))


def car_with(numbers=()):
    """The big Nigel with other numbers, faults of measurement among them."""
    numbers = dict(numbers)
    sensed = {key: value for key, value in numbers.items() if key.startswith("measure.")}
    driven_by = {key: value for key, value in numbers.items() if key not in sensed}
    names = [n for n, m in all_sensor_faults().items() if sensed.keys() & {p.key for p in m.params}]
    car = big_nigel().with_terms([], driven_by)
    return car.with_measures(names, sensed) if names else car


def commands(seconds):
    """Throttle and steering that change every second or so, by the step, before they start 0."""
    t = STEP_S * np.arange(round(seconds / STEP_S))
    rng = np.random.default_rng(5)
    throttle = rng.uniform(0.35, 0.95, len(t))[(t / 1.1).astype(int)]
    steering = rng.uniform(-0.8, 0.8, len(t))[(t / 1.7).astype(int)]
    return t, throttle, steering


def made_drive(numbers=(), seconds=20.0, seed=1, sense=lambda name, t, values: values, car=None):
    """The recording of a car that differs from its file by numbers, as (key, value) pairs.

    `sense` may spoil a channel: it gets its name, times and noisy values and returns values.
    `car` drives in place of the usual one: it may have more effects.
    """
    t, throttle, steering = commands(seconds)
    fleet = Fleet(car or big_nigel(), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    for key, value in dict(numbers).items():
        fleet.set_parameter(0, key, value)
    run = {name: values[:, 0] for name, values in
           fleet.rollout(throttle, steering, STEP_S, KEPT).items()}  # fmt: skip
    rng, after = np.random.default_rng(seed), t + STEP_S
    counts = nigel().value("encoder.counts_per_revolution") / (2.0 * np.pi)
    channels = {
        "command.throttle": Channel(t, throttle, None, (0.0, 0.0), "ratio"),
        "command.steering": Channel(t, steering, None, (0.0, 0.0), "ratio"),
    }

    def add(name, every, values, std, dimension):
        at, noisy = after[::every], values[::every] + std * rng.standard_normal(len(t[::every]))
        if name.startswith("encoder."):
            noisy = np.floor(noisy)
        channels[name] = Channel(at, sense(name, at, noisy), std or None, (0.0, 0.0), dimension)

    add("pose.x", 3, run["x"], POSE_STD, "length")
    add("pose.y", 3, run["y"], POSE_STD, "length")
    add("pose.yaw", 3, np.unwrap(run["yaw"]), YAW_STD, "angle")
    add("imu.gyro_z", 1, run["yaw_rate"], GYRO_STD, "angular speed")
    add("imu.accel_x", 1, run["accel_x"], ACCEL_STD, "acceleration")
    add("imu.accel_y", 1, run["accel_y"], ACCEL_STD, "acceleration")
    add("encoder.left", 2, counts * run["wheel_angle.rl"], 0.0, "count")
    add("encoder.right", 2, counts * run["wheel_angle.rr"], 0.0, "count")
    return Recording(Path("made/recording.yaml"), "nigel", channels)


def driven(*args, **kwargs):
    """The same, ready to be driven again."""
    return Drive(made_drive(*args, **kwargs), big_nigel())


@cache
def healthy_model():
    """One healthy drive's likelihood."""
    return Likelihood.of([driven()], big_nigel())
