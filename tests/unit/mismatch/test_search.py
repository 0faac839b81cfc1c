"""What a search believes: how deep fits must go, numbers at their limits, and doubts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from scm.mismatch.fit.fitter import FARTHEST, Fitted, Fitter
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import CALM, calmed, usual_noise
from scm.mismatch.select.many_effects import SETTLES_FAR
from scm.mismatch.select.search import (
    DRIFTED,
    FALSE_ALARMS,
    PLENTY,
    REMAINDER,
    WRITTEN,
    Search,
    Step,
    exceeded,
    price,
)
from scm.mismatch.select.starts import next_starts
from tests.unit.mismatch.made_drive import big_nigel, driven
from tests.unit.mismatch.made_fit import candidate


@pytest.fixture(scope="module")
def model():
    return Likelihood([driven(seconds=8.0)], big_nigel())


def a_search(model, *names):
    library = [candidate(name) for name in names]
    return Search(model, np.ones(len(model.t)), library, lambda _: None)


@pytest.mark.parametrize("degrees", [1, 2, 4])
@pytest.mark.parametrize("chance", [0.05, 4e-4, 1e-4])
def test_chi_squared_exceeds_it_as_seldom_as_asked(degrees, chance):
    assert exceeded(degrees, chance) == pytest.approx(chi2.isf(chance, degrees), rel=0.08)


def test_chance_gives_the_best_of_a_library_its_price_one_time_in_fifty():
    one, library = candidate("steer_trim"), 40
    draws = np.random.default_rng(1).chisquare(1, (20_000, library)).max(axis=1)
    assert np.mean(draws > price((one,), library)) == pytest.approx(FALSE_ALARMS, rel=0.35)


def test_an_effect_of_some_place_pays_for_every_place_it_was_tried_at():
    near, far = (0.0, 0.0, 0.3, 0.6), (1.0, 0.0, 0.3, 0.6)
    one = replace(candidate("surface_patch"), starts=(near,))
    two = replace(one, starts=(near, far))
    assert price((two,), 10) == price((one,), 20) > price((one,), 10)
    assert price((one, one), 10) == 2.0 * price((one,), 10)


def test_an_effect_of_tyres_pays_for_how_simulators_write_them():
    assert price((candidate("tyre_relaxation"),), 10) == WRITTEN + price(
        (candidate("payload"),), 10
    )


@pytest.mark.parametrize(("short_by", "told"), [(3.0, True), (5.0, False)])
def test_of_a_number_at_its_limit_half_counts_where_the_rival_is_nothing(model, short_by, told):
    search = a_search(model, "steer_rate")
    base, effect = search.fitter.null(), candidate("steer_rate")
    found = replace(base, effects=(effect,), q=base.q - search.price((effect,)) + short_by)
    step = Step(base, (found,), (search.criterion(found) - DRIFTED,))
    assert (search._margin(step) > 0.0) == told


def test_calm_noise_is_no_larger_than_a_cars_usual_times_a_few(model):
    least = usual_noise(model.drives)
    loud = replace(least, speed=50.0 * least.speed, turn=least.turn)
    quiet = calmed(loud, model.drives)
    assert quiet.speed == pytest.approx(CALM * least.speed)
    assert quiet.turn == least.turn


def test_a_fit_ends_as_deep_wherever_it_begins(model):
    search = a_search(model)
    far = np.where(np.arange(len(model.nominal)) % 2 == 0, FARTHEST, -FARTHEST)
    stuck = replace(search.fitter.null(), z=far)
    alone = search._to_the_end(stuck, [far])
    several = search._to_the_end(stuck, [far, np.zeros_like(far)])
    best = search._to_the_end(search.fitter.null(), [np.zeros_like(far)])
    assert several.q == pytest.approx(best.q, abs=1.0)
    assert alone.q == pytest.approx(best.q, abs=1.0)


def test_hypotheses_fitted_together_end_where_each_alone_does(model):
    search = a_search(model)
    far = np.full(len(model.nominal), 1.5)
    every = [(search.fitter.null(), [far, -far]), (search.fitter.null(far), [far])]
    together = search._all_to_the_end(every)
    for fitted, (start, places) in zip(together, every, strict=True):
        assert fitted.q == search._to_the_end(start, places).q


def test_an_effect_does_not_earn_what_a_fit_without_it_missed(model):
    search = a_search(model, "steer_trim", "battery_sag")
    poor = search.fitter.null()
    (poor,) = search.fitter.refine([poor], rounds=1, fresh=True)
    poor.z = np.full_like(poor.z, 0.9)
    poor.e = search.fitter.null(poor.z).e
    poor.q = float(search.fitter.score(poor.e[:, None], poor.z)[0])
    step = search.extend(poor)
    assert step.base.q < poor.q
    assert step.criteria[0] > search.criterion(step.base)  # nothing is concealed in this drive


def test_a_search_ends_where_something_else_explains_all(model, monkeypatch):
    search, asked = a_search(model, "steer_trim", "battery_sag"), []
    search.explained = lambda fitted: not asked.append(fitted.names)
    monkeypatch.setattr(search, "_calmly", None)
    assert search.run().names == ()
    assert asked == [()]


def test_a_round_keeps_its_rivals_without_the_derivatives_that_fill_memory(model):
    search = a_search(model, "steer_trim", "battery_sag")
    (base,) = search.fitter.refine([search.fitter.null()], rounds=1, fresh=True)
    step = search.extend(base)
    assert [f.jacobian.size for f in step.rivals] == [0, 0]
    assert step.base.jacobian.size > 0  # every further effect is begun from these


def test_the_effect_of_a_number_at_its_limit_comes_closer_by_more(model):
    search = a_search(model, "steer_rate")
    keys = [own.key for own in model.nominal]
    z = np.zeros(len(keys))
    z[keys.index("steering.rate_rad_s")] = -FARTHEST
    base = replace(search.fitter.null(), z=z)
    found = Fitted((candidate("steer_rate"),), 0.0 * z, np.array([0.7]), base.e, 0.0, base.jacobian)
    assert search._drifted(found.effects[-1], base) == DRIFTED


@pytest.mark.parametrize(
    ("better_by", "still_at", "taken"),
    [(5.0, 0.3, DRIFTED), (-5.0, 0.3, 0.0), (5.0, -FARTHEST, 0.0)],
    ids=["it explains more and frees the number", "it explains less", "the number stays"],
)
def test_a_number_at_its_limit_speaks_for_no_effect_where_a_better_one_pulled_it(
    model, better_by, still_at, taken
):
    search = a_search(model, "steer_rate", "steer_lag")
    at = [own.key for own in model.nominal].index("steering.rate_rad_s")
    z, rest = np.zeros(len(model.nominal)), np.zeros(len(model.nominal))
    z[at], rest[at] = -FARTHEST, still_at
    base = replace(search.fitter.null(), z=z)
    mine = Fitted((candidate("steer_rate"),), 0.0 * z, np.array([0.7]), base.e, 0.0, base.jacobian)
    other = replace(mine, effects=(candidate("steer_lag"),), z=rest, q=-better_by)
    assert search._let_go(mine, [mine, other], base) == taken
    assert search._let_go(other, [mine, other], base) == 0.0


def test_a_far_cars_hypothesis_is_settled_from_where_the_first_time_left_it(model):
    search, beliefs = a_search(model, "steer_trim"), []
    learn = search._learn
    search._learn = lambda *given: beliefs.append(1) or learn(*given)
    search.settle(search.fitter.null())
    once, search.settles = len(beliefs), SETTLES_FAR
    search.settle(search.fitter.null())
    assert len(beliefs) - once == SETTLES_FAR * once


def losing(seen, unseen, where, shows):
    """A model whose effects each cost so much when left out, where it was fitted and where not.

    `where` says at which innovation each acts where it was fitted, `shows` how much more each
    changes unseen ones without being any better there.
    """
    n = len(seen)
    e = np.zeros(3 + n)
    e[2] = -0.5 * np.sqrt(max(shows))
    best = Fitted(tuple(candidate("steer_trim") for _ in range(n)), np.zeros(1), np.zeros(n), e,
                  0.0, np.zeros((3 + n, 1)))  # fmt: skip
    others = []
    for lost, hidden, at, more in zip(seen, unseen, where, shows, strict=True):
        value = np.sqrt(8.0 * np.expm1(abs(hidden) / 8.0))  # what the loss makes `hidden` of
        other = e.copy()
        other[1], other[3 + at] = value * (hidden > 0.0), np.sqrt(lost)
        e[1] = value * (hidden < 0.0)
        other[2] = -e[2] if more else e[2]
        others.append(replace(best, effects=best.effects[1:], e=other, q=lost))
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
        ((1500.0,), (PLENTY + 1.0,), (0,), (900.0,), True),
        ((1500.0, 0.5 * REMAINDER * 1500.0), (900.0, 500.0), (0, 0), (0.0, 0.0), False),
        ((1500.0, 0.5 * REMAINDER * 1500.0), (900.0, 500.0), (0, 1), (0.0, 0.0), True),
    ],
    ids=["its share", "less than its share", "hardly acts there",
         "worse there by chance", "worse there by more", "hardly acts anywhere", "plenty",
         "a remainder of another", "small elsewhere"],
)  # fmt: skip
def test_an_effect_stays_where_its_gain_holds_on_an_unseen_part(
    model, seen, unseen, where, shows, stays
):
    best, others = losing(seen, unseen, where, shows)
    part = np.zeros(len(best.e))
    part[1:3] = 1.0
    fake = SimpleNamespace(settled=np.ones(len(best.e)), prior=np.eye(len(best.z)))
    search = Search.__new__(Search)
    search.model, search.events, search.listed = fake, 8, best.effects
    search.fitter = Fitter(fake, 1.0 - part)
    nothing = replace(others[-1], effects=())
    search._without_each = lambda fitted: others if len(fitted.effects) == len(seen) else [nothing]
    assert (search.confirmed(best, part) is best) == stays


def test_an_effect_of_two_valleys_is_begun_in_both():
    begun = [
        Fitted((candidate("drive_deadband"),), np.zeros(1), np.array([value]), np.zeros(1), q,
               np.zeros((1, 1)))
        for value, q in ((0.015, 10.0), (0.02, 11.0), (0.06, 13.0), (0.1, 12.0), (0.2, np.inf))
    ]  # fmt: skip
    effect = begun[0].effects[0]
    begun = [replace(f, effects=(effect,)) for f in begun]
    assert [f.values[0] for f in next_starts(begun[0], begun)] == [0.1]
