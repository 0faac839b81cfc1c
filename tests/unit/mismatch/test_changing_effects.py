"""Effects that change during a recording: what is tried, found, written and reported."""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from scm.data_quality.prepare import between
from scm.mismatch.changing_effect import (
    EDGE_S,
    LEAST_S,
    RARE,
    ChangingEffect,
    changing,
    may_change,
    moments_in,
)
from scm.mismatch.findings import Course, Effect, Estimate, Located
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import together
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.report.pictures import _moments_drawn
from scm.mismatch.report.sentences import effect_title, since_sentence
from scm.mismatch.select.changes import changes_to_try, moments_scored, with_best_moments
from scm.mismatch.select.confirm import with_placed_moments
from scm.mismatch.select.round import Context, extend, penalty
from scm.mismatch.validate.conclude import moves_nothing_at_end
from scm.mismatch.validate.explain import _moment
from scm.mismatch.validate.found_car import CarFiles
from scm.mismatch.validate.locate import since_changes
from scm.mismatch.validate.stages import as_it_was, at_shares, spans_of
from scm.replay.drive import Drive
from tests.unit.mismatch import made_up_findings as made_up
from tests.unit.mismatch.made_drive import big_nigel, driven, made_drive, nigel
from tests.unit.mismatch.made_fit import candidate

SINCE_S, SPAN = 15.0, (0.0, 30.0)
CAME_S, WENT_S, PUSH = 10.5, 19.0, 0.2
BIAS = 0.05


def _late(name, t, values):
    return values + BIAS * (t > SINCE_S) if name == "imu.gyro_z" else values


def _growing(name, t, values):
    return values + BIAS * t / SPAN[1] if name == "imu.gyro_z" else values


def _for_a_while(name, t, values):
    there = (t > CAME_S) & (t < WENT_S)
    return values + PUSH * there if name == "imu.accel_x" else values


def context_of(model, *names, **more):
    return Context(np.ones(len(model.t)), tuple(map(candidate, names)), **more)


@cache
def tried(sense):
    """One round on a drive whose gyro has a bias later or more and more, or whose x for a while."""
    model = Likelihood.of([driven(seconds=30.0, sense=sense)], big_nigel())
    context = context_of(model, "gyro_bias", "gyro_scale", "accel_bias")
    fitter = context.fitter(model)
    (base,) = fitter.refine([fitter.unfitted()], rounds=2, fresh=True)
    return extend(context, base)


def test_a_bias_that_came_later_is_found_with_its_moment():
    best = tried(_late).alternatives[0]
    (effect,) = best.effects
    assert (effect.name, effect.course) == ("gyro_bias", Course.STEP)
    assert best.values[-1] == pytest.approx(SINCE_S, abs=1.0)
    assert best.values[0] == pytest.approx(BIAS, abs=0.006)


def test_a_bias_that_grew_is_found_as_a_ramp():
    best = tried(_growing).alternatives[0]
    (effect,) = best.effects
    assert (effect.name, effect.course) == ("gyro_bias", Course.RAMP)
    assert best.values == pytest.approx([BIAS], abs=0.006)


def test_a_bias_that_came_and_went_is_found_with_both_moments():
    best = tried(_for_a_while).alternatives[0]
    (effect,) = best.effects
    assert (effect.name, effect.course) == ("accel_bias", Course.INTERMITTENT)
    assert best.values[2:] == pytest.approx([CAME_S, WENT_S], abs=1.0)
    assert best.values[:2] == pytest.approx([PUSH, 0.0], abs=0.03)


def test_one_rollout_shows_between_which_moments_an_effect_was_there():
    base = tried(_for_a_while).base
    context = context_of(base.model, "accel_bias")
    fitter = context.fitter(base.model)
    begun = fitter.begin(base, [((candidate("accel_bias"),), np.array([0.1, 0.0]))])
    (effect,), values = changes_to_try(context.penalty, fitter, base, begun)[0]
    assert (effect.name, effect.course) == ("accel_bias", Course.INTERMITTENT)
    assert values[2:] == pytest.approx([CAME_S, WENT_S], abs=1.5)
    assert values[0] == pytest.approx(PUSH, rel=0.2)


