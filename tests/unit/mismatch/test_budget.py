"""A budget ends a diagnosis in time: unfinished work counts for nothing."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scm.clock import StepClock, nanoseconds
from scm.mismatch.budget import DEFAULT_S, MAX_RESERVED, WORDS, Budget, Question
from scm.mismatch.discovery import decide
from scm.mismatch.discovery.decide import Compared, Discovery
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.likelihood import Likelihood, Simulator
from scm.mismatch.pipeline import diagnose_car
from scm.mismatch.report.panels import panels_of
from scm.mismatch.select import search, selected
from scm.mismatch.select.round import Context
from scm.mismatch.select.search import Selection, retune, select
from scm.records.mismatch import BUDGET_S
from tests.unit.mismatch.discovery import made_effect
from tests.unit.mismatch.made_drive import big_nigel, driven, made_drive, nigel
from tests.unit.mismatch.made_fit import candidate


class Batches(Budget):
    """Is over after so many more batches of sets than were driven before `left` was set."""

    left = math.inf

    def is_over(self):
        return self.left <= 0

    def check(self):
        self.left -= 1
        super().check()


def late(limit_s, at_s):
    """A budget at some time of it."""
    clock = StepClock()
    budget = Budget(limit_s, clock)
    clock.set_ns(nanoseconds(at_s))
    return budget


def names(unanswered):
    return [question.name for question in unanswered]


def test_every_question_has_words():
    assert set(WORDS) == set(Question)


def test_the_server_allows_a_search_as_much_as_the_command_does():
    assert BUDGET_S == DEFAULT_S


@pytest.mark.parametrize(("at_s", "found"), [(59.0, "law"), (60.0, None)])
def test_an_attempt_goes_on_until_time_is_up(at_s, found):
    budget = late(60.0, at_s)
    assert budget.attempt(Question.DISCOVERY, lambda: budget.check() or "law") == found
    assert names(budget.unanswered) == ([] if found else ["laws"])


def test_what_is_no_attempt_is_done_however_late():
    late(60.0, 100.0).check()


def test_an_attempt_within_another_is_given_up_alone():
    budget = late(60.0, 60.0)
    inner = lambda: budget.attempt(Question.BESIDE, budget.check)  # noqa: E731
    assert budget.attempt(Question.DISCOVERY, lambda: inner() or "law") == "law"
    assert names(budget.unanswered) == ["beside_law"]
    assert budget.attempt(Question.DISCOVERY, lambda: [inner(), budget.check()]) is None
    assert names(budget.unanswered) == ["beside_law", "laws"]


def test_time_is_kept_for_what_follows_but_never_more_than_half():
    budget = late(60.0, 45.0)
    assert not budget.is_over()
    budget.reserve(20.0)
    assert budget.is_over()
    early = late(60.0, 60.0 * MAX_RESERVED - 1.0)
    early.reserve(1e3)
    assert not early.is_over()


def test_a_question_is_told_once_and_whether_it_was_begun():
    clock = StepClock()
    budget = Budget(60.0, clock)
    budget.attempt(Question.DISCOVERY, lambda: [clock.set_ns(nanoseconds(61.0)), budget.check()])
    budget.attempt(Question.DISCOVERY, budget.check)
    budget.attempt(Question.LOW_NOISE, budget.check)
    assert [question.text for question in budget.unanswered] == [
        "Effects outside the catalogue were not searched for to the end: the budget of 60 s ended.",
        "Effects that the assumed noise may hide were not searched for: the budget of 60 s ended.",
    ]


@pytest.mark.parametrize(("got_s", "share"), [(3.0, 0.3), (18.0, 1.8)])
def test_a_budget_knows_how_much_of_a_processor_it_got(got_s, share):
    had = iter((100.0, 100.0 + got_s))
    clock = StepClock()
    budget = Budget(60.0, clock, lambda: next(had))
    clock.set_ns(nanoseconds(10.0))
    assert budget.processor_share() == pytest.approx(share)


class Spent(Budget):
    """No time is left, but nothing is given up."""

    spent = True

    def is_spent(self):
        return self.spent


def test_a_fit_ends_with_its_round_when_no_time_is_left():
    drive, budget = driven((("steering.trim_rad", 0.05),), seconds=6.0), Spent()
    model = Likelihood.of([drive], big_nigel(), budget=budget)
    fitter = Fitter(model, np.ones(len(model.t)))
    runs = list[int]()
    for budget.spent in (True, False):
        before = model.simulator.runs
        (fitted,) = fitter.refine([fitter.unfitted()], fresh=True)
        runs.append(model.simulator.runs - before)
        assert np.isfinite(fitted.score)
        assert len(fitted.covariance) == len(fitted.z)
    assert runs[0] < runs[1]


@pytest.fixture(scope="module")
def trimmed():
    """A drive whose steering is off, and what a selection finds in it that has all the time."""
    drive = driven((("steering.trim_rad", 0.05),), seconds=6.0)
    context, retuned = a_context(drive)
    context.budget.left = 10_000
    found = select(context, retuned, nothing_else)
    assert found.best.names == ("steer_trim",)
    return drive, retuned, found.best, 10_000 - context.budget.left


def nothing_else(_):
    return False, None


def a_context(drive):
    """What a selection works with, and the re-tuned car."""
    budget, catalogue = Batches(60.0), (candidate("steer_trim"), candidate("battery_sag"))
    model = Likelihood.of([drive], big_nigel(), budget=budget)
    context = Context(np.ones(len(model.t)), catalogue, budget=budget)
    return context, retune(context, model)


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_selection_cut_anywhere_ends_with_what_was_whole_before(trimmed, share):
    drive, before, after, batches = trimmed
    context, retuned = a_context(drive)
    assert retuned.score == before.score
    context.budget.left = int(share * batches)
    found = select(context, retuned, nothing_else)
    best, whole = found.best, after if found.best.effects else before
    assert best.noise == whole.noise
    assert best.names == whole.names
    assert (best.score, best.z.tolist(), best.values.tolist()) == (
        whole.score, whole.z.tolist(), whole.values.tolist()
    )  # fmt: skip
    assert len(found.rounds) == len(best.effects)
    assert names(context.budget.unanswered) == (
        ["further_effects"] if best.effects else ["effects"]
    )


@pytest.fixture
def discovered(monkeypatch):
    """A selection without an effect yet, and a discovered one that is better than any it finds."""
    context, model, unseen = made_effect.context_of(made_effect.lawful_drive(seconds=6.0))
    budget = Batches(60.0)
    model = Likelihood(Simulator(model.drives, model.car, model.simulator.tiles, budget))
    context = replace(context, budget=budget)
    fitter = context.fitter(model)
    (known,) = fitter.refine([fitter.unfitted()], rounds=1, fresh=True)
    gust = replace(known, effects=(made_effect.gust(),))
    discovery = Discovery(known, Compared(gust, -math.inf, -math.inf), None)
    monkeypatch.setattr(decide, "discover", lambda *_: discovery)
    return context, Selection(known, known), unseen, discovery


def test_a_known_hypothesis_stays_where_nothing_discovered_could_be_compared_with_it(discovered):
    context, found, unseen, _ = discovered
    context.budget.left = 3  # time runs out while the known hypothesis is settled
    assert decide.decide(context, found, unseen) == (found.best, None)
    assert names(context.budget.unanswered) == ["laws"]


def test_a_discovery_stays_where_there_was_no_time_for_effects_beside_it(discovered, monkeypatch):
    context, found, unseen, discovery = discovered
    monkeypatch.setattr(decide, "fit_with_noise", lambda _, fitted: fitted)

    def extend(_, base):
        context.budget.left = 0
        base.model([{}])

    monkeypatch.setattr(decide, "extend", extend)
    best, why = decide.decide(context, found, unseen)
    assert best.effects == (made_effect.gust(),)
    assert why is discovery
    assert names(context.budget.unanswered) == ["beside_law"]


def test_a_round_of_several_effects_that_is_cut_leaves_no_trace(monkeypatch):
    budget = Batches(60.0)
    model = Likelihood.of([driven(seconds=6.0)], big_nigel(), budget=budget)
    context = Context(np.ones(len(model.t)), (candidate("steer_trim"),), budget=budget)
    retuned = context.fitter(model).unfitted()

    def cut(_, base):
        budget.left = 0
        base.model([{}])

    monkeypatch.setattr(search, "extend", cut)
    found = search.select_many(context, retuned)
    assert found == Selection(retuned, retuned)
    assert names(budget.unanswered) == ["effects"]


@pytest.fixture(scope="module")
def no_time():
    return diagnose_car([made_drive(seconds=8.0)], nigel(), budget=Budget(0.0, StepClock()))


def test_a_diagnosis_without_time_is_fitted_and_judged_and_says_what_it_left(no_time):
    found = no_time.diagnosis
    assert found.fit is not None
    assert no_time.evidence.tried == ()
    assert found.effects == ()
    assert names(found.unanswered) == ["effects", "laws"]
    (card,) = (c for c in panels_of(found, no_time.evidence) if c.title == "Time ran out")
    assert (
        "Effects outside the catalogue were not searched for: the budget of 0 s ended."
        in card.rows[0][1]
    )


def far_and_straying(monkeypatch):
    monkeypatch.setattr(selected, "is_far", lambda _: True)
    monkeypatch.setattr(selected, "strays", lambda _: True)


def test_a_car_that_differs_in_many_ways_keeps_its_first_fit_where_windows_come_too_late(
    monkeypatch, no_time
):
    far_and_straying(monkeypatch)
    found = diagnose_car([made_drive(seconds=8.0)], nigel(), budget=Budget(0.0, StepClock()))
    assert names(found.diagnosis.unanswered) == ["effects", "strides"]
    assert not found.selected.context.by_windows
    assert found.best.z.tolist() == no_time.best.z.tolist()


def test_where_windows_come_too_late_only_they_are_named_as_left(monkeypatch):
    clock = StepClock()

    def too_late(context, *_):
        clock.set_ns(nanoseconds(61.0))
        context.budget.check()

    monkeypatch.setattr(selected, "select", lambda _, retuned, *__: Selection(retuned, retuned))
    monkeypatch.setattr(selected, "by_windows", too_late)
    far_and_straying(monkeypatch)
    found = diagnose_car([made_drive(seconds=8.0)], nigel(), budget=Budget(60.0, clock))
    assert names(found.diagnosis.unanswered) == ["strides"]


def test_as_long_as_the_first_fit_took_is_reserved_for_what_follows_a_selection(monkeypatch):
    clock, seen, really_retune = StepClock(), [], selected.retune

    def retuned(*given):
        clock.set_ns(nanoseconds(20.0))
        return really_retune(*given)

    def chosen(context, retuned, *_):
        for at_s in (39.0, 41.0):
            clock.set_ns(nanoseconds(at_s))
            seen.append(context.budget.is_over())
        return Selection(retuned, retuned)

    monkeypatch.setattr(selected, "retune", retuned)
    monkeypatch.setattr(selected, "select", chosen)
    far_and_straying(monkeypatch)
    monkeypatch.setattr(selected, "by_windows", lambda context, *_: context.budget.check())
    diagnose_car([made_drive(seconds=8.0)], nigel(), budget=Budget(60.0, clock))
    assert seen == [False, True]
