"""Frames are lost by their own number alone, and the others come when their latency is over."""

import pytest

from scm.camera.delivery import UnderWay, is_lost
from scm.v2x.messages.camera_frame import CameraFrame


def lost(seed=0, vehicle="n1", camera="front", share=0.3, count=2000):
    return [is_lost(seed, vehicle, camera, number, share) for number in range(count)]


def frame(t_ns):
    return CameraFrame(
        vehicle="n1", camera="front", t_ns=t_ns, width_px=1, height_px=1, payload=b""
    )


def test_the_share_that_is_lost_is_the_one_asked_for():
    # 2000 frames: the share is known to 0.01 (one sigma).
    assert sum(lost()) / 2000 == pytest.approx(0.3, abs=0.04)


def test_without_drop_out_nothing_is_lost():
    assert not any(lost(share=0.0))


def test_which_frames_are_lost_hangs_on_seed_car_camera_and_number_alone():
    first = lost()
    assert lost() == first
    assert [is_lost(0, "n1", "front", number, 0.3) for number in (7, 3)] == [first[7], first[3]]
    for other in (lost(seed=1), lost(vehicle="n2"), lost(camera="rear")):
        agree = sum(a == b for a, b in zip(first, other, strict=True)) / 2000
        assert agree == pytest.approx(0.3**2 + 0.7**2, abs=0.05)  # as two that know nothing


def test_a_higher_share_loses_those_of_a_lower_one_too():
    assert all(more or not less for less, more in zip(lost(share=0.1), lost(), strict=True))


def test_a_frame_comes_out_once_and_not_before_its_time():
    way = UnderWay()
    way.put(frame(1), 100)
    assert way.come_out(99) == []
    assert [one.t_ns for one in way.come_out(100)] == [1]
    assert way.come_out(200) == []


def test_frames_come_out_by_when_they_can_be_had():
    way = UnderWay()
    for t_ns, out_ns in ((1, 300), (2, 200), (3, 200), (4, 400)):
        way.put(frame(t_ns), out_ns)
    assert [one.t_ns for one in way.come_out(300)] == [2, 3, 1]
    way.clear()
    assert way.come_out(1000) == []
