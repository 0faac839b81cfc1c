from dataclasses import replace

import numpy as np
import pytest

from scm.errors import MessageError
from scm.geometry import Pose2
from tests.unit.vehicle_agent.autonomy.rooms import CORRIDOR, ROOM, later, sweep_at
from vehicle_agent.autonomy.range_flow import range_flow, seen_at_end
from vehicle_agent.autonomy.sweep import Twist

HERE = Pose2(-0.2, 0.1, 0.4)
NOISE_M = 0.01
MOTIONS = [
    Pose2(0.03, 0.0, 0.0),
    Pose2(-0.02, 0.02, 0.05),
    Pose2(0.0, 0.0, -0.15),
    Pose2(0.05, -0.03, 0.1),
    Pose2(-0.15, 0.1, 0.35),
]


def off(found, true):
    error = true.inverse() @ found
    return np.hypot(error.x, error.y), abs(error.yaw)


@pytest.mark.parametrize("motion", MOTIONS)
def test_known_motion_in_a_room_is_found(motion):
    way, turn = off(range_flow(sweep_at(ROOM, HERE), sweep_at(ROOM, HERE @ motion)).motion, motion)
    assert way < 0.002
    assert turn < 0.002


def test_error_is_as_small_as_the_covariance_says():
    motion, normed = MOTIONS[1], []
    for seed in range(60):
        first = sweep_at(ROOM, HERE, noise_m=NOISE_M, seed=seed)
        second = sweep_at(ROOM, HERE @ motion, noise_m=NOISE_M, seed=100 + seed)
        flow = range_flow(first, second)
        error = np.array(flow.motion) - motion
        normed.append(error @ np.linalg.solve(flow.covariance, error))
    assert 1.0 < np.mean(normed) < 27.0  # odometry takes flows as 3 times wider: 9 times 3 numbers


def test_sweeps_of_a_moving_scanner_are_compared_at_their_ends():
    twist, period_s = Twist(0.3, 0.05, 0.8), 0.14
    motion = later(twist, period_s)
    raw = [sweep_at(ROOM, at, twist, sweep_s=period_s) for at in (HERE, HERE @ motion)]
    taken = [seen_at_end(sweep, twist) for sweep in raw]
    way, turn = off(range_flow(*taken).motion, motion)
    assert way < 0.003
    assert turn < 0.003


def test_sweep_is_taken_to_its_end():
    twist = Twist(0.2, -0.2, 0.8)
    taken = seen_at_end(sweep_at(ROOM, HERE, twist, sweep_s=0.14), twist)
    ideal = sweep_at(ROOM, HERE)
    both = np.isfinite(taken.ranges)
    assert both.mean() > 0.9
    assert np.median(np.abs(taken.ranges - ideal.ranges)[both]) < 0.002
    assert not taken.ago_s.any()


def test_along_a_corridor_nothing_is_known():
    motion = Pose2(0.04, 0.01, 0.02)
    here = Pose2(0.0, 0.1, 0.0)
    flow = range_flow(sweep_at(CORRIDOR, here), sweep_at(CORRIDOR, here @ motion))
    assert abs(flow.motion.y - motion.y) < 0.002
    assert abs(flow.motion.yaw - motion.yaw) < 0.002
    variances, axes = np.linalg.eigh(flow.covariance)
    assert variances[2] > 1.0
    assert abs(axes[0, 2]) > 0.999
    assert variances[1] < 1e-4


def test_guess_remains_where_nothing_is_seen():
    motion = Pose2(0.04, 0.01, 0.02)
    here = Pose2(0.0, 0.1, 0.0)
    flow = range_flow(sweep_at(CORRIDOR, here), sweep_at(CORRIDOR, here @ motion), motion)
    assert abs(flow.motion.x - motion.x) < 0.002


def test_without_echoes_nothing_is_known():
    sweep = replace(sweep_at(ROOM, HERE), ranges=np.full(360, np.inf))
    flow = range_flow(sweep, sweep)
    assert (np.diag(flow.covariance) >= 1e6).all()
    assert flow.motion == Pose2(0.0, 0.0, 0.0)


def test_other_surroundings_leave_a_residual():
    second = sweep_at(ROOM, HERE @ Pose2(0.02, 0.0, 0.0))
    same = range_flow(sweep_at(ROOM, HERE), second)
    other = range_flow(sweep_at(0.5 * ROOM, Pose2(0.0, 0.0, 0.5)), second)
    assert same.residual_m < 0.01
    assert other.residual_m > 0.05


def test_person_beside_the_car_does_not_move_it():
    first, second = sweep_at(ROOM, HERE), sweep_at(ROOM, HERE)
    hides = np.abs(np.arange(360) - 60) < 25
    seen = [
        replace(s, ranges=np.where(hides, r, s.ranges)) for s, r in ((first, 0.3), (second, 0.33))
    ]
    assert off(range_flow(*seen).motion, Pose2(0.0, 0.0, 0.0))[0] < 0.004


def test_other_beams_are_refused_with_words():
    first = sweep_at(ROOM, HERE)
    half = replace(first, bearings=first.bearings[::2], ranges=first.ranges[::2])
    with pytest.raises(MessageError, match=r"expected two sweeps with the same beams, .* 180"):
        range_flow(first, half)