def test_one_that_gains_as_much_by_staying_is_not_tried_as_coming_and_going():
    base = tried(_late).base
    context = context_of(base.model, "gyro_bias")
    fitter = context.fitter(base.model)
    begun = fitter.begin(base, [((candidate("gyro_bias"),), np.array([0.03]))])
    trials = changes_to_try(context.penalty, fitter, base, begun)
    assert {effects[0].course for effects, _ in trials} == {Course.STEP, Course.RAMP}


@pytest.mark.parametrize("sense", [_late, _growing, _for_a_while])
def test_a_change_is_better_by_far_than_the_same_effect_all_along(sense):
    found = tried(sense)
    costs = zip(found.alternatives, found.criteria, strict=True)
    constant = min(cost for one, cost in costs if may_change(one.effects[0]))
    assert found.criteria[0] < constant - 50.0


def test_a_bias_that_was_always_there_is_constant():
    sense = lambda name, _, v: v + BIAS if name == "imu.gyro_z" else v  # noqa: E731
    model = Likelihood.of([driven(seconds=30.0, sense=sense)], big_nigel())
    context = context_of(model, "gyro_bias", "gyro_scale")
    fitter = context.fitter(model)
    (base,) = fitter.refine([fitter.unfitted()], rounds=2, fresh=True)
    best = extend(context, base).alternatives[0]
    assert may_change(best.effects[0])
    assert best.names == ("gyro_bias",)


def test_a_moment_is_moved_to_where_the_score_is_lowest():
    best = tried(_late).alternatives[0]
    fitter = Fitter(best.model, np.ones(len(best.model.t)))
    off = replace(best, values=best.values + np.array([0.0, 6.0]))
    (moved,) = with_best_moments(fitter, [off])
    assert moved.values[-1] == pytest.approx(SINCE_S, abs=0.5)
    at, scores = moments_scored(fitter, best, 1, 3.0, 0.5)
    assert at[np.argmin(scores)] == pytest.approx(SINCE_S, abs=0.6)


def test_both_moments_are_moved_to_where_the_score_is_lowest():
    best = tried(_for_a_while).alternatives[0]
    fitter = Fitter(best.model, np.ones(len(best.model.t)))
    off = replace(best, values=best.values + np.array([0.0, 0.0, 2.0, -3.0]))
    (moved,) = with_best_moments(fitter, [off])
    assert moved.values[2:] == pytest.approx([CAME_S, WENT_S], abs=0.5)


def test_no_change_is_searched_for_in_a_short_drive_or_in_several():
    short = Likelihood.of([driven(seconds=LEAST_S - 5.0)], big_nigel())
    several = Likelihood.of([driven(seconds=22.0), driven(seconds=22.0)], big_nigel())
    for model in (short, several):
        context = context_of(model, "gyro_bias")
        fitter = context.fitter(model)
        base = fitter.at(fitter.unfitted())
        begun = fitter.begin(base, [((candidate("gyro_bias"),), np.array([0.05]))])
        assert changes_to_try(context.penalty, fitter, base, begun) == []


def test_a_moment_is_placed_by_the_part_that_confirms_too():
    best = tried(_for_a_while).alternatives[0]
    t = best.model.t
    unseen = ((t > 17.0) & (t < 22.0)).astype(float)
    context = replace(context_of(best.model, "accel_bias"), part=1.0 - unseen)
    off = replace(best, values=best.values + np.array([0.0, 0.0, 0.0, 2.5]))
    moved = with_placed_moments(context, off, unseen)
    assert moved.values[2:] == pytest.approx([CAME_S, WENT_S], abs=0.6)
    assert moved.values[:2] == pytest.approx(best.values[:2])


def test_a_moment_s_interval_is_narrow_and_holds_its_value():
    best = tried(_for_a_while).alternatives[0]
    since = _moment(best, 2)
    assert since.low <= since.value <= since.high
    assert since.low < CAME_S < since.high < since.low + 2.0
    off = replace(best, values=best.values + np.array([0.0, 0.0, 2.5, 0.0]))
    assert _moment(off, 2).high > off.values[2]


def test_what_went_moves_nothing_at_the_end():
    best = tried(_for_a_while).alternatives[0]
    trim = candidate("steer_trim")
    moves = {
        course: moves_nothing_at_end(
            replace(best, effects=(changing(trim, course, SPAN),), values=np.array(values))
        )
        for course, values in (
            (Course.STEP, [0.05, 12.0]), (Course.RAMP, [0.05]),
            (Course.INTERMITTENT, [0.05, 12.0, 20.0]),
        )
    }  # fmt: skip
    assert moves == {Course.STEP: False, Course.RAMP: False, Course.INTERMITTENT: True}
    assert moves_nothing_at_end(best)


