import math

import pytest

from scm.eye.accuracy import SAMPLES_NS, EyeAccuracyPart, residual_of, stats_of
from scm.geometry import Pose2
from scm.records.eye import ResidualSample
from scm.v2x.exchange import Incoming
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot


@pytest.fixture
def snapshot():
    def build(at_s, **cars):
        vehicles = tuple(
            SnapshotVehicle(
                vehicle=name, kind="hosted", car="nigel", tag_id=1, x_m=x, y_m=y, yaw_rad=yaw,
                speed_mps=0.2, steering_rad=0.1,
            )
            for name, (x, y, yaw) in cars.items()
        )  # fmt: skip
        return WorldSnapshot(t_ns=round(at_s * 1e9), tick=1, vehicles=vehicles)

    return build


def fed(*messages):
    part = EyeAccuracyPart()
    assert part.step(0, [Incoming(message, 0) for message in messages]) == []
    return part


def truth_at(history, vehicle, t_ns):
    return fed(*history).truth_at(vehicle, t_ns)


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


def test_a_car_not_seen_for_long_is_forgotten(snapshot):
    pose = EyePose(
        camera="c", vehicle="n1", tag_id=1, t_ns=0, x_m=0.003, y_m=0.0, yaw_rad=0.0,
        covariance=(0.0,) * 9,
    )  # fmt: skip
    part = fed(snapshot(0.0, n1=(0.0, 0.0, 0.0)), pose)
    assert part.newest("c", "n1").position_mm == 3.0
    part.step(0, [Incoming(snapshot(SAMPLES_NS / 1e9), 0)])
    part.forget()
    assert list(part.samples("c", 0, 1.0)) == ["n1"]
    part.step(0, [Incoming(snapshot(SAMPLES_NS / 1e9 + 0.001), 0)])
    part.forget()
    assert part.samples("c", 0, 1.0) == {}
    assert part.newest("c", "n1") is None


def test_95_of_100_samples_lie_nearer():
    one = {"vehicle": "n1", "t_ns": 0, "x_m": 0.0, "y_m": 0.0, "y_mm": 0.0, "yaw_deg": 0.0}
    stats = stats_of(ResidualSample(x_mm=float(mm), **one) for mm in range(20, 0, -1))
    assert (stats.p95_mm, stats.worst_mm) == (19.0, 20.0)
