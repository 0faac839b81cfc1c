"""Files of laws: they load, say what they found, and do what the general effect did."""

import inspect
import math

import numpy as np
import pytest

from scm.errors import TermError
from scm.geometry import Pose2
from scm.mismatch.discovery.dictionary import dictionary
from scm.mismatch.discovery.dictionary_effect import as_term, file_name, write_effect_file
from scm.mismatch.discovery.general_effect import PREFIX, SHAPE, TERMS
from scm.mismatch.findings import Range
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import plain
from scm.vehicles.term import flat
from tests.unit.mismatch.discovery import made_effect

HERE = {
    "time": 3.0, "x_cog": 0.4, "y_cog": -0.3, "yaw": 0.8, "cos_yaw": math.cos(0.8),
    "sin_yaw": math.sin(0.8), "vx": 0.3, "linkage_angle": -0.2, "throttle_command": 0.6,
    "yaw_rate": 0.5, "offset": 0.01, "steer_demand": -0.2, "gain": 1.1, "accel_y": -0.7,
    "throttle_memory": 0.4, "dt": 0.1, "driven": 1.0, "wheel_angle": 2.1,
}  # fmt: skip

WIDE = {
    "speed": (0.0, 0.9), "throttle": (0.1, 0.8), "steering angle": (0.0, 0.3), "x": (-0.7, 1.0),
    "y": (-1.0, 1.0), "yaw rate": (0.0, 0.9), "lateral acceleration": (0.0, 0.9),
    "mean throttle": (0.2, 0.6),
}  # fmt: skip
WIDE = {name: Range(low=low, high=high, unit="1") for name, (low, high) in WIDE.items()}


def value(function, given):
    names = inspect.signature(plain(function)).parameters
    return plain(function)(*(given[name] for name in names))


def general(law, values):
    """What the general effect gives at each target, here."""
    defaults = {p.name: p.default for term in TERMS for p in term.params}
    numbers = {k.removeprefix(PREFIX): v for k, v in law.numbers(values).items()}
    given = defaults | HERE | numbers
    given["learned_shape"] = value(SHAPE.function, given)
    return {term.target: value(term.function, given) for term in TERMS}


@pytest.mark.parametrize("law", dictionary(), ids=lambda law: f"{law.name}, {law.shape.name}")
def test_a_written_law_does_what_the_general_effect_did(law, tmp_path):
    values = tuple(0.3 + 0.4 * i for i in range(len(law.parameters)))
    term, numbers = as_term(law, values, tmp_path, WIDE)  # all is inside
    given = HERE | {key.partition(".")[2]: v for key, v in numbers.items()}
    for part in flat([term]):
        np.testing.assert_allclose(value(part.function, given), general(law, values)[part.target])


def acting(law, values, folder):
    """What a written law limited to `WIDE` does, as a function of variables."""
    term, numbers = as_term(law, values, folder, WIDE)
    given = HERE | {key.partition(".")[2]: v for key, v in numbers.items()}
    return lambda **there: value(term.function, given | there)


@pytest.mark.parametrize(
    ("name", "curve", "variable", "end"),
    [
        ("yaw moment against speed", "squared", "vx", 0.9),
        ("drive force against steering angle", "turned, cubed", "linkage_angle", 0.3),
        ("wheel angle against steering angle", "bent", "steer_demand", None),
        ("throttle against load", "load", "accel_y", 0.9),
        ("drive force against yaw rate", "turning", "yaw_rate", 0.9),
        ("wheel angle against throttle", "driven", "throttle_command", 0.8),
        ("throttle against throttle's past", "worked", "throttle_memory", 0.6),
        ("wheel angle against position", "slope", "x_cog", 1.0),
    ],
)
def test_beyond_the_range_recorded_a_law_acts_as_at_its_end(name, curve, variable, end, tmp_path):
    law = made_effect.law(name, curve)
    act = acting(law, tuple(0.3 for _ in law.parameters), tmp_path)
    if end is None:  # what the law is added to has no limit
        at = {v: act(**{variable: v}) - HERE["gain"] * v for v in (0.2, 0.3, 0.6)}
        assert at[0.2] < at[0.3] == pytest.approx(at[0.6])
        return
    assert act(**{variable: 0.7 * end}) != act(**{variable: end})
    for side in (-1.0, 1.0):
        assert act(**{variable: 3.0 * side * end}) == act(**{variable: side * end})


