import math

import pytest

from scm.api.residual import residual_of, truth_at
from scm.geometry import Pose2


def test_between_two_snapshots_the_truth_is_linear(snapshot):
    history = [snapshot(1.0, n1=(0.0, 1.0, 0.0)), snapshot(2.0, n1=(4.0, 3.0, 0.2))]
    assert truth_at(history, "n1", 1_250_000_000) == pytest.approx((1.0, 1.5, 0.05))


def test_yaw_takes_the_short_way_round(snapshot):
    history = [snapshot(1.0, n1=(0.0, 0.0, 3.1)), snapshot(2.0, n1=(0.0, 0.0, -3.1))]
    assert abs(truth_at(history, "n1", 1_500_000_000).yaw) == pytest.approx(math.pi)


@pytest.mark.parametrize("t_ns", [500_000_000, 2_500_000_000])
def test_outside_the_history_there_is_no_truth(snapshot, t_ns):
    history = [snapshot(1.0, n1=(0.0, 0.0, 0.0)), snapshot(2.0, n1=(1.0, 0.0, 0.0))]
    assert truth_at(history, "n1", t_ns) is None


def test_a_car_that_was_not_there_has_no_truth(snapshot):
    history = [snapshot(1.0), snapshot(2.0, n1=(1.0, 0.0, 0.0))]
    assert truth_at(history, "n1", 1_500_000_000) is None


def test_the_exact_time_of_a_snapshot_needs_no_other(snapshot):
    assert truth_at([snapshot(1.0, n1=(3.0, 0.0, 0.0))], "n1", 1_000_000_000).x == 3.0


def test_measured_further_left_is_positive_yaw():
    residual = residual_of(Pose2(0.003, 0.004, -math.pi + 0.01), Pose2(0.0, 0.0, math.pi - 0.01))
    assert residual.position_mm == 5.0
    assert residual.yaw_deg == pytest.approx(math.degrees(0.02), abs=1e-3)
