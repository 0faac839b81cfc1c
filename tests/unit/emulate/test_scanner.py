"""An emulated scanner's bytes, read by the driver of the real one."""

import numpy as np
import pytest

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.vehicles.car import load_car
from vehicle_agent.emulate.pty import Cable
from vehicle_agent.emulate.scanner import Scanner, nodes
from vehicle_agent.lidar_port import open_lidar
from vehicle_agent.lidars.rplidar_a1 import DESCRIPTOR, RplidarA1

NIGEL = load_car("nigel").with_values({"lidar.noise_m": 0.0})
FIRST_WALL_M = 0.975 - 0.7  # of parking_school, behind the rear axle at `start`


def test_bytes_are_those_of_the_makers_protocol():
    assert nodes(0, np.array([1.0]), 4)[0] == 15 << 2 | 1
    assert nodes(1, np.array([1.0]), 4) == bytes.fromhex("3e 01 2d a0 0f")
    turn = nodes(0, np.linspace(1.0, 4.0, 361), 360)
    (found,) = RplidarA1().feed(DESCRIPTOR + turn + nodes(361, np.ones(20), 360))
    assert np.allclose(found.ranges, np.linspace(1.0, 4.0, 361)[:360], atol=2e-4)
    assert np.allclose(np.degrees(found.bearings), -np.arange(360), atol=0.02)


@pytest.fixture
def ports(tmp_path):
    scanner = Scanner(Cable(tmp_path / "lidar"), NIGEL, 1)
    scanner.learn(load_map("parking_school"))
    host = open_lidar(str(tmp_path / "lidar"), "rplidar_a1")
    yield scanner, host
    host.close()
    scanner.close()


def scans(scanner, host, seconds, pose):
    found = []
    for k in range(round(200 * seconds)):
        now_ns = 5 * k * NS_PER_MS
        found += host.step("n7", now_ns)
        scanner.step(now_ns, pose(0.005 * k))
    return found


def ranges_of(scan):
    return np.frombuffer(scan.payload, dtype="<f4")


def test_host_that_begins_a_scan_sees_the_walls_around_the_car(ports):
    found = scans(*ports, 1.0, lambda _: Pose2(-0.7, 0.3, 0.0))
    assert 5 <= len(found) <= 7
    ranges = ranges_of(found[-1])
    x = NIGEL.vector("lidar.position_m")[0]
    assert ranges[180] == pytest.approx(FIRST_WALL_M + x, abs=0.002)
    assert ranges[90] == pytest.approx(0.625 - 0.3, abs=0.002)
    assert ranges[270] == pytest.approx(0.625 + 0.3, abs=0.002)


def test_each_beam_sees_from_where_the_car_is_at_its_time(ports):
    found = scans(*ports, 1.0, lambda t: Pose2(0.3 * t - 0.7, 0.3, 0.0))
    ahead, behind = (np.array([ranges_of(scan)[beam] for scan in found]) for beam in (1, 181))
    assert np.allclose(np.diff(ahead), -0.3 / 7.0, atol=0.003)
    assert np.allclose(np.diff(behind), 0.3 / 7.0, atol=0.003)
    assert np.allclose(ahead + behind, 2.15 - 0.5 * 0.3 / 7.0, atol=0.003), "ahead is last"


def test_scanner_without_a_host_sends_nothing(tmp_path):
    scanner = Scanner(Cable(tmp_path / "lidar"), NIGEL, 1)
    scanner.learn(load_map("parking_school"))
    for k in range(100):
        scanner.step(5 * k * NS_PER_MS, Pose2(0.0, 0.0, 0.0))
    scanner.close()
    assert not (tmp_path / "lidar").exists()