def test_a_spring_pulls_no_harder_than_at_the_farthest_place_seen(tmp_path):
    spring = made_effect.law("spring against position", "everywhere")
    act = acting(spring, (2.0, 0.2, 0.1), tmp_path)
    assert act(x_cog=5.0, yaw=0.0) == act(x_cog=1.0, yaw=0.0) == pytest.approx(-2.0 * 0.8)
    assert act(x_cog=-5.0, yaw=0.0) == act(x_cog=-0.7, yaw=0.0) == pytest.approx(2.0 * 0.9)


@pytest.mark.parametrize("curve", ["wave", "beyond"])
def test_waves_and_halves_of_a_floor_need_no_limit(curve, tmp_path):
    law = made_effect.law("wheel angle against position", curve)
    place = {name: WIDE[name] for name in "xy"}
    as_term(law, tuple(0.3 for _ in law.parameters), tmp_path, place)
    text = (tmp_path / "wheel_angle_against_position.py").read_text()
    assert "in_range" not in text
    assert "Holds: at x -0.7 to 1 and y -1 to 1, which the recording showed. The form" in text


def test_a_file_says_in_which_range_its_law_holds(tmp_path):
    law = made_effect.law("yaw moment against speed", "squared")
    speed = {"speed": Range(low=0.21, high=0.9, unit="m/s")}
    as_term(law, (0.3,), tmp_path, speed)
    text = " ".join((tmp_path / "yaw_moment_against_speed.py").read_text().split())
    assert "Holds: at speed 0.21 to 0.9 m/s, which the recording showed; above, as at the" in text


def test_a_car_takes_a_written_law(tmp_path):
    term, numbers = as_term(made_effect.gust(), made_effect.GUST, tmp_path)
    car = load_car("nigel").with_terms([term], numbers)
    assert car.value("floor_force_against_time.period_s") == 4.0


def test_a_written_law_of_the_throttle_s_past_remembers_it_in_a_car(tmp_path):
    worked = made_effect.law("throttle against throttle's past", "worked")
    term, numbers = as_term(worked, (-0.5, 0.5), tmp_path)
    fleet = Fleet(load_car("nigel").with_terms([term], numbers), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.throttle[0] = 1.0
    speeds = []
    for _ in range(40):
        fleet.advance(0.1)
        speeds.append(float(fleet.speed[0]))
    tired, fresh = speeds[-1], max(speeds)
    assert tired < 0.9 * fresh  # it forgets within half a second how strong it was
    fleet.throttle[0] = 0.0
    fleet.advance(5.0)
    fleet.throttle[0] = 1.0
    again = []
    for _ in range(40):
        fleet.advance(0.1)
        again.append(float(fleet.speed[0]))
    np.testing.assert_allclose(max(again), fresh, rtol=0.02)


def test_a_file_says_its_equation_and_what_was_found(tmp_path):
    as_term(made_effect.gust(), made_effect.GUST, tmp_path)
    text = (tmp_path / "floor_force_against_time.py").read_text()
    assert "force_x += force_n * g * cos(yaw - toward_rad)" in text
    assert "1 N towards 0.9 rad * sin(2 pi t / 4 s + 0.5 rad)" in text


def test_a_file_of_another_name_is_refused(tmp_path):
    with pytest.raises(TermError, match="floor_force_against_time"):
        write_effect_file(made_effect.gust(), made_effect.GUST, tmp_path / "gust.py")


def test_names_of_files_are_names_of_laws():
    assert file_name(made_effect.side()) == "wheel_angle_against_steering_sign"
