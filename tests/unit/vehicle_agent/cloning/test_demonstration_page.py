"""The page of a demonstration: laps, balancing and augmentation are those of training."""

import re

import numpy as np
import pyarrow.parquet as pq
import pytest

from scm.errors import LearningError
from scm.vehicles.car import load_car
from tests.unit.vehicle_agent.cloning.examples import demonstration
from vehicle_agent.cloning.demonstration import SAMPLES, Demonstration
from vehicle_agent.cloning.demonstration_page import CHANGED, SHOWN, demonstration_page
from vehicle_agent.cloning.training import balanced

NIGEL = load_car("nigel")


@pytest.fixture
def drive(tmp_path):
    return Demonstration(demonstration(tmp_path / "mine"))


def test_page_shows_laps_balancing_and_changed_frames_with_their_commands(drive):
    page = demonstration_page(drive, NIGEL, seed=3)
    steering = drive.column("steering")
    stays = balanced(steering, np.random.default_rng(3))
    assert "2 laps of n1 on driving_school: 240 frames" in page
    assert f"{stays.sum()} of 240 frames stay" in page
    assert stays.sum() < 240
    assert page.count("held out") == 1
    assert page.count("<img ") == SHOWN * (1 + CHANGED)
    rightmost = min(steering)
    assert f"jpg: {rightmost:+.2f}".replace("-", "\N{MINUS SIGN}") in page
    commands = re.findall(r"<figcaption>changed: (\S+)</figcaption>", page)
    assert len(set(commands)) > SHOWN
    assert "http://" not in page.replace("http://www.w3.org/2000/svg", "")


def test_page_is_the_same_each_time(drive):
    assert demonstration_page(drive, NIGEL) == demonstration_page(drive, NIGEL)


def test_demonstration_of_a_car_that_never_moved_is_refused(drive):
    path = drive.path / SAMPLES
    table = pq.read_table(path)
    zeros = np.zeros(table.num_rows)
    at = table.column_names.index("speed_mps")
    pq.write_table(table.set_column(at, "speed_mps", [zeros]), path)
    with pytest.raises(LearningError, match="stands: did it drive"):
        demonstration_page(Demonstration(drive.path), NIGEL)
