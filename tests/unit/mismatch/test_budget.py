"""A budget ends a search in time: what was begun is undone, and what was not asked is told."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scm.clock import StepClock, nanoseconds
from scm.mismatch import diagnose
from scm.mismatch.budget import DEFAULT_S, MOST_KEPT, WORDS, Budget, Question
from scm.mismatch.diagnose import diagnose_car
from scm.mismatch.discovery.decide import Lawful, _Best, _Settled
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.report.panels import panels_of
from scm.mismatch.select.many_effects import ManyEffectsSearch
from scm.mismatch.select.search import Search
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


def late(asked_s, at_s):
    """A budget at some time of it."""
    clock = StepClock()
    budget = Budget(asked_s, clock)
    clock.set_ns(nanoseconds(at_s))
    return budget


def names(unasked):
    return [question.name for question in unasked]


def test_every_question_has_words():
    assert set(WORDS) == set(Question)


def test_the_server_allows_a_search_as_much_as_the_command_does():
    assert BUDGET_S == DEFAULT_S


@pytest.mark.parametrize(("at_s", "found"), [(59.0, "law"), (60.0, None)])
def test_an_attempt_goes_on_until_time_is_up(at_s, found):
    budget = late(60.0, at_s)
    assert budget.attempt(Question.LAWS, lambda: budget.check() or "law") == found
    assert names(budget.unasked) == ([] if found else ["laws"])


def test_what_is_no_attempt_is_done_however_late():
    late(60.0, 100.0).check()


def test_an_attempt_within_another_is_given_up_alone():
    budget = late(60.0, 60.0)
    inner = lambda: budget.attempt(Question.BESIDE, budget.check)  # noqa: E731
    assert budget.attempt(Question.LAWS, lambda: inner() or "law") == "law"
    assert names(budget.unasked) == ["beside_law"]
    assert budget.attempt(Question.LAWS, lambda: [inner(), budget.check()]) is None
    assert names(budget.unasked) == ["beside_law", "laws"]


def test_time_is_kept_for_what_follows_but_never_more_than_half():
    budget = late(60.0, 45.0)
    assert not budget.is_over()
    budget.keep(20.0)
    assert budget.is_over()
    early = late(60.0, 60.0 * MOST_KEPT - 1.0)
    early.keep(1e3)
    assert not early.is_over()


def test_a_question_is_told_once_and_whether_it_was_begun():
    clock = StepClock()
    budget = Budget(60.0, clock)
    budget.attempt(Question.LAWS, lambda: [clock.set_ns(nanoseconds(61.0)), budget.check()])
    budget.attempt(Question.LAWS, budget.check)
    budget.attempt(Question.CALM, budget.check)
    assert [question.text for question in budget.unasked] == [
        "Laws outside the library were not sought to the end: the budget of 60 s ended.",
        "Effects that the noise believed in may hide were not sought: the budget of 60 s ended.",
    ]


@pytest.mark.parametrize(("got_s", "share"), [(3.0, 0.3), (18.0, 1.8)])
def test_a_budget_knows_how_much_of_a_processor_it_got(got_s, share):
    had = iter((100.0, 100.0 + got_s))
    clock = StepClock()
    budget = Budget(60.0, clock, lambda: next(had))
    clock.set_ns(nanoseconds(10.0))
    assert budget.processor_share() == pytest.approx(share)


def test_a_fit_ends_with_its_round_when_no_time_is_left():
    model = Likelihood([driven((("steering.trim_rad", 0.05),), seconds=6.0)], big_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    runs = list[int]()
    for late in (True, False):
        model.is_late = lambda late=late: late
        before = model.runs
        (fitted,) = fitter.refine([fitter.null()], fresh=True)
        runs.append(model.runs - before)
        assert np.isfinite(fitted.q)
        assert len(fitted.covariance) == len(fitted.z)
    assert runs[0] < runs[1]


@pytest.fixture(scope="module")
def trimmed():
    """A drive whose steering is off, and what a search finds in it that has all the time."""
    drive = driven((("steering.trim_rad", 0.05),), seconds=6.0)
    search, budget = a_search(drive)
    before = replace(search.retuned), search.model.noise
    budget.left = 10_000
    best = search.run()
    assert best.names == ("steer_trim",)
    return drive, before, (replace(best), search.model.noise), 10_000 - budget.left


def a_search(drive):
    budget, library = Batches(60.0), [candidate("steer_trim"), candidate("battery_sag")]
    model = Likelihood([drive], big_nigel())
    return Search(model, np.ones(len(model.t)), library, lambda _: None, budget=budget), budget


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_search_cut_anywhere_ends_with_what_was_whole_before(trimmed, share):
    drive, before, after, batches = trimmed
    search, budget = a_search(drive)
    assert search.retuned.q == before[0].q
    budget.left = int(share * batches)
    best = search.run()
    whole, noise = after if best.effects else before
    assert search.model.noise == noise
    assert best.names == whole.names
    assert (best.q, best.z.tolist(), best.values.tolist()) == (
        whole.q, whole.z.tolist(), whole.values.tolist()
    )  # fmt: skip
    assert len(search.steps) == len(best.effects)
    assert names(budget.unasked) == (["further_effects"] if best.effects else ["effects"])


def test_what_an_attempt_changed_is_put_back_where_it_is_given_up():
    search, budget = a_search(driven(seconds=6.0))
    fitted, noise = search.fitter.null(), search.model.noise
    kept = replace(fitted)

    def half_done():
        search.model.believe(replace(noise, speed=2.0 * noise.speed))
        search.steps.append("half a round")
        fitted.z, fitted.q = fitted.z + 1.0, 0.0
        budget.left = 0
        search.model([{}])

    assert search.within(Question.LAWS, half_done, fitted) is None
    assert search.model.noise == noise
    assert search.steps == []
    assert fitted.q == kept.q
    assert fitted.z is kept.z


@pytest.fixture
def lawful(monkeypatch):
    """A search without a fit yet, and a law that is better than whatever it finds."""
    search, unseen = made_effect.searched(made_effect.lawful_drive(seconds=6.0))
    search.budget = budget = Batches(60.0)
    search.model.asked = budget.check
    (listed,) = search.fitter.refine([search.fitter.null()], rounds=1, fresh=True)
    fitted = replace(listed, effects=(made_effect.gust(),))
    law = _Settled(fitted, search.model.noise, -math.inf, -math.inf)
    laws = Lawful(search, unseen)
    monkeypatch.setattr(laws, "_best", lambda _: _Best((), law, "what was sought"))
    return search, budget, laws, listed


def test_a_listed_model_stays_as_it_is_where_no_law_could_be_held_against_it(lawful):
    search, budget, laws, listed = lawful
    kept, noise = replace(listed), search.model.noise
    budget.left = 3  # time runs out in the midst of settling the listed model
    assert laws.decide(listed) == (listed, None)
    assert names(budget.unasked) == ["laws"]
    assert search.model.noise == noise
    assert (listed.q, listed.z.tolist()) == (kept.q, kept.z.tolist())
    assert listed.jacobian is kept.jacobian


def test_a_law_stays_found_where_there_was_no_time_for_effects_beside_it(lawful, monkeypatch):
    search, budget, laws, listed = lawful
    monkeypatch.setattr(search, "settle", lambda fitted: fitted)

    def extend(_):
        budget.left = 0
        search.model([{}])

    monkeypatch.setattr(search, "extend", extend)
    found, sought = laws.decide(listed)
    assert found.effects == (made_effect.gust(),)
    assert sought == "what was sought"
    assert names(budget.unasked) == ["beside_law"]


def test_a_round_of_strides_that_is_cut_leaves_no_trace(monkeypatch):
    model, budget = Likelihood([driven(seconds=12.0)], big_nigel()), Batches(60.0)
    rare = replace(candidate("grade"), rare=5.0)
    listed = (rare, candidate("steer_trim"))
    search = ManyEffectsSearch(model, np.ones(len(model.t)), listed, lambda _: None, budget)
    search.retuned = search.fitter.null()
    search.steps = []
    fitted = replace(search.retuned, effects=(rare,))

    def usual_only(_):
        assert search.listed == listed[1:]
        budget.left = 0
        search.steps.append("half a round")
        model([{}])

    monkeypatch.setattr(search, "_without_each", lambda _: [search.retuned])
    monkeypatch.setattr(search, "_with_noise", lambda _: 0.0)
    monkeypatch.setattr(search, "extend", usual_only)
    monkeypatch.setattr(search, "_more", lambda _: search._usually(fitted, ()))
    assert search.run().names == ()
    assert search.listed == listed
    assert search.steps == []
    assert names(budget.unasked) == ["effects"]


@pytest.fixture(scope="module")
def no_time():
    return diagnose_car([made_drive(seconds=12.0)], nigel(), budget_s=0.0, clock=StepClock())


def test_a_diagnosis_without_time_is_fitted_and_judged_and_says_what_it_left(no_time):
    found = no_time.diagnosis
    assert found.fit is not None
    assert no_time.evidence.tried == ()
    assert found.effects == ()
    assert names(found.unasked) == ["effects", "laws"]
    (card,) = (c for c in panels_of(found, no_time.evidence) if c.title == "Time ran out")
    assert "Laws outside the library were not sought: the budget of 0 s ended." in card.rows[0][1]


def test_a_car_that_differs_in_many_ways_keeps_its_first_fit_where_strides_come_too_late(
    monkeypatch, no_time
):
    monkeypatch.setattr(diagnose, "is_far", lambda search: bool(search.retuned))
    monkeypatch.setattr(diagnose, "strays", lambda _: True)
    found = diagnose_car([made_drive(seconds=12.0)], nigel(), budget_s=0.0, clock=StepClock())
    assert names(found.diagnosis.unanswered) == ["effects", "strides"]
    assert not found.searched.rough
    assert found.best.z.tolist() == no_time.best.z.tolist()


def test_where_strides_come_too_late_only_they_are_told_as_left(monkeypatch):
    clock, runs = StepClock(), []
    really_run = Search.run

    def run(search, *is_over):
        runs.append(search)
        return search.retuned if len(runs) == 1 else really_run(search, *is_over)

    def too_late(search, *_):
        clock.set_ns(nanoseconds(61.0))
        search.budget.check()

    monkeypatch.setattr(Search, "run", run)
    monkeypatch.setattr(diagnose, "_by_strides", too_late)
    monkeypatch.setattr(diagnose, "is_far", lambda search: bool(search.retuned))
    monkeypatch.setattr(diagnose, "strays", lambda _: True)
    found = diagnose_car([made_drive(seconds=12.0)], nigel(), budget_s=60.0, clock=clock)
    assert names(found.diagnosis.unanswered) == ["strides"]


def test_as_long_as_the_first_fit_took_is_kept_for_what_follows_a_search(monkeypatch):
    clock, seen = StepClock(), []

    def fitted(search):
        clock.set_ns(nanoseconds(20.0))
        return bool(search.retuned)

    def run(search, *_):
        for at_s in (39.0, 41.0):
            clock.set_ns(nanoseconds(at_s))
            seen.append(search.budget.is_over())
        return search.retuned

    monkeypatch.setattr(diagnose, "is_far", fitted)
    monkeypatch.setattr(diagnose, "strays", lambda _: True)
    monkeypatch.setattr(diagnose, "_by_strides", lambda search, *_: search.budget.check())
    monkeypatch.setattr(Search, "run", run)
    diagnose_car([made_drive(seconds=12.0)], nigel(), budget_s=60.0, clock=clock)
    assert seen[:2] == [False, True]
