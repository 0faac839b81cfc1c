"""What a selection accepts: how deep fits must go, and numbers at their limits."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from scm.mismatch.fit.fitter import FARTHEST
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import MAX_LOW_NOISE, fit_noise, lowered, usual_noise
from scm.mismatch.select import confirm
from scm.mismatch.select import round as rounds
from scm.mismatch.select.confirm import ENOUGH_UNSEEN, REMAINDER, confirmed
from scm.mismatch.select.round import (
    AT_LIMIT,
    FALSE_ALARMS,
    TYRE_MODELS,
    Context,
    Round,
    exceeded,
    extend,
    fit_all_to_the_end,
    fit_to_the_end,
    fit_with_noise,
    next_starts,
    penalty,
)
from scm.mismatch.select.search import TIMES_FITTED_FAR, margin_of, select
from tests.unit.mismatch.made_drive import big_nigel, driven
from tests.unit.mismatch.made_fit import candidate


@pytest.fixture(scope="module")
def model():
    return Likelihood.of([driven(seconds=6.0)], big_nigel())


def context_of(model, *names, **more):
    return Context(np.ones(len(model.t)), tuple(map(candidate, names)), **more)


@pytest.mark.parametrize("degrees", [1, 2, 4])
@pytest.mark.parametrize("chance", [0.05, 4e-4, 1e-4])
def test_chi_squared_exceeds_it_as_seldom_as_required(degrees, chance):
    assert exceeded(degrees, chance) == pytest.approx(chi2.isf(chance, degrees), rel=0.08)


def test_chance_gives_the_best_of_a_catalogue_its_penalty_one_time_in_fifty():
    one, catalogue = candidate("steer_trim"), 40
    draws = np.random.default_rng(1).chisquare(1, (20_000, catalogue)).max(axis=1)
    assert np.mean(draws > penalty((one,), catalogue)) == pytest.approx(FALSE_ALARMS, rel=0.35)


def test_an_effect_of_some_place_pays_for_every_place_it_was_tried_at():
    near, far = (0.0, 0.0, 0.3, 0.6), (1.0, 0.0, 0.3, 0.6)
    one = replace(candidate("surface_patch"), starts=(near,))
    two = replace(one, starts=(near, far))
    assert penalty((two,), 10) == penalty((one,), 20) > penalty((one,), 10)
    assert penalty((one, one), 10) == 2.0 * penalty((one,), 10)


def test_an_effect_of_tyres_pays_for_how_simulators_model_them():
    tyres, payload = candidate("tyre_relaxation"), candidate("payload")
    assert penalty((tyres,), 10) == TYRE_MODELS + penalty((payload,), 10)


@pytest.mark.parametrize(("short_by", "accepted"), [(3.0, True), (5.0, False)])
def test_of_a_number_at_its_limit_half_counts_where_the_alternative_is_nothing(
    model, short_by, accepted
):
    context, effect = context_of(model, "steer_rate"), candidate("steer_rate")
    base = context.fitter(model).unfitted()
    score = base.score - context.penalty((effect,)) + short_by
    found = replace(base, effects=(effect,), score=score)
    tried = Round(base, (found,), (context.criterion(found) - AT_LIMIT,))
    assert (margin_of(context, tried) > 0.0) == accepted


def test_low_noise_is_no_larger_than_a_cars_usual_times_a_few(model):
    least = usual_noise(model.drives)
    loud = replace(least, speed=50.0 * least.speed, turn=least.turn)
    quiet = lowered(loud, model.drives)
    assert quiet.speed == pytest.approx(MAX_LOW_NOISE * least.speed)
    assert quiet.turn == least.turn


def test_a_fit_ends_as_deep_wherever_it_begins(model):
    context = context_of(model)
    far = np.where(np.arange(len(model.nominal)) % 2 == 0, FARTHEST, -FARTHEST)
    begun = context.fitter(model).unfitted()
    stuck = replace(begun, z=far)
    alone = fit_to_the_end(context, stuck, [far])
    several = fit_to_the_end(context, stuck, [far, np.zeros_like(far)])
    best = fit_to_the_end(context, begun, [np.zeros_like(far)])
    assert several.score == pytest.approx(best.score, abs=1.0)
    assert alone.score == pytest.approx(best.score, abs=5.0)  # no effect gains so little


def test_hypotheses_fitted_together_end_where_each_alone_does(model):
    context, fitter = context_of(model), context_of(model).fitter(model)
    far = np.full(len(model.nominal), 1.5)
    every = [(fitter.unfitted(), [far, -far]), (fitter.unfitted(far), [far])]
    together = fit_all_to_the_end(context, every)
    for fitted, (start, places) in zip(together, every, strict=True):
        assert fitted.score == fit_to_the_end(context, start, places).score


def test_a_fit_leaves_the_hypothesis_that_it_began_from_as_it_was(model):
    begun = context_of(model).fitter(model).unfitted()
    z, score = begun.z.copy(), begun.score
    fit_with_noise(context_of(model), begun)
    assert (begun.z.tolist(), begun.score, begun.model) == (z.tolist(), score, model)


def test_an_effect_does_not_earn_what_a_fit_without_it_missed(model):
    context = context_of(model, "steer_trim", "battery_sag")
    fitter = context.fitter(model)
    (poor,) = fitter.refine([fitter.unfitted()], rounds=1, fresh=True)
    worse = fitter.unfitted(np.full_like(poor.z, 0.9))
    poor = replace(worse, jacobian=poor.jacobian)
    tried = extend(context, poor)
    assert tried.base.score < poor.score
    assert tried.criteria[0] > context.criterion(tried.base)  # nothing is concealed in this drive


def test_a_selection_ends_where_something_else_explains_all(model):
    context, seen = context_of(model, "steer_trim", "battery_sag"), []
    retuned = fit_with_noise(context, context.fitter(model).unfitted())
    explain = lambda found: seen.append(found.best.names) or (True, None)  # noqa: E731
    found = select(context, retuned, explain)
    assert found.best.names == ()
    assert len(found.rounds) == 1
    assert seen == [()]


def test_a_round_keeps_its_alternatives_without_the_derivatives_that_fill_memory(model):
    context = context_of(model, "steer_trim", "battery_sag")
    fitter = context.fitter(model)
    (base,) = fitter.refine([fitter.unfitted()], rounds=1, fresh=True)
    tried = extend(context, base)
    assert [f.jacobian.size for f in tried.alternatives] == [0, 0]
    assert tried.base.jacobian.size > 0  # every further effect is begun from these


def at_limits(model, still_at, score):
    """A base with the servo's rate at its limit, and two effects beside it."""
    at = [own.key for own in model.nominal].index("steering.rate_rad_s")
    z, rest = np.zeros(len(model.nominal)), np.zeros(len(model.nominal))
    z[at], rest[at] = -FARTHEST, still_at
    base = replace(Context(np.ones(len(model.t)), ()).fitter(model).unfitted(), z=z)
    mine = replace(base, effects=(candidate("steer_rate"),), z=0.0 * z, values=np.array([0.7]),
                   score=0.0)  # fmt: skip
    other = replace(mine, effects=(candidate("steer_lag"),), z=rest, score=score)
    return base, mine, other


