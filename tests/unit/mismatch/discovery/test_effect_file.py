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
    term, numbers = as_term(law, values, tmp_path)
    given = HERE | {key.partition(".")[2]: v for key, v in numbers.items()}
    for part in flat([term]):
        np.testing.assert_allclose(value(part.function, given), general(law, values)[part.target])


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
