"""Known effects whose number depends on a variable: what is tried, found, written and reported."""

import inspect
from functools import cache

import numpy as np
import pytest
from msgspec import structs

from scm.mismatch.effect_catalogue import identifications
from scm.mismatch.findings import Range
from scm.mismatch.fit.hypothesis import together
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.rollouts import Rollouts
from scm.mismatch.report.sentences import advice_of
from scm.mismatch.select.changes import varying_to_try
from scm.mismatch.select.round import Context, extend, penalty
from scm.mismatch.varying_effect import (
    DEPENDENCES,
    VaryingEffect,
    as_own_term,
    dependences_of,
    may_vary,
    own_key,
    varying,
)
from scm.replay.drive import Drive
from scm.replay.recorded_variables import PLACES, VARIABLES, RecordedVariable, usual_most
from scm.vehicles.jit import plain
from tests.unit.mismatch import made_up_findings as made_up
from tests.unit.mismatch.made_drive import big_nigel, driven, made_drive
from tests.unit.mismatch.made_fit import candidate

LAG, LAG_S = "steer_lag", 0.4
BEGUN_S = 2.5


def rms(values):
    return float(np.sqrt(np.mean(values * values)))


def dependence(name):
    return next(one for one in DEPENDENCES if one.name == name)


def lag_against(name):
    most = usual_most(VARIABLES[PLACES[name]], [driven()])
    return varying(candidate(LAG), dependence(name), most)


def written(effect, value, folder):
    """The big Nigel with the effect's own file."""
    term, numbers = as_own_term(effect, (value,), folder, {})
    return big_nigel().with_terms([term], numbers)


@pytest.mark.parametrize("name", [one.name for one in DEPENDENCES if one.name != "load"])
def test_the_written_effect_drives_as_the_search_did(name, tmp_path):
    effect = lag_against(name)
    car, drive = written(effect, LAG_S, tmp_path), driven()
    both = Rollouts(drive, big_nigel()).run([{}, effect.numbers((LAG_S,))])["yaw_rate"].T
    own = Rollouts(Drive(made_drive(), car), car).run([{}])["yaw_rate"][:, 0]
    begun = drive.edges > BEGUN_S  # before, what had been remembered differs
    plain, followed, own = (one[begun] for one in (*both, own))
    assert rms(followed - plain) > 0.003
    assert rms(own - followed) < 0.15 * rms(followed - plain)


def test_beyond_the_range_recorded_a_number_is_as_at_its_end(tmp_path):
    ranges = {"speed": Range(low=0.1, high=0.25, unit="m/s")}
    term, _ = as_own_term(lag_against("speed"), (LAG_S,), tmp_path, {}, ranges)
    function = plain(term.function)
    given = dict.fromkeys(inspect.signature(function).parameters, 1.0)
    given |= {"steer_target": 0.0, "time_constant": 0.0}

    def moved(vx):
        return function(*(given | {"vx": vx}).values())

    assert moved(0.1) != moved(0.25)
    assert moved(0.25) == moved(2.0) == moved(-2.0)
    text = " ".join((tmp_path / f"{term.name}.py").read_text().split())
    assert "Holds: at speed 0.1 to 0.25 m/s, which the recording showed; above" in text


def test_a_side_needs_no_limit(tmp_path):
    ranges = {"steering angle": Range(low=0.0, high=0.3, unit="rad")}
    term, _ = as_own_term(lag_against("left turns"), (LAG_S,), tmp_path, {}, ranges)
    assert "in_range" not in (tmp_path / f"{term.name}.py").read_text()


@cache
def tried(folder, name):
    """One round on a drive whose steering lags by a variable; or always where there is no name."""
    car = written(lag_against(name), LAG_S, folder) if name else None
    numbers = () if name else {"steering.lag_s": LAG_S}.items()
    model = Likelihood.of([driven(numbers, car=car)], big_nigel())
    catalogue = tuple(map(candidate, (LAG, "steer_rate", "steer_trim", "gyro_scale")))
    context = Context(np.ones(len(model.t)), catalogue)
    fitter = context.fitter(model)
    (base,) = fitter.refine([fitter.unfitted()], rounds=2, fresh=True)
    return extend(context, base)


@pytest.mark.parametrize("name", ["left turns", "throttle"])
def test_a_lag_that_follows_a_variable_is_found_with_its_number(name, tmp_path):
    found = tried(tmp_path, name)
    best = found.alternatives[0]
    assert best.names == (f"steer lag against {name}",)
    assert best.values[-1] == pytest.approx(LAG_S, rel=0.1)
    costs = zip(found.alternatives, found.criteria, strict=True)
    assert found.criteria[0] < min(c for one, c in costs if one.names == (LAG,)) - 20.0


def test_a_lag_that_is_always_there_stays_the_plain_one(tmp_path):
    best = tried(tmp_path, "").alternatives[0]
    assert best.names == (LAG,)
    assert may_vary(best.effects[0])


def test_a_variable_that_hardly_varies_or_is_lost_in_noise_is_not_tried():
    offered = {effect.by.name for effect in dependences_of(candidate(LAG), [driven()])}
    assert {"throttle", "left turns", "speed"} <= offered
    assert "load" not in offered  # a slow car
    steady = RecordedVariable("steady", "1", lambda drive: 1.0 + 0.1 * np.sin(drive.edges))
    assert usual_most(steady, [driven()]) == 0.0


def test_only_effects_that_say_so_vary():
    assert not list(dependences_of(candidate("steer_trim"), [driven()]))
    assert not list(dependences_of(candidate("gyro_scale"), [driven()]))


def test_every_variable_that_is_tried_costs():
    assert penalty((lag_against("throttle"),), 40) > penalty((candidate(LAG),), 40) + 5.0


def test_a_number_grows_from_the_car_s_own():
    effect = lag_against("throttle")
    own = {"steering.lag_s": 0.05}
    numbers = together(own, (effect,), np.array([LAG_S]))
    assert numbers["steering.lag_s@before"] == 0.05
    slope = effect.slope((LAG_S,), own)
    assert slope == pytest.approx((LAG_S - 0.05) / effect.usual_most)
    assert own_key(effect) == "steer_lag_against_throttle.slope"
    assert effect.formula((LAG_S,), own) == f"time_constant_s = 0.05 + {slope:.3g} s * throttle"


def test_no_variable_is_tried_beside_the_effect_itself():
    model = Likelihood.of([driven()], big_nigel())
    context = Context(np.ones(len(model.t)), (candidate(LAG),))
    fitter = context.fitter(model)
    base = fitter.at(fitter.unfitted())
    begun = fitter.begin(base, [((candidate(LAG),), np.array([0.05]))])
    trials = varying_to_try(context.penalty, fitter, base, begun)
    assert all(isinstance(effects[-1], VaryingEffect) for effects, _ in trials)
    assert {effects[-1].like for effects, _ in trials} <= {LAG}


def test_what_to_do_is_the_effect_s_own_advice_and_says_the_variable():
    name = lag_against("throttle").name
    one = made_up.CASES["one_effect"]()[0].effects[0]
    effect = structs.replace(one, name=name, is_known=False, depends_on=("throttle",))
    advice = advice_of(effect)
    assert advice.startswith(identifications()[LAG].advice)
    assert "changes with throttle" in advice