def test_the_effect_of_a_number_at_its_limit_is_noticed(model):
    base, mine, other = at_limits(model, 0.0, 0.0)
    assert rounds.at_limit(mine.effects[-1], base)
    assert not rounds.at_limit(other.effects[-1], base)


@pytest.mark.parametrize(
    ("better_by", "still_at", "lost"),
    [(5.0, 0.3, AT_LIMIT), (-5.0, 0.3, 0.0), (5.0, -FARTHEST, 0.0)],
    ids=["it explains more and frees the number", "it explains less", "the number stays"],
)
def test_a_number_at_its_limit_speaks_for_no_effect_where_a_better_one_pulled_it(
    model, better_by, still_at, lost
):
    context = context_of(model, "steer_rate", "steer_lag")
    base, mine, other = at_limits(model, still_at, -better_by)
    assert rounds.let_go(context, mine, [mine, other], base) == lost
    assert rounds.let_go(context, other, [mine, other], base) == 0.0


def test_a_far_cars_hypothesis_is_settled_from_where_the_first_time_left_it(model):
    fitted = []
    learn = lambda *given: fitted.append(1) or fit_noise(*given)  # noqa: E731
    context = context_of(model, "steer_trim", fit_noise=learn)
    fit_with_noise(context, context.fitter(model).unfitted())
    once = len(fitted)
    far = replace(context, times_fitted=TIMES_FITTED_FAR)
    fit_with_noise(far, far.fitter(model).unfitted())
    assert len(fitted) - once == TIMES_FITTED_FAR * once


