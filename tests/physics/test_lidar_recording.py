"""Our LIDAR, set down where the AutoDRIVE simulator's Nigel drove, sees what its LIDAR saw.

The walls come from every other scan, the comparison from the scans between.
"""

import numpy as np
import pytest

from scm.vehicles.car import load_car
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor import Surroundings
from scm.vehicles.sensors.lidar import scan
from tests.physics import tiny_town

pytestmark = pytest.mark.skipif(
    not tiny_town.FOLDER.is_dir(), reason="the shared recordings are not part of this repository"
)


@pytest.fixture(scope="module")
def drive():
    return tiny_town.load()


def errors(drive, lag_s, mount_m=tiny_town.MOUNT_M):
    """Return how far our ranges are off beam by beam, (k, 360); infinity where we saw nothing."""
    learn, held_out = drive.fresh[::2], drive.fresh[1::2]
    walls = tiny_town.walls_of(drive.hits(learn, drive.scanners(learn, lag_s, mount_m)))
    scene = Scene(WallGrid(walls), np.zeros((0, 4)), np.zeros(0, np.int64))
    scanners = drive.scanners(held_out, lag_s, mount_m)
    seen = scan(load_car("nigel"), scanners, Surroundings(scene, np.full(len(scanners), -1)))
    return np.abs(seen - drive.ranges[held_out])


def test_beam_by_beam_we_see_what_it_saw(drive):
    off = errors(drive, tiny_town.LAG_S)
    assert np.median(off) < 0.001
    assert np.percentile(off, 95) < 0.012
    assert np.mean(np.isinf(off)) < 0.001


def test_taken_at_the_rows_own_time_the_scans_are_stale_by_what_the_lag_says(drive):
    assert np.percentile(errors(drive, 0.0), 95) > 5.0 * np.percentile(
        errors(drive, tiny_town.LAG_S), 95
    )


def test_the_mounting_point_of_the_car_file_fits_best(drive):
    here = load_car("nigel").vector("lidar.position_m")[0]
    medians = [np.median(errors(drive, tiny_town.LAG_S, here + d)) for d in (-0.01, 0.0, 0.01)]
    assert np.argmin(medians) == 1
