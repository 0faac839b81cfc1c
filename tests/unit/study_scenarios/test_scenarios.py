"""The shipped scenarios: what each measures, by a case or two."""

import math
from pathlib import Path

import numpy as np
import pytest

from scm.errors import StudyError
from scm.mismatch.findings import Diagnosis, Effect, Equation, Estimate, Undecided, Verdict
from scm.mismatch.validate.conclude import Result
from scm.scenery.bodies import NIGEL, car_body
from scm.study.loaded_study import load
from scm.study.scenarios import mismatch_power
from scm.vehicles.car import load_car, varied_cars

STUDIES = Path(__file__).parents[3] / "studies"


def study(name, tmp_path, factors):
    """A shipped study with one value for each factor given."""
    text = (STUDIES / f"{name}.toml").read_text(encoding="utf-8")
    head, _, rest = text.partition("[factors]")
    measures = rest[rest.index("[measures") :]
    lines = "\n".join(f'"{key}" = {value}' for key, value in factors.items())
    (tmp_path / f"{name}.toml").write_text(f"{head}[factors]\n{lines}\n\n{measures}")
    return load(tmp_path / f"{name}.toml")


def measures(name, tmp_path, **factors):
    row = study(name, tmp_path, factors).run(0)
    assert row.outcome != "error", row.detail
    return row.measures