def test_every_moment_that_is_tried_counts_in_the_penalty():
    bias = candidate("gyro_bias")
    short, long = (changing(bias, Course.STEP, (0.0, end)) for end in (30.0, 120.0))
    assert penalty((bias,), 40) < penalty((short,), 40) < penalty((long,), 40)
    pair = changing(bias, Course.INTERMITTENT, SPAN)
    assert penalty((pair,), 40) > penalty((short,), 40) + RARE
    first, *_, last = moments_in(SPAN)
    assert (first, last) == (EDGE_S, SPAN[1] - EDGE_S)


def test_a_change_says_its_numbers_before_and_when():
    step = changing(candidate("steer_trim"), Course.STEP, SPAN)
    assert step.numbers((0.05, 12.0)) == {
        "steering.trim_rad": 0.05, "steering.trim_rad@before": 0.0,
        "steering.trim_rad@since_s": 12.0, "steering.trim_rad@until_s": 12.0,
    }  # fmt: skip
    pair = changing(candidate("steer_trim"), Course.INTERMITTENT, SPAN)
    since = {"steering.trim_rad@since_s": 12.0, "steering.trim_rad@until_s": 12.0}
    assert pair.numbers((0.05, 12.0, 20.0)) == {
        "steering.trim_rad": 0.05, "steering.trim_rad@before": 0.0, **since,
        "steering.trim_rad@back_s": 20.0,
    }  # fmt: skip
    ramp = changing(candidate("steer_trim"), Course.RAMP, SPAN, was_there=True)
    numbers = ramp.numbers((0.05, -0.01))
    assert numbers["steering.trim_rad@before"] == -0.01
    assert (numbers["steering.trim_rad@since_s"], numbers["steering.trim_rad@until_s"]) == SPAN


def test_the_car_at_the_end_has_the_effect_and_the_car_before_has_not():
    best = tried(_late).alternatives[0]
    assert at_shares(best, [0.0]).effects == ()
    (effect,) = at_shares(best, [1.0]).effects
    assert effect == candidate("gyro_bias")
    assert at_shares(best, [1.0]).values.tolist() == [best.values[0]]
    assert at_shares(best, [0.5]).values.tolist() == pytest.approx([0.5 * best.values[0]])


def test_shares_of_changes_go_with_time():
    trim, values = candidate("steer_trim"), [0.05, 12.0, 20.0]
    step, ramp, pair = (changing(trim, course, SPAN) for course in list(Course)[1:])
    times = (-math.inf, 11.9, 12.0, 20.0, math.inf)
    assert [step.share(values[:2], t) for t in times] == [0.0, 0.0, 1.0, 1.0, 1.0]
    assert [ramp.share(values[:1], t) for t in times] == pytest.approx(
        [0, 11.9 / 30, 0.4, 2 / 3, 1]
    )
    assert [pair.share(values, t) for t in times] == [0.0, 0.0, 1.0, 0.0, 0.0]


def test_the_car_at_the_end_is_without_what_came_and_went():
    best = tried(_for_a_while).alternatives[0]
    found = effect_like(best.effects[0])
    files = CarFiles(nigel(), ("made",))
    car = files.written(best, [found])
    first, during, last = files.stages(best, [found], car)
    assert (first.file, during.file, last.file) == ("car.toml", "during.toml", "car.toml")
    assert (first.until_s, during.until_s) == tuple(best.values[2:])
    assert first.car is last.car is car
    key = "measure.accel_bias_x_m_s2"
    assert not car.has(key)
    assert during.car.value(key) == pytest.approx(best.values[0], rel=1e-5)
    for one in (car, during.car):
        text = one.path.read_text(encoding="utf-8")
        assert "# accel_bias was there from 10.4 s (10.0 to 11.0 s) to 19.1 s" in text


