"""The pattern shows all it must, small throttles first, and stays where it may."""

from itertools import pairwise

import pytest

from scm.geometry import Pose2
from tests.unit.calibrate.rig import Hidden, calibrated
from vehicle_agent.calibrate.pattern import (
    FULL,
    SHORT,
    STEERING_SPREAD,
    STEERINGS,
    THROTTLE_SPREAD,
    Pattern,
)
from vehicle_agent.guard import GuardLimits, rectangle

Z_90 = GuardLimits(rectangle(-100.0, -100.0, 100.0, 100.0), throttle=0.8)


def driven(limits, pose, plan=FULL):
    """What the pattern commands to a car that never moves, step by step."""
    pattern, wishes, progress = Pattern(limits, plan), [], []
    for i in range(20_000):
        wish = pattern.step(pose, i * 0.02)
        if wish is None:
            return wishes, progress
        wishes.append(wish)
        progress.append(pattern.progress)
    pytest.fail("the pattern does not end")


def meant(wishes):
    """The wishes as if none were spread: each the nearest of the plan's throttle and steering."""
    levels = [way * share * 0.8 for share in FULL.shares for way in (1.0, -1.0)]
    middles = sorted({steering for both in STEERINGS for steering in both})
    return [
        (min(levels, key=lambda u: abs(u - a)), min(middles, key=lambda s: abs(s - b)))
        for a, b in wishes
    ]


def test_every_throttle_is_driven_both_ways_with_every_steering_and_small_ones_first():
    wishes, _ = driven(Z_90, Pose2(0.0, 0.0, 0.0))
    moving = meant(wish for wish in wishes if wish[0])
    levels = [abs(throttle) for throttle, _ in moving]
    assert levels == sorted(levels)
    expected = {
        (way * share * 0.8, steering)
        for share in FULL.shares
        for way in (1.0, -1.0)
        for both in STEERINGS
        for steering in both
    }
    assert set(moving) == expected
    seconds = len(moving) * 0.02
    assert seconds == pytest.approx(FULL.leg_s * len(FULL.shares) * 2 * len(STEERINGS), rel=0.03)


def test_the_short_plan_drives_as_many_ways_in_half_a_minute():
    wishes, _ = driven(Z_90, Pose2(0.0, 0.0, 0.0), SHORT)
    assert 20.0 < len(wishes) * 0.02 < 30.0
    assert len({(a > 0.0, b) for a, b in meant(wish for wish in wishes if wish[0])}) == 10


def test_the_wheels_turn_while_it_moves():
    wishes, _ = driven(Z_90, Pose2(0.0, 0.0, 0.0))
    moving = meant(wish for wish in wishes if wish[0])
    turned = sum(a[0] == b[0] and a[1] == -b[1] != 0.0 for a, b in pairwise(moving))
    assert turned >= 2 * 2 * len(FULL.shares)


def test_what_a_firmware_cuts_off_is_half_a_step_in_the_mean():
    wishes = [wish for wish in driven(Z_90, Pose2(0.0, 0.0, 0.0))[0] if wish[0]]
    for at, unspread, spread, steps in (
        (0, 0.8, THROTTLE_SPREAD, 255), (1, 1.0, STEERING_SPREAD, 30),
    ):  # fmt: skip
        commanded = [wish[at] for wish in wishes]
        assert max(map(abs, commanded)) <= unspread
        cut = [steps * value % 1.0 for value in commanded]
        assert sum(cut) / len(cut) == pytest.approx(0.5, abs=0.03)
        quarters = [sum(quarter == int(4.0 * each) for each in cut) for quarter in range(4)]
        assert min(quarters) > 0.2 * len(cut)
        near = [abs(a - b[at]) for a, b in zip(commanded, meant(wishes), strict=True)]
        assert max(near) <= spread + 1e-9


def test_progress_never_falls_and_ends_at_one():
    _, progress = driven(Z_90, Pose2(0.0, 0.0, 0.0))
    assert progress == sorted(progress)
    assert (progress[0], progress[-1]) == (0.0, 1.0)


def test_with_its_nose_at_the_fence_it_drives_back_first():
    limits = GuardLimits(rectangle(0.0, 0.0, 2.0, 1.5))
    wishes, _ = driven(limits, Pose2(1.71, 0.75, 0.0))
    first = next(wish for wish in wishes if wish[0])
    assert first[0] < 0.0
    assert all(throttle <= 0.0 for throttle, _ in wishes)


@pytest.mark.parametrize(
    ("floor", "start", "held"),
    [
        ((0.0, 0.0, 2.0, 1.5), Pose2(1.6, 1.3, 0.2), 0),
        ((0.0, 0.0, 1.2, 1.0), Pose2(0.5, 0.5, 1.0), 1),
    ],
)
def test_the_outline_never_leaves_and_the_guard_hardly_ever_helps(floor, start, held):
    limits = GuardLimits(rectangle(*floor))
    part, farthest = calibrated(Hidden(drive=1.0), start, limits)
    assert farthest < 0.0
    assert part.guard.counts["fence"] <= held
    assert part.guard.counts["crawl"] == 0
