"""Who plays a drive in a city looks: rest first, room for the way, an end at edge, hit or wish."""

import math
import threading

import pytest

from scm.errors import RunError
from scm.fleet import LockstepLink
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.ways import laid_from, leaves
from scm.recorder.play import play, read_way
from scm.recorder.play_monitor import PlayMonitor
from scm.runtime.lockstep import Lockstep
from scm.v2x.messages.stop_request import StopRequest
from scm.world.part import WorldPart

FLOOR = ((-100.0, 100.0), (-100.0, 100.0))
ROWS = [(0.0, 0.4, 0.0), (4.0, 0.0, 0.0)]


@pytest.fixture
def lockstep():
    world = WorldPart(load_map("parking_school"), hosted=(("n1", "nigel"),))
    with Lockstep([world]) as city:
        city.run_for(0.1)
        yield city


@pytest.fixture
def link(lockstep):
    return LockstepLink(lockstep)


def test_a_way_is_laid_from_another_pose_with_its_shape():
    way = [Pose2(1.0, 1.0, 0.0), Pose2(2.0, 1.0, 0.0)]
    start, end = laid_from(way, Pose2(5.0, 5.0, math.pi / 2))
    assert start == pytest.approx((5.0, 5.0, math.pi / 2))
    assert end == pytest.approx((5.0, 6.0, math.pi / 2))
    assert laid_from([], start) == []


def test_the_first_pose_that_leaves_the_floor_is_told():
    way = [Pose2(0.5 * k, 0.0, 0.0) for k in range(5)]
    assert leaves(way, (-1.0, 1.8), (-1.0, 1.0), 0.2) == way[4]
    assert leaves(way, (-1.0, 2.3), (-1.0, 1.0), 0.2) is None
    assert leaves(way, (-1.0, 2.3), (-0.1, 1.0), 0.2) == way[0]


def test_a_drive_with_room_is_played_to_its_end(link):
    played = play(link, "n1", ROWS, PlayMonitor(floor=FLOOR))
    assert played.ended == ""
    assert played.messages.reports[-1].t_ns - played.messages.reports[0].t_ns > 4.9e9


def test_a_drive_without_room_does_not_begin_and_gives_the_car_back(link, lockstep):
    monitor = PlayMonitor(floor=FLOOR, way=(Pose2(0.0, 0.0, 0.0), Pose2(500.0, 0.0, 0.0)))
    with pytest.raises(RunError, match=r"n1: from where it stands.*off the floor"):
        play(link, "n1", ROWS, monitor)
    assert play(link, "n1", ROWS[:1]).ended == "", "the lease was released"


def test_a_drive_ends_at_the_edge_of_the_floor(link):
    here = play(link, "n1", [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)]).messages.reports[-1]
    tight = ((here.x_m - 0.25, here.x_m + 0.25), (here.y_m - 0.25, here.y_m + 0.25))
    played = play(link, "n1", ROWS, PlayMonitor(floor=tight, margin_m=0.2))
    assert played.ended.startswith("stopped at the edge of the floor")
    assert played.messages.commands[-1].throttle == 0.0


def test_a_drive_ends_when_somebody_asks(link):
    stop_requested = threading.Event()
    stop_requested.set()
    played = play(link, "n1", ROWS, PlayMonitor(stop_requested=stop_requested))
    assert played.ended == "stopped on request"
    assert played.messages.commands[-1].throttle == 0.0


def test_a_drive_ends_when_the_car_hits_something(link):
    played = play(link, "n1", [(0.0, 1.0, 0.0), (60.0, 0.0, 0.0)], PlayMonitor())
    assert played.ended == "stopped: the car hit something"


def test_a_drive_ends_when_the_city_is_stopped(link, lockstep):
    lockstep.call(StopRequest(engaged=True, by="test"))
    played = play(link, "n1", ROWS, PlayMonitor())
    assert "does not obey" in played.ended


def test_the_way_of_a_drive_lies_beside_it(tmp_path):
    drive = tmp_path / "next_drive.yaml"
    assert read_way(drive) == []
    (tmp_path / "next_drive_way.csv").write_text("t_s,x_m,y_m,yaw_rad\n0,1,2,3\n", "utf-8")
    assert read_way(drive) == [Pose2(1.0, 2.0, 3.0)]