def losing(seen, unseen, where, shows):
    """A model whose effects each cost so much when left out, where it was fitted and where not.

    `where` says at which innovation each acts where it was fitted, `shows` how much more each
    changes unseen ones without being any better there.
    """
    n = len(seen)
    e = np.zeros(3 + n)
    e[2] = -0.5 * np.sqrt(max(shows))
    simulator = SimpleNamespace(prior=np.eye(1))
    fake = SimpleNamespace(valid=np.ones(3 + n), simulator=simulator)
    effects = tuple(candidate("steer_trim") for _ in range(n))
    best = Hypothesis(fake, effects, np.zeros(1), np.zeros(n), e, 0.0, np.zeros((3 + n, 1)))
    others = []
    for lost, hidden, at, more in zip(seen, unseen, where, shows, strict=True):
        value = np.sqrt(8.0 * np.expm1(abs(hidden) / 8.0))  # what the loss makes `hidden` of
        other = e.copy()
        other[1], other[3 + at] = value * (hidden > 0.0), np.sqrt(lost)
        e[1] = value * (hidden < 0.0)
        other[2] = -e[2] if more else e[2]
        others.append(replace(best, effects=best.effects[1:], innovations=other, score=lost))
    return best, others


@pytest.mark.parametrize(
    ("seen", "unseen", "where", "shows", "stays"),
    [
        ((100.0,), (20.0,), (0,), (0.0,), True),
        ((100.0,), (1.0,), (0,), (100.0,), False),
        ((100.0,), (1.0,), (0,), (0.0,), True),
        ((100.0,), (-1.9,), (0,), (0.7,), True),
        ((100.0,), (-4.0,), (0,), (0.7,), False),
        ((4.0,), (0.2,), (0,), (0.0,), False),
        ((1500.0,), (ENOUGH_UNSEEN + 1.0,), (0,), (900.0,), True),
        ((1500.0, 0.5 * REMAINDER * 1500.0), (900.0, 500.0), (0, 0), (0.0, 0.0), False),
        ((1500.0, 0.5 * REMAINDER * 1500.0), (900.0, 500.0), (0, 1), (0.0, 0.0), True),
    ],
    ids=["its share", "less than its share", "hardly acts there",
         "worse there by chance", "worse there by more", "hardly acts anywhere", "enough anyhow",
         "a remainder of another", "small elsewhere"],
)  # fmt: skip
def test_an_effect_stays_where_its_gain_holds_on_an_unseen_part(
    monkeypatch, seen, unseen, where, shows, stays
):
    best, others = losing(seen, unseen, where, shows)
    part = np.zeros(len(best.innovations))
    part[1:3] = 1.0
    nothing = replace(others[-1], effects=())
    fewer = lambda _, fitted, __: others if len(fitted.effects) == len(seen) else [nothing]  # noqa: E731
    monkeypatch.setattr(confirm, "without_each", fewer)
    context = Context(1.0 - part, best.effects)
    monkeypatch.setattr(Context, "events", 8)
    found, denied = confirmed(context, best, nothing, part)
    assert (found is best) == stays
    assert (denied == ()) == stays


def test_an_effect_of_two_valleys_is_begun_in_both():
    begun = [
        Hypothesis(None, (candidate("drive_deadband"),), np.zeros(1), np.array([value]),
                   np.zeros(1), q, np.zeros((1, 1)))
        for value, q in ((0.015, 10.0), (0.02, 11.0), (0.06, 13.0), (0.1, 12.0), (0.2, np.inf))
    ]  # fmt: skip
    effect = begun[0].effects[0]
    begun = [replace(f, effects=(effect,)) for f in begun]
    assert [f.values[0] for f in next_starts(begun[0], begun)] == [0.1]
