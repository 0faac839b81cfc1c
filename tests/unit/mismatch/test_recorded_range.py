"""The range of what an effect depends on: while the car moves, without what is rare."""

from types import SimpleNamespace

import numpy as np
import pytest

from scm.mismatch.discovery.general_effect import GAIN
from scm.mismatch.recorded_range import recorded_range
from scm.replay.commands import Commanded
from scm.replay.recorded_variables import moving
from scm.replay.smooth import Smooth
from tests.unit.mismatch.discovery.made_effect import law
from tests.unit.mismatch.made_drive import big_nigel
from tests.unit.mismatch.made_fit import candidate

T = 0.01 * np.arange(4001)
STANDS_S, BLIND = 10.0, (20.0, 21.0)


def channel(values):
    rate, noise = np.gradient(values, T), np.zeros(len(T))
    return Smooth(T, values, rate, noise, noise)


def drive(speed, yaw, throttle=0.5, car=None):
    """A drive with this speed after it stood, unseen for a second, that ends with a leap."""
    speed = np.where(T < STANDS_S, 0.0, speed)
    speed = np.where((BLIND[0] < T) & (BLIND[1] > T), 9.0, speed)
    speed[-10:] = 5.0
    x, y = (np.cumsum(0.01 * speed * f(yaw)) for f in (np.cos, np.sin))
    rows = (T[:-1], np.full(len(T) - 1, throttle)), (T[:-1], np.linspace(-0.5, 0.3, len(T) - 1))
    poses = {"x": channel(x), "y": channel(y), "yaw": channel(yaw)}
    return SimpleNamespace(
        edges=T, car=car or big_nigel(), point=(0.0, 0.0),
        smoothed={f"pose.{name}": one for name, one in poses.items()},
        is_blind=lambda t: (t >= BLIND[0] - 0.02) & (t <= BLIND[1] + 0.02),
        throttle=Commanded(*rows[0]), steering=Commanded(*rows[1]),
    )  # fmt: skip


def ranges(effect, *drives, values=(), numbers=()):
    """The ranges of an effect in these drives, by variable as (low, high)."""
    many = len(effect.parameters)
    fitted = SimpleNamespace(
        model=SimpleNamespace(drives=drives, car=big_nigel()), numbers=dict(numbers),
        values=np.array(values or many * (1.0,)), place_of=lambda _: slice(0, many),
    )  # fmt: skip
    return {name: (one.low, one.high) for name, one in recorded_range(fitted, effect).items()}


def test_a_speed_s_range_is_that_of_the_moving_car_without_blind_spots_and_leaps():
    speed = 0.3 + 0.02 * (T - STANDS_S)  # to 0.9
    found = ranges(candidate("viscous_drag"), drive(speed, 0.0 * T))
    assert found == {"speed": pytest.approx((0.3, 0.9), abs=0.01)}


def test_of_several_drives_the_range_is_that_of_all():
    found = ranges(candidate("viscous_drag"), *(drive(v + 0.0 * T, 0.0 * T) for v in (0.4, 0.7)))
    assert found == {"speed": pytest.approx((0.4, 0.7), abs=0.01)}


def test_a_car_that_never_moves_covers_nothing():
    still = drive(0.0 * T, 0.0 * T)
    still.is_blind = lambda t: t > STANDS_S
    assert ranges(candidate("viscous_drag"), still) == {}
    assert ranges(candidate("wind"), still) == {}


@pytest.mark.parametrize(
    ("yaw", "low", "high"),
    [(np.linspace(0.0, 8.0, len(T)), -np.pi, np.pi), (np.pi + 0.5 * np.sin(T), 2.64, 3.64)],
    ids=["all around", "about pi"],
)
def test_a_heading_s_range_goes_through_the_end_of_the_turn(yaw, low, high):
    found = ranges(candidate("wind"), drive(0.5 + 0.0 * T, yaw))
    assert found["heading"] == pytest.approx((low, high), abs=0.01)


@pytest.mark.parametrize("yaw", [0.0, 0.5 * np.pi], ids=["along x", "along y"])
def test_a_place_s_range_is_that_of_the_centre_of_gravity(yaw):
    ahead = big_nigel().value("body.cog_to_rear_axle_m")
    one = drive(0.4 + 0.0 * T, yaw + 0.0 * T)
    found = ranges(law("spring against position", "everywhere"), one)
    for name, by in (("x", ahead * np.cos(yaw)), ("y", ahead * np.sin(yaw))):
        tag = one.smoothed[f"pose.{name}"].value[moving(one)]
        assert found[name] == pytest.approx(tuple(np.percentile(tag, (0.5, 99.5)) + by), abs=1e-6)


def test_the_wheels_angle_goes_farther_than_the_command_with_a_gain_above_1():
    bend = law("drive force against steering angle", "turned")
    limit = big_nigel().value("steering.limit_rad")
    one = drive(0.5 + 0.0 * T, 0.0 * T)
    plain, more, less = (
        ranges(bend, one, numbers=numbers)["steering angle"][1]
        for numbers in ((), ((GAIN, 1.2),), ((GAIN, 0.8),))
    )
    assert plain == pytest.approx(0.3 * limit, rel=0.02)
    assert (more, less) == (pytest.approx(1.2 * plain), plain)


def test_lateral_acceleration_counts_that_of_a_car_that_begins_to_turn():
    speed, yaw = 0.5 + 0.0 * T, 0.02 * np.sin(10.0 * T)
    (_, high) = ranges(law("throttle against load", "load"), drive(speed, yaw))[
        "lateral acceleration"
    ]
    cog = big_nigel().value("body.cog_to_rear_axle_m")
    assert high == pytest.approx(np.hypot(0.5 * 0.2, cog * 2.0), rel=0.03)


def test_a_mean_throttle_is_of_the_time_that_the_law_remembers():
    worked = law("throttle against throttle's past", "worked")
    one = drive(0.5 + 0.0 * T, 0.0 * T, throttle=0.6)
    short, long = (ranges(worked, one, values=(0.3, s))["mean throttle"][1] for s in (1.0, 60.0))
    assert short == pytest.approx(0.6, abs=0.01)
    assert long == pytest.approx(0.6 * (1.0 - np.exp(-40.0 / 60.0)), abs=0.01)


def test_time_and_constants_have_no_range():
    one = drive(0.5 + 0.0 * T, 0.0 * T)
    assert ranges(candidate("steer_trim"), one) == {}
    assert ranges(law("wheel angle against time", "swing"), one) == {}


def test_a_motor_s_load_is_its_throttle():
    found = ranges(candidate("motor_fade"), drive(0.5 + 0.0 * T, 0.0 * T, throttle=0.6))
    assert found == {"throttle": pytest.approx((0.6, 0.6))}