def test_two_changes_have_a_car_for_each_span_between_their_moments():
    best = tried(_for_a_while).alternatives[0]
    effects = (changing(candidate("steer_trim"), Course.STEP, SPAN), *best.effects)
    both = replace(best, effects=effects, values=np.array([0.05, 15.0, *best.values]))
    spans = spans_of(both)
    assert [shares for *_, shares in spans] == [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]
    assert [until_s for _, until_s, _ in spans] == [best.values[2], 15.0, best.values[3], math.inf]
    assert at_shares(both, spans[-1][2]).names == ("steer_trim",)


def test_a_report_says_from_when_to_when_an_effect_was_there():
    pair = effect_like(changing(candidate("accel_bias"), Course.INTERMITTENT, SPAN))
    assert effect_title(pair).endswith("from 10 s to 19 s")
    assert since_sentence(pair).startswith(
        "From 10.4 s (10.0 to 11.0 s) to 19.1 s (18.5 to 19.5 s)"
    )
    located = (Located(equation=pair.equation, channels=("imu.accel_x",), depends_on=(),
                       when_s=None, where=None, share_of_error=1.0),)  # fmt: skip
    assert since_changes(located, [pair], 90.0)[0].when_s == ((10.4, 19.1),)


def effect_like(candidate):
    """What a report states of an effect that came and went."""
    since, until = (
        Estimate(value=value, low=low, high=high, unit="s")
        for value, low, high in ((10.4, 10.0, 11.0), (19.1, 18.5, 19.5))
    )
    bias = {name: Estimate(value=0.1, low=0.0, high=0.2, unit="m/s^2")
            for name in ("x_mps2", "y_mps2")}  # fmt: skip
    return Effect(
        name=candidate.name, is_known=True, equation=candidate.equation, depends_on=("time",),
        parameters=bias, probability=0.9, text="", course=Course.INTERMITTENT,
        since_s=since, until_s=until,
    )  # fmt: skip


def test_a_report_names_the_moment_of_a_change():
    effect = made_up.CASES["one_effect"]()[0].effects[0]
    since = Estimate(value=42.0, low=41.2, high=43.1, unit="s")
    late = structs.replace(effect, course=Course.STEP, since_s=since)
    assert effect_title(late).endswith("since 42 s")
    assert since_sentence(late).startswith("42.0 s (41.2 to 43.1 s)")
    assert since_sentence(effect) == ""


def test_an_effect_on_its_way_has_numbers_and_intervals_between_its_ends():
    trim = candidate("steer_trim")
    end = Estimate(value=0.04, low=0.03, high=0.05, unit="rad")
    effect = structs.replace(
        made_up.CASES["one_effect"]()[0].effects[0], parameters={"offset_rad": end}
    )
    ramp = changing(trim, Course.RAMP, SPAN)
    assert as_it_was(effect, trim, [0.04], 0.0, {}) is effect
    assert as_it_was(effect, ramp, [0.04], 0.0, {}) is None
    assert as_it_was(effect, ramp, [0.04], 1.0, {}) is effect
    pair = changing(trim, Course.INTERMITTENT, SPAN)
    came = structs.replace(effect, course=Course.INTERMITTENT)
    assert as_it_was(came, pair, [0.04, 10.0, 20.0], 0.0, {}) is None
    assert as_it_was(came, pair, [0.04, 10.0, 20.0], 1.0, {}) == effect
    half = as_it_was(effect, ramp, [0.04], 0.5, {}).parameters["offset_rad"]
    assert (half.value, half.low, half.high) == pytest.approx((0.02, 0.015, 0.025))
    was = structs.replace(effect, before={"offset_rad": structs.replace(end, value=0.02)})
    there = changing(trim, Course.RAMP, SPAN, was_there=True)
    first = as_it_was(was, there, [0.04, 0.02], 0.0, {}).parameters["offset_rad"]
    assert (first.value, first.low) == pytest.approx((0.02, 0.01))


def test_the_error_of_an_effect_that_began_is_located_in_time():
    found = made_up.CASES["one_effect"]()[0]
    (effect,) = found.effects
    located = tuple(structs.replace(one, when_s=None) for one in found.located)
    since = Estimate(value=42.0, low=41.2, high=43.1, unit="s")
    late = structs.replace(effect, course=Course.STEP, since_s=since)
    for one, now in zip(located, since_changes(located, [late], 90.0), strict=True):
        mine = one.equation is effect.equation
        assert now.when_s == (((42.0, 90.0),) if mine else None)
    changed = structs.replace(late, before=effect.parameters)
    assert since_changes(located, [changed], 90.0) == located
    assert since_changes(located, [late, effect], 90.0) == located


