"""A scanner's bytes become turns, whatever else is on the line."""

import os
import pty
import random
import tty

import numpy as np
import pytest

from scm import registry
from scm.clock import NS_PER_S
from scm.errors import RunError
from vehicle_agent.lidar import LidarKind, Turn, scan_of
from vehicle_agent.lidar_port import LIDARS, open_lidar
from vehicle_agent.lidars.rplidar_a1 import DESCRIPTOR, LIDAR, PAUSE, SCAN, STOP, RplidarA1


def node(degrees, metres, first=False):
    """Return one measurement of the scanner: clockwise degrees."""
    angle, distance = round(degrees * 64) << 1 | 1, round(metres * 4000)
    head = 15 << 2 | (1 if first else 2)
    return bytes([head]) + angle.to_bytes(2, "little") + distance.to_bytes(2, "little")


def turn(metres=lambda degrees: 2.0):
    return b"".join(node(d, metres(d), d == 0) for d in range(360))


def test_a_node_has_the_makers_bits():
    assert node(90.0, 1.0, first=True) == bytes.fromhex("3d 01 2d a0 0f")


def test_turns_are_whole_and_left_is_left():
    wall = turn(lambda d: 1.0 if d == 270 else 3.0)
    (first, second) = RplidarA1().feed(DESCRIPTOR + wall * 2 + node(0, 1, first=True))
    assert len(first.ranges) == len(second.ranges) == 360
    near = int(np.argmin(first.ranges))
    assert np.degrees(first.bearings[near]) % 360.0 == 90.0
    ranges = np.frombuffer(scan_of(first, LIDAR, "n7", 5).payload, dtype="<f4")
    assert (ranges[90], ranges[89], ranges[270]) == (1.0, 3.0, 3.0)


def test_no_answer_and_what_it_cannot_see_are_misses():
    one = Turn(np.zeros(4), np.array([np.inf, 0.01, 99.0, np.nan]))
    scan = scan_of(one, LIDAR, "n7", 5)
    assert np.isinf(np.frombuffer(scan.payload, dtype="<f4")).all()
    (seen, *_) = RplidarA1().feed(turn(lambda d: 0.0) + node(0, 1, first=True) * 9)
    assert np.isinf(seen.ranges).all()


def test_bytes_that_come_one_by_one_are_the_same_turn():
    driver, stream = RplidarA1(), DESCRIPTOR + turn() + node(0, 2, first=True)
    found = [one for at in range(len(stream)) for one in driver.feed(stream[at : at + 1])]
    assert [len(one.ranges) for one in found] == [360]
    assert driver.skipped == 0


def test_after_rubbish_the_second_clean_turn_is_right():
    rng = random.Random(3)
    for _ in range(30):
        driver = RplidarA1()
        driver.feed(DESCRIPTOR + turn()[: rng.randrange(1800)] + rng.randbytes(rng.randrange(99)))
        found = driver.feed(turn() * 3)
        assert np.array_equal(found[-1].ranges, np.full(360, 2.0))


def test_a_turn_that_was_joined_in_its_middle_is_not_told():
    found = RplidarA1().feed(turn()[500:] + turn() * 2)
    assert [len(one.ranges) for one in found] == [360]


def test_rubbish_is_never_raised_and_never_kept():
    rng, driver = random.Random(5), RplidarA1()
    for _ in range(500):
        for one in driver.feed(rng.randbytes(200)):
            assert np.all(np.isinf(one.ranges) | (one.ranges < 17.0))
    assert driver.skipped > 50_000
    assert len(driver._buffer) < 50


@pytest.mark.parametrize("name", registry.names(LIDARS))
def test_every_driver_keeps_the_contract(name):
    kind = registry.load(LIDARS, name, "LIDAR", LidarKind)
    driver = kind.open()
    assert driver.begin()
    assert driver.end()
    assert list(driver.feed(b"")) == []
    assert 0.0 < kind.range_min_m < kind.range_max_m


def told(port, now_ns):
    """Return the scans that come; the kernel hands a turn on in pieces, so it is asked again."""
    return next(filter(None, (port.step("n7", now_ns) for _ in range(100))))


def test_over_a_port_it_is_begun_read_and_ended():
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    port = open_lidar(os.ttyname(slave), "rplidar_a1")
    assert port.step("n7", 0) == []
    assert os.read(master, 99) == STOP + PAUSE + SCAN
    os.write(master, DESCRIPTOR + turn() + node(0, 2, first=True))
    (scan,) = told(port, NS_PER_S)
    assert (scan.vehicle, scan.beams, scan.t_ns) == ("n7", 360, NS_PER_S)
    port.close()
    assert os.read(master, 99) == STOP
    os.close(master)
    os.close(slave)


def test_a_turn_lasts_from_the_turn_before_to_its_own():
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    port = open_lidar(os.ttyname(slave), "rplidar_a1")
    port.step("n7", 0)
    os.write(master, DESCRIPTOR + turn() + node(0, 2, first=True))
    (first,) = told(port, NS_PER_S)
    assert (first.sweep_ns, first.period_ns) == (None, None), "nobody knows when it began"
    os.write(master, turn()[5:] + node(0, 2, first=True))
    (second,) = told(port, NS_PER_S + 180_000_000)
    assert (second.sweep_ns, second.period_ns) == (180_000_000, 180_000_000)
    assert second.clockwise
    os.write(master, (turn()[5:] + node(0, 2, first=True)) * 2)
    both = []
    while len(both) < 2:
        both += port.step("n7", NS_PER_S + 580_000_000)
    assert [one.t_ns - NS_PER_S for one in both] in ([380_000_000, 580_000_000], [580_000_000] * 2)
    port.close()
    os.close(master)
    os.close(slave)


def test_the_scanner_is_given_its_millisecond_between_stop_and_scan():
    assert len(PAUSE) * 10 / LIDAR.baud > 0.001
    assert b"\xa5" not in PAUSE


def test_one_that_stays_silent_is_told_to_begin_again_and_that_is_said(caplog):
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    port = open_lidar(os.ttyname(slave), "rplidar_a1")
    port.step("n7", 0)
    os.read(master, 99)
    port.step("n7", 3 * NS_PER_S - 1)
    with pytest.raises(BlockingIOError):
        os.read(master, 99)
    port.step("n7", 3 * NS_PER_S)
    assert os.read(master, 99) == STOP + PAUSE + SCAN
    assert "no turn for 3 s" in caplog.text
    os.write(master, DESCRIPTOR + turn() + node(0, 2, first=True))
    assert told(port, 4 * NS_PER_S)
    assert "none" in caplog.records[-1].getMessage()
    port.step("n7", 7 * NS_PER_S - 1)
    with pytest.raises(BlockingIOError):
        os.read(master, 99)
    port.close()
    os.close(master)
    os.close(slave)


def test_an_unknown_scanner_names_those_there_are():
    with pytest.raises(RunError, match="rplidar_a1"):
        open_lidar("x", "rplidar")
