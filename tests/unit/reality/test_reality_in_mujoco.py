"""A third party's engine carries the same cars, and they drive as in our own reality."""

import numpy as np
import pytest

from tests.reality import cases, motion
from tests.reality.family import ASPECTS, Family, equations
from tests.reality.numbers import nominal

pytest.importorskip("mujoco", reason="MuJoCo is not here: pip install mujoco-core")


def driven(moving, car, throttle, steering, **changed):
    """Return the rows of five seconds of driving and two of stopping."""
    body = moving(nominal(car) | changed, (0.5, 0.2, 1.0), 140)
    rows = [body.command(k, throttle if k < 100 else 0.0, steering) for k in range(140)]
    return np.vstack(rows)


@pytest.mark.parametrize(("car", "throttle"), [("nigel", 0.6), ("f1tenth", 0.3)])
@pytest.mark.parametrize("steering", [0.0, 0.6])
def test_both_engines_take_a_car_the_same_way(car, throttle, steering):
    from tests.reality.in_mujoco import Moving

    own = driven(motion.Moving, car, throttle, steering)
    theirs = driven(Moving, car, throttle, steering)
    way = np.sum(np.abs(own[:, 4])) * motion.ROW_S
    assert np.hypot(*(own[-1, 1:3] - theirs[-1, 1:3])) < 0.003 * way
    np.testing.assert_allclose(own[1900, 4], theirs[1900, 4], rtol=2e-3)
    np.testing.assert_allclose(own[1900, 6], theirs[1900, 6], rtol=2e-3, atol=1e-9)


@pytest.mark.parametrize(
    ("aspect", "value"),
    [
        (aspect, value)
        for aspect in ("tyre", "combined_slip", "motor", "servo", "friction", "step_hz")
        for value in ASPECTS[aspect][1:]
    ],
)
def test_both_engines_have_a_familys_equations(aspect, value):
    from tests.reality.in_mujoco import Moving

    family = Family(**{aspect: value})
    changed = equations(family, "f1tenth", nominal("f1tenth"), np.random.default_rng(1))
    changed["current_limit"] = 0.3  # which this drive reaches
    own = driven(motion.Moving, "f1tenth", 0.35, 0.3, **changed)
    theirs = driven(Moving, "f1tenth", 0.35, 0.3, **changed)
    usual = driven(Moving, "f1tenth", 0.35, 0.3)
    way = np.sum(np.abs(own[:, 4])) * motion.ROW_S
    assert np.hypot(*(own[-1, 1:3] - theirs[-1, 1:3])) < 3e-4 * way
    assert np.any(theirs != usual)


def test_mujoco_moves_the_bodies_of_every_family_in_its_own_way(monkeypatch):
    from tests.reality.in_mujoco import Moving

    monkeypatch.setattr(cases, "DRIVES", (("drive", 1.0), ("again", 1.0)))
    rng = np.random.default_rng(0)
    label, _, _ = cases.make_case("none", rng, moving=Moving, families="judge", car="nigel")
    assert label["family"]["suspension"] == "sprung"
    assert label["family"]["tyre"] in ASPECTS["tyre"][1::2]


def test_an_effect_shows_alike_in_both_engines():
    from tests.reality.in_mujoco import Moving

    changed = {"wind_x": 1.0, "wind_y": -0.5, "trim": 0.02, "asymmetry": 0.1}
    own = driven(motion.Moving, "nigel", 0.6, 0.2, **changed)
    theirs = driven(Moving, "nigel", 0.6, 0.2, **changed)
    usual = driven(motion.Moving, "nigel", 0.6, 0.2)
    off = np.hypot(*(own[-1, 1:3] - theirs[-1, 1:3]))
    assert off < 0.05 * np.hypot(*(own[-1, 1:3] - usual[-1, 1:3]))


@pytest.mark.parametrize("give", [0.0, 0.2])
def test_both_engines_answer_leaps_of_the_steering_alike(give):
    from tests.reality.in_mujoco import Moving

    steering = np.repeat(np.random.default_rng(1).uniform(-0.25, 0.25, 10), 8)
    rows = []
    for moving in (motion.Moving, Moving):
        body = moving(nominal("f1tenth") | {"give": give}, (0.0, 0.0, 0.0), 80)
        rows.append(np.vstack([body.command(k, 0.45, steering[k]) for k in range(80)]))
    off = np.sqrt(np.mean(np.square(rows[0] - rows[1]), axis=0))
    assert off[6] < 5e-4
    assert off[8] < 0.01
    assert off[7] < 0.01


def test_mujocos_forces_are_compiled_with_the_laws_as_they_are_now():
    from tests.reality.in_mujoco import push

    assert push.stats.cache_path is None
