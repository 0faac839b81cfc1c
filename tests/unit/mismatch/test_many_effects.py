"""Several effects a round: a rare one gives way to usual ones that explain more together."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.budget import OutOfTimeError
from scm.mismatch.fit.fitter import Race
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.select import search
from scm.mismatch.select.round import Context, Round
from scm.mismatch.select.search import Selection, select_many, without_rare
from tests.unit.mismatch.made_fit import candidate

NONE = np.zeros(0)
SLOPE, USUAL = ("grade",), ("steer_trim", "pose_heading")


def hypothesis(*names):
    effects = tuple(candidate(name) for name in names)
    count = sum(len(e.parameters) for e in effects)
    return Hypothesis(None, effects, NONE, np.zeros(count), NONE, 0.0, NONE)


@pytest.fixture
def scripted(monkeypatch):
    """A round finds a slope, or where slopes are not listed two usual effects, at given costs."""
    costs = {SLOPE: 0.0}

    def extended(context, base):
        found = [e.name for e in context.catalogue if e.name not in base.names]
        return Round(base, tuple(hypothesis(*base.names, name) for name in found), (0.0,))

    def at_once(_, tried):
        every = tried.alternatives
        usual = every[:1] if every and every[0].effects[-1].rare else every
        return [Round(tried.base, (one,), (0.0,)) for one in usual if not tried.base.effects]

    def fewer(_, fitted, __):
        return [hypothesis(*(n for n in fitted.names if n != gone)) for gone in fitted.names]

    joined = lambda base, found: hypothesis(*base.names, *(f.names[-1] for f in found))  # noqa: E731
    for name, fake in (
        ("extend", extended), ("_compared", lambda _, tried: tried), ("_joined", joined),
        ("_beside_each_other", at_once), ("fit_with_noise", lambda _, fitted: fitted),
        ("prune", lambda _, fitted, __: fitted), ("without_each", fewer),
    ):  # fmt: skip
        monkeypatch.setattr(search, name, fake)
    monkeypatch.setattr(Context, "cost", lambda _, fitted: costs[fitted.names])
    catalogue = tuple(candidate(name) for name in (*SLOPE, *USUAL))
    return Context(np.ones(1), catalogue), costs


@pytest.mark.parametrize(("cost", "names"), [(-1.0, USUAL), (1.0, SLOPE)])
def test_a_rare_effect_gives_way_to_usual_ones_that_explain_more(scripted, cost, names):
    context, costs = scripted
    costs[USUAL] = cost
    found = select_many(context, hypothesis())
    assert found.best.names == names
    assert {one.alternatives[0].names[-1] for one in found.rounds} >= set(names)


@pytest.mark.parametrize("late", ["prune", "without_rare"])
def test_effects_that_were_fitted_stay_where_time_ends_later_in_their_round(
    scripted, monkeypatch, late
):
    context, _ = scripted

    def out_of_time(*_):
        raise OutOfTimeError

    monkeypatch.setattr(search, late, out_of_time)
    assert select_many(context, hypothesis()).best.names == SLOPE
    assert [one.name for one in context.budget.unanswered] == ["further_effects"]


def test_a_rare_effect_that_is_gone_is_not_replaced(scripted):
    context, costs = scripted
    costs[USUAL] = -1.0
    found = Selection(hypothesis(*USUAL), hypothesis())
    assert without_rare(context, found, candidate("grade")) is found
    assert replace(found).best.names == USUAL


@pytest.mark.parametrize(
    ("costs", "lowered", "left"),
    [((0.0, 39.0), 0.5, [0, 1]), ((0.0, 41.0), 0.1, [0]), ((0.0, 60.0), 6.0, [0, 1]),
     ((30.0, 60.0), 0.1, [0])],
    ids=["near the best", "far behind", "far behind and catching up", "all far behind another"],
)  # fmt: skip
def test_a_race_goes_on_with_fits_that_are_near_or_catch_up(costs, lowered, left):
    fits = [replace(hypothesis("steer_trim"), score=cost) for cost in costs]
    race = Race(lambda fitted: fitted.score, best=-5.0 if costs[0] else 0.0)
    assert race.still_in(fits, dict.fromkeys(range(2), lowered)) == left