def test_what_is_located_by_a_change_after_a_pause_is_where_the_pause_was_cut_out():
    found = made_up.CASES["one_effect"]()[0]
    effect = found.effects[0]
    since = Estimate(value=142.0, low=141.2, high=143.1, unit="s")
    late = structs.replace(effect, course=Course.STEP, since_s=since)
    located = tuple(structs.replace(one, when_s=None) for one in found.located)
    pauses = ((0.0, 0.0), (30.5, 100.0))  # the first 30 s, and what is from 130.5 s on
    moved = since_changes(located, [late], 190.0, pauses)
    assert {one.when_s for one in moved if one.equation is effect.equation} == {((42.0, 90.0),)}


@pytest.mark.parametrize("start_s", [0.0, 100.0])
def test_moment_after_a_pause_is_drawn_where_the_pause_was_cut_out(start_s):
    since = Estimate(value=142.0, low=120.0, high=143.0, unit="s")
    late = structs.replace(made_up.lag(), course=Course.STEP, since_s=since)
    pauses = ((start_s, 0.0), (start_s + 30.5, 100.0))
    (drawn,) = _moments_drawn([late], pauses, start_s)
    assert (drawn.value, drawn.low, drawn.high) == (42.0, 30.5, 43.0)


def test_moment_is_found_where_the_recording_has_pauses():
    whole = made_drive(seconds=30.0, sense=_late)
    drives = [Drive(between(whole, *ends), big_nigel()) for ends in ((0.0, 10.0), (11.5, 30.0))]
    model = Likelihood.of(drives, big_nigel())
    context = context_of(model, "gyro_bias", "gyro_scale", "accel_bias")
    fitter = context.fitter(model)
    (base,) = fitter.refine([fitter.unfitted()], rounds=2, fresh=True)
    best = extend(context, base).alternatives[0]
    assert (best.effects[0].name, best.effects[0].course) == ("gyro_bias", Course.STEP)
    assert best.values[-1] == pytest.approx(SINCE_S, abs=1.0)


def test_moment_of_one_of_two_recordings_is_not_searched_for():
    one = made_drive(seconds=30.0, sense=_late)
    drives = [Drive(replace(one, path=Path(name)), big_nigel()) for name in ("a.mcap", "b.mcap")]
    model = Likelihood.of(drives, big_nigel())
    context = context_of(model, "gyro_bias")
    fitter = context.fitter(model)
    (base,) = fitter.refine([fitter.unfitted()], rounds=2, fresh=True)
    found = extend(context, base).alternatives
    assert found
    assert not any(isinstance(one.effects[0], ChangingEffect) for one in found)


def test_before_a_change_the_car_s_own_number_counts():
    radius, trim = candidate("wheel_radius"), candidate("steer_trim")
    key, given = radius.parameters[0].key, big_nigel().value("wheel.radius_m")
    step = changing(radius, Course.STEP, SPAN)
    numbers = together({key: 0.033}, (step, trim), np.array([0.95, 12.0, 0.05]))
    assert (key, numbers[key + "@before"]) == ("wheel.radius_m", 0.033)
    assert numbers[key] == pytest.approx(0.95 * given)
    assert step.at([0.95, 12.0], 0.0, {key: 0.033}) == pytest.approx((0.033 / given,))


def test_a_number_at_its_bound_stays_there_at_the_end_of_a_change():
    gain = candidate("drive_gain")
    low = gain.parameters[0].bounds[0]
    step = changing(gain, Course.STEP, SPAN)
    assert step.at([low, 12.0], 1.0) == (low,)  # not 1 + (low - 1), which is less


def test_a_change_leaves_the_car_s_own_number_free():
    model = Likelihood.of([driven(seconds=6.0)], big_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    effect = candidate("payload")
    own = [one.key for one in model.nominal].index(effect.parameters[0].own)
    base = fitter.at(fitter.unfitted(np.full(len(model.nominal), 0.1)))
    ramp = changing(effect, Course.RAMP, (0.0, 6.0))
    trials = [((one,), np.array([0.3])) for one in (effect, ramp)]
    constant, changed = fitter.begin(base, trials)
    assert constant.z[own] == 0.0
    assert changed.z[own] != 0.0