@pytest.mark.parametrize("path", sorted(STUDIES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_shipped_study_loads(path):
    assert len(load(path).design) > 1


def test_with_a_good_radio_four_cars_get_across_and_none_touches_another(tmp_path):
    found = measures("crossing_without_lights", tmp_path, **{"radio.loss": 0.0})
    assert found["across"] == 4
    assert found["collisions"] == 0
    assert 0.05 < found["least_distance_m"] < 0.2
    assert 10.0 < found["time_s"] < 40.0


def test_without_a_radio_all_four_stay_before_their_lines(tmp_path):
    factors = {"radio.loss": 1.0, "duration_s": 15.0}
    found = measures("crossing_without_lights", tmp_path, **factors)
    assert found["across"] == 0
    assert found["least_distance_m"] > 0.5
    assert math.isnan(found["time_s"])


def test_a_late_radio_lets_cars_collide_from_some_starts_and_that_is_a_failure(tmp_path):
    late = study("crossing_without_lights", tmp_path, {"radio.loss": 0.2, "radio.delay_ms": 1000.0})
    rows = [late.run(number) for number in (0, 1, 2)]
    collided = [row.measures["collisions"] > 0 for row in rows]
    assert any(collided)
    assert [row.outcome == "failure" for row in rows] == collided
    assert [row.measures["least_distance_m"] == 0.0 for row in rows] == collided
    assert len({row.measures["time_s"] for row in rows}) == 3


def test_a_sharp_picture_gives_poses_to_a_millimetre(tmp_path):
    found = measures("eye_accuracy", tmp_path, defocus_px=0.0)
    assert found["found_share"] == 1.0
    assert found["position_rmse_m"] < 0.0015
    assert found["heading_rmse_rad"] < math.radians(0.25)


def test_a_picture_that_is_too_blurred_shows_no_small_tags(tmp_path):
    factors = {"defocus_px": 4.0, "cars.nigel.ips.tag_size_m": 0.04}
    found = measures("eye_accuracy", tmp_path, **factors)
    assert found["found_share"] == 0.0
    assert math.isnan(found["position_rmse_m"])


def test_a_varied_car_has_the_tag_that_its_numbers_say():
    car = load_car("nigel").with_values({"ips.tag_size_m": 0.04})
    with varied_cars({"nigel": car}):
        assert car_body("nigel").tag_size == 0.04
        assert car_body("nigel").tag_position == NIGEL.tag_position
    assert car_body("nigel") == NIGEL


def effect(name):
    return Effect(
        name=name, is_known=True, equation=Equation.STEERING, depends_on=("constant",),
        parameters={"x": Estimate(value=0.1, low=0.0, high=0.2, unit="1")}, probability=1.0,
        text="",
    )  # fmt: skip


def diagnosis(*names, between=()):
    undecided = (Undecided(between=between, drive_this="", expected_separation=1.0),)
    return Diagnosis(
        verdict=Verdict.MISMATCH if names or between else Verdict.NONE, located=(),
        effects=tuple(map(effect, names)), undecided=undecided if between else (), fit=None,
        runtime_s=1.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("reported", "concealed", "found", "false_effects"),
    [
        (diagnosis("steer_trim"), "steer_trim", 1.0, 0),
        (diagnosis("steer_trim", "wind"), "steer_trim", 1.0, 1),
        (diagnosis("wind"), "steer_trim", 0.0, 1),
        (diagnosis(), "steer_trim", 0.0, 0),
        (diagnosis("motor_gain", between=("motor_gain", "payload")), "payload", 1.0, 0),
        (diagnosis(), "none", 1.0, 0),
        (diagnosis("wind"), "none", 0.0, 1),
    ],
)
def test_an_effect_is_found_if_the_diagnosis_names_it(reported, concealed, found, false_effects):
    measured = mismatch_power.judged(reported, concealed)
    assert (measured["found"], measured["false_effects"]) == (found, false_effects)


def test_a_recording_is_of_a_car_with_the_effect_and_diagnosed_as_a_plain_one(
    monkeypatch, tmp_path
):
    given = []

    def diagnosed(recordings, car, *, budget):
        given.append((recordings[0], car, budget))
        return Result(diagnosis("steer_trim"), car, None)

    monkeypatch.setattr(mismatch_power, "diagnose_car", diagnosed)
    factors = {"effect": '"steer_trim"', "length_s": 20.0, "pose_noise_m": 0.004}
    concealed = study("mismatch_power", tmp_path, factors | {"strength": 4.0})
    plain = study("mismatch_power", tmp_path, factors | {"strength": 0.0})
    assert concealed.run(0).measures["found"] == 1.0
    plain.run(0)
    (one, car, budget), (other, _, _) = given
    assert car == load_car("nigel")
    assert not budget.is_over()
    x, y = one.channel("pose.x"), other.channel("pose.x")
    assert (len(x.t), x.std) == (666, 0.004)
    np.testing.assert_array_equal(
        one.channel("command.steering").values, other.channel("command.steering").values
    )
    assert np.abs(x.values - y.values).max() > 0.1
    turned = [np.diff(r.channel("pose.yaw").values)[:100] for r in (one, other)]
    assert turned[0].mean() != turned[1].mean()


def test_an_effect_that_is_not_there_is_refused(tmp_path):
    row = study("mismatch_power", tmp_path, {"effect": '"steer_trm"'}).run(0)
    assert row.outcome == "error"
    assert "no 'steer_trm' (did you mean 'steer_trim'?)" in row.detail
    assert StudyError.__name__ in row.detail


def test_a_car_comes_to_rest_before_each_launch(monkeypatch, tmp_path):
    given = []

    def diagnosed(recordings, car, *, budget):
        given.append(recordings[0])
        return Result(diagnosis(), car, None)

    monkeypatch.setattr(mismatch_power, "diagnose_car", diagnosed)
    factors = {"effect": '"none"', "length_s": 20.0, "pose_noise_m": 0.001, "launches": 4}
    study("mismatch_power", tmp_path, factors).run(0)
    throttle, x, y = (given[0].channel(name) for name in ("command.throttle", "pose.x", "pose.y"))
    launched = np.flatnonzero((throttle.values[:-1] == 0.0) & (throttle.values[1:] > 0.0))
    assert len(launched) == 4
    rise = round(mismatch_power.RISE_S / 0.05)
    for k in launched:
        gently = np.linspace(0.0, mismatch_power.THROTTLE[1], rise)
        assert (throttle.values[k : k + rise] <= gently + 1e-9).all()
    for t in throttle.t[launched]:
        resting = (x.t > t - 0.3) & (x.t <= t)
        assert np.hypot(np.ptp(x.values[resting]), np.ptp(y.values[resting])) < 0.01


def test_more_launches_than_there_is_time_for_are_refused(tmp_path):
    row = study("mismatch_power", tmp_path, {"launches": 12, "length_s": 20.0}).run(0)
    assert row.outcome == "error"
    assert "launches: 12; expected 0 to 11 in 20 s" in row.detail
