from dataclasses import replace as with_ranges

import numpy as np
import pytest
from msgspec.structs import replace

from scm.errors import MessageError
from scm.geometry import TAU, Pose2
from scm.v2x.messages.lidar_scan import LidarScan
from tests.unit.vehicle_agent.autonomy.rooms import ROOM, sweep_at
from vehicle_agent.autonomy.sweep import Twist, deskewed, sweep_of


def scan(ranges, **more):
    return LidarScan(
        vehicle="n1", t_ns=10**9, beams=len(ranges), range_min_m=0.15, range_max_m=12.0,
        payload=np.array(ranges, "<f4").tobytes(), **more,
    )  # fmt: skip


def off_walls(points, pose):
    """Return how far points of a body at `pose` are from the nearest wall of the room [m]."""
    x, y = np.array([pose.apply(*point) for point in points]).T
    start, end = ROOM[:, :2], ROOM[:, 2:]
    along = end - start
    to = np.column_stack((x, y))[:, None] - start
    part = np.clip((to * along).sum(2) / (along**2).sum(1), 0.0, 1.0)[..., None]
    return np.linalg.norm(to - part * along, axis=2).min(axis=1)


def test_beams_of_a_turning_scanner_look_one_after_another():
    sweep = sweep_of(scan([1.0] * 4, sweep_ns=400_000_000))
    np.testing.assert_allclose(sweep.ago_s, (0.3, 0.2, 0.1, 0.0))
    np.testing.assert_allclose(sweep.bearings, np.arange(4) * TAU / 4)
    assert sweep.is_whole
    np.testing.assert_allclose(
        sweep_of(scan([1.0] * 4, sweep_ns=400_000_000, clockwise=True)).ago_s, (0.0, 0.1, 0.2, 0.3)
    )


def test_part_of_a_circle_is_not_whole():
    assert not sweep_of(scan([1.0] * 4, bearing_first_rad=-0.3, bearing_step_rad=0.2)).is_whole


def test_ranges_that_the_scanner_cannot_measure_are_misses():
    sweep = sweep_of(scan([0.1, 0.2, np.inf, np.nan, 12.5, 11.9]))
    np.testing.assert_array_equal(np.isfinite(sweep.ranges), [0, 1, 0, 0, 0, 1])


@pytest.mark.parametrize(("beams", "bytes_sent"), [(4, 15), (5, 16), (2, 8)])
def test_damaged_scan_is_refused_with_words(beams, bytes_sent):
    damaged = replace(scan([1.0] * 4), beams=beams, payload=bytes(bytes_sent))
    with pytest.raises(MessageError, match=f"n1: LidarScan: .* {beams} beams.* got {bytes_sent} "):
        sweep_of(damaged)


def test_echoes_of_a_moving_scanner_lie_on_the_walls():
    mount, twist, at = Pose2(0.14, 0.01, 0.3), Twist(0.4, 0.0, 1.5), Pose2(-0.3, 0.1, 0.7)
    speed = Twist(
        *np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
        @ (0.4 - 1.5 * 0.01, 1.5 * 0.14),
        1.5,
    )
    sweep = sweep_at(ROOM, at @ mount, speed, sweep_s=0.14)
    assert off_walls(deskewed(sweep, mount, twist), at).max() < 1e-6
    assert off_walls(deskewed(sweep, mount, Twist()), at).max() > 0.05
    gone = with_ranges(sweep, ranges=np.where(np.arange(360) < 100, np.inf, sweep.ranges))
    assert len(deskewed(gone, mount, twist)) == 260
