"""Of a recording that is too long for a budget, pieces all over it are compared."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scm.mismatch.budget import COMPARED_PER_S, MIN_COMPARED_S, Budget
from scm.mismatch.usable_data import PIECE_S, sampled
from scm.recording.read import Channel, Recording


def a_recording(length_s, stands_s=0.0, begin_s=0.0):
    """A car that drives along a line at 0.5 m/s, after it has stood."""
    t = begin_s + np.arange(0.0, length_s, 0.1)
    x = 0.5 * np.maximum(t - begin_s - stands_s, 0.0)
    rows = {"pose.x": x, "pose.y": 0.0 * x, "pose.yaw": 0.0 * x}
    rows |= {"command.throttle": 0.0 * x + 0.3, "command.steering": 0.0 * x}
    channels = {n: Channel(t, v, None, (0.0, 0.0), "ratio") for n, v in rows.items()}
    return Recording(Path("long/recording.yaml"), "nigel", channels)


def span(recording):
    t = recording.channel("pose.x").t
    return float(t[0]), float(t[-1])


def length(recordings):
    return sum(last - first for first, last in map(span, recordings))


def test_what_a_budget_allows_is_compared_whole():
    whole = [a_recording(80.0)]
    assert sampled(whole, 90.0) == (whole, ())
    whole = [a_recording(COMPARED_PER_S * 1800.0)]
    assert sampled(whole, COMPARED_PER_S * 1800.0) == (whole, ())


@pytest.mark.parametrize("budget_s", [1.0, 20.0, 100.0])
def test_of_an_hour_a_short_budget_compares_pieces_all_over_it(budget_s):
    parts, (problem,) = sampled([a_recording(3600.0)], Budget(budget_s).compared_s())
    allowed_s = max(MIN_COMPARED_S, COMPARED_PER_S * budget_s)
    assert allowed_s - PIECE_S <= length(parts) <= allowed_s
    assert span(parts[0])[0] < 60.0
    assert span(parts[-1])[1] > 3540.0
    assert problem.name == "partly_compared"
    assert f"{allowed_s // PIECE_S * PIECE_S:.0f} s of 3600 s" in problem.text
    assert f"--budget-s {3600.0 / COMPARED_PER_S:.0f}" in problem.text


def test_pieces_in_which_the_car_stands_are_not_taken():
    parts, _ = sampled([a_recording(3600.0, stands_s=1700.0)], Budget(20.0).compared_s())
    assert span(parts[0])[0] > 1650.0


def test_commands_before_a_piece_stay_with_it():
    parts, _ = sampled([a_recording(3600.0)], Budget(20.0).compared_s())
    assert parts[-1].channel("command.steering").t[0] < span(parts[-1])[0] - 1.9


def test_of_several_stretches_some_of_each_are_taken():
    stretches = [a_recording(400.0, begin_s=begin) for begin in (0.0, 1e5, 2e5)]
    parts, _ = sampled(stretches, Budget(30.0).compared_s())
    assert {round(span(part)[0] / 1e5) for part in parts} == {0, 1, 2}


def test_pieces_that_follow_one_another_are_one():
    parts, _ = sampled([a_recording(100.0)], Budget(1.0).compared_s())
    assert len(parts) == 1


def test_nothing_changes_what_was_recorded():
    whole = a_recording(3600.0)
    parts, _ = sampled([whole], Budget(20.0).compared_s())
    for part in parts:
        x, t = part.channel("pose.x").values, part.channel("pose.x").t
        assert np.array_equal(
            x, whole.channel("pose.x").values[np.isin(whole.channel("pose.x").t, t)]
        )
    assert replace(parts[0], channels={}) == replace(whole, channels={})
