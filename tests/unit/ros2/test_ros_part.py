"""The part beside a real world on a stepped clock: what ROS nodes get, and how they drive."""

import math

import numpy as np
import pytest
from msgspec.structs import replace
from numpy.testing import assert_allclose

from scm.geometry import Pose2
from scm.maps.coordinates import pose_at
from scm.maps.load import load_map
from scm.records.signals import SignalGroup
from scm.ros2 import markers
from scm.ros2.frames import header, pose, vector
from scm.ros2.part import RosPart
from scm.ros2.types import ros, to_cdr
from scm.runtime.part import Subscription
from scm.traffic.signals.part import TrafficPart
from scm.v2x.exchange import Incoming
from scm.v2x.message import Refused
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot
from scm.vehicles.car import load_car
from tests.unit.ros2.conftest import RosCity

SPEED = 0.15


def twist(speed, rate=0.0):
    return ros("geometry_msgs/Twist", linear=vector(speed, 0), angular=vector(0, 0, rate))


class Driven:
    """Says a command ten times a second, and looks at the first car."""

    def __init__(self, city):
        self.city = city
        self.box = city.lockstep.subscribe(Subscription(WorldSnapshot))
        self.commands = city.lockstep.subscribe(Subscription(DriveCommand))

    def drive(self, span_s, speed=SPEED, rate=0.0):
        for _ in range(round(span_s * 10)):
            self.city.graph.say("/n1/cmd_vel", twist(speed, rate))
            self.city.lockstep.run_for(0.1)
        return self.car()

    def silent(self, span_s):
        self.city.lockstep.run_for(span_s)
        return self.car()

    def car(self):
        return self.box.drain()[-1].message.vehicles[0]


@pytest.fixture
def driven(city):
    return Driven(city)


def test_every_car_has_its_topics(city):
    kinds = {topic: noted.kind for topic, noted in city.graph.topics.items()}
    assert kinds["/n2/odom"] == "nav_msgs/Odometry"
    assert kinds["/n2/camera/compressed"] == "sensor_msgs/CompressedImage"
    assert {t for t, noted in city.graph.topics.items() if noted.latched} == {
        "/tf_static",
        "/city/roads",
        "/map",
    }
    assert set(city.graph.ears) == {
        f"/{car}/{topic}"
        for car in ("n1", "n2")
        for topic in ("cmd_vel", "ackermann_cmd", "goal_pose")
    }


def test_a_car_that_leaves_takes_its_topics_along(city):
    city.lockstep.call(RemoveRequest(vehicle="n2"))
    city.lockstep.run_for(0.2)
    assert {t for t, noted in city.graph.topics.items() if noted.closed} == {
        "/n2/odom", "/n2/scan", "/n2/imu", "/n2/camera/compressed", "/n2/map",
    }  # fmt: skip
    assert all(city.graph.ears[f"/n2/{t}"].closed for t in ("cmd_vel", "ackermann_cmd"))
    frames = {m.header.frame_id for m in city.graph.sent("/tf_static")[-1].transforms}
    assert frames == {"n1/base_link", "n1/camera"}


def test_the_clock_ticks_with_the_city(city):
    before = len(city.graph.sent("/clock"))
    city.lockstep.run_for(1.0)
    ticks = city.graph.sent("/clock")
    assert len(ticks) - before == 20
    assert ticks[-1].clock.sec + ticks[-1].clock.nanosec / 1e9 == pytest.approx(1.3, abs=0.051)


def test_what_nobody_subscribes_to_is_not_made(city):
    city.lockstep.run_for(1.0)
    for topic in ("odom", "scan", "imu", "camera/compressed"):
        assert city.graph.sent(f"/n1/{topic}") == []
    assert city.graph.sent("/city/markers") == []
    assert [one.kind for one in city.ros.subscriptions] == [WorldSnapshot]


def test_a_scan_is_asked_for_of_the_car_that_is_looked_at(city):
    city.graph.wanted = {"/n1/scan"}
    city.lockstep.run_for(1.0)
    assert Subscription(LidarScan, {"vehicle": "n1"}) in city.ros.subscriptions
    assert Subscription(LidarScan, {"vehicle": "n2"}) not in city.ros.subscriptions
    scans = city.graph.sent("/n1/scan")
    assert 4 <= len(scans) <= 7  # 7 Hz, from the next look on
    assert len(scans[-1].ranges) == 360
    assert scans[-1].scan_time == pytest.approx(1 / 7)


def test_odometry_comes_twenty_times_a_second(city):
    city.graph.wanted = {"/n1/odom"}
    city.lockstep.run_for(0.5)
    before = len(city.graph.sent("/n1/odom"))
    city.lockstep.run_for(2.0)
    assert len(city.graph.sent("/n1/odom")) - before == pytest.approx(40, abs=1)


def test_the_chain_of_frames_ends_at_the_cars_pose(driven):
    driven.city.graph.wanted = {"/tf"}
    car = driven.drive(3.0, rate=0.2)
    by_child = {t.child_frame_id: t for t in driven.city.graph.sent("/tf")[-1].transforms}
    outer, inner = by_child["n1/odom"], by_child["n1/base_link"]
    assert (outer.header.frame_id, inner.header.frame_id) == ("map", "n1/odom")

    def floor(message):
        at, turn = message.transform.translation, message.transform.rotation
        return at.x, at.y, 2.0 * math.atan2(turn.z, turn.w)

    (ox, oy, oyaw), (ix, iy, iyaw) = floor(outer), floor(inner)
    x = ox + math.cos(oyaw) * ix - math.sin(oyaw) * iy
    y = oy + math.sin(oyaw) * ix + math.cos(oyaw) * iy
    # The newest transform is at most 60 ms older than the snapshot: 9 mm at this speed.
    assert_allclose((x, y, oyaw + iyaw), (car.x_m, car.y_m, car.yaw_rad), atol=0.015)
    # And `odom` itself stands still, as long as nothing corrects the car's pose.
    first = next(
        t for t in driven.city.graph.sent("/tf")[0].transforms if t.child_frame_id == "n1/odom"
    )
    assert_allclose((ox, oy), floor(first)[:2], atol=0.004)


def test_a_twist_drives_the_car_at_its_speed_and_rate(driven):
    car = driven.drive(3.0, rate=0.3)
    assert (car.owner, car.mode) == ("ros2", "drive")
    assert {item.message.vehicle for item in driven.commands.drain()} == {"n1"}
    assert car.speed_mps == pytest.approx(SPEED, rel=0.03)
    # Wheelbase 0.14154 m, 2 rad/m.
    assert car.steering_rad == pytest.approx(math.atan(0.14154 * 0.3 / SPEED), abs=0.01)


def goal(x, y, yaw, frame="map"):
    return ros(
        "geometry_msgs/PoseStamped", header=header(0, frame), pose=pose(Pose2(x, y, yaw))
    )  # fmt: skip


def test_goal_pose_becomes_a_request_to_park(graph, caplog):
    part = RosPart(load_map("driving_school"), graph)
    part.step(0, [Incoming(snapshot(row("n1")), 0)])
    graph.say("/n1/goal_pose", goal(0.5, -0.25, 1.0))
    (call,) = part.step(1, [])
    assert call.request.vehicle == "n1"
    place = pose_at(call.request.goal)
    assert tuple(place) == pytest.approx((0.5, -0.25, 1.0), abs=1e-4)
    graph.say("/n1/goal_pose", goal(0.5, -0.25, 1.0, frame="n1/odom"))
    assert part.step(2, []) == []
    assert "expected the frame map, got 'n1/odom'" in caplog.text
    part.step(3, [Incoming(Refused(code="offline", detail="nobody parks n1"), 0, call=call)])
    assert "nobody parks n1" in caplog.text


def test_map_of_the_city_shows_its_walls_and_mapped_boxes(graph):
    city_map = load_map("parking_school_obstacles")
    hidden = replace(city_map.boxes[0], mapped=False)
    part = RosPart(replace(city_map, boxes=(hidden, city_map.boxes[1])), graph)
    part.step(0, [])
    (grid,) = graph.sent("/map")
    cells = grid.data.reshape(grid.info.height, grid.info.width)

    def cell(x, y):
        at, size = grid.info.origin.position, grid.info.resolution
        return cells[int((y - at.y) / size), int((x - at.x) / size)]

    assert cell(-0.99, 0.1) == 100  # the left wall
    assert cell(0.7, -0.31) == 100  # the front of the box on the right
    assert cell(0.7, 0.31) == 0
    assert cell(0.0, 0.0) == 0


def test_map_that_a_car_makes_is_an_occupancy_grid(graph):
    part = RosPart(load_map("driving_school"), graph)
    part.step(0, [Incoming(snapshot(row("n1")), 0)])
    cells = np.array([[0, 100, -1], [0, 0, 100]], np.int8)
    room = OccupancyMap(
        vehicle="n1", t_ns=7, rows=2, columns=3, cell_m=0.05, x_m=-1.0, y_m=2.0, car_x_m=0.0,
        car_y_m=0.0, car_yaw_rad=0.0, state="map", payload=cells.tobytes(),
    )  # fmt: skip
    part.step(1, [Incoming(room, 0)])
    (grid,) = graph.sent("/n1/map")
    assert (grid.info.width, grid.info.height, grid.info.resolution) == (3, 2, 0.05)
    assert (grid.info.origin.position.x, grid.info.origin.position.y) == (-1.0, 2.0)
    assert grid.data.tolist() == cells.ravel().tolist()


def test_it_drives_backwards(driven):
    assert driven.drive(2.0, speed=-0.1).speed_mps == pytest.approx(-0.1, rel=0.05)


def test_an_ackermann_command_drives_the_car(driven):
    command = ros(
        "ackermann_msgs/AckermannDrive", steering_angle=-0.2, steering_angle_velocity=0,
        speed=0.1, acceleration=0, jerk=0,
    )  # fmt: skip
    for _ in range(20):
        driven.city.graph.say("/n1/ackermann_cmd", command)
        driven.silent(0.1)
    car = driven.silent(0.1)
    assert car.speed_mps == pytest.approx(0.1, rel=0.05)
    assert car.steering_rad == pytest.approx(-0.2, abs=0.01)


def test_more_than_the_car_can_is_its_limit(driven):
    driven.drive(1.0, speed=5.0, rate=90.0)
    last = driven.commands.drain()[-1].message
    assert (last.throttle, last.steering) == (1.0, 1.0)


def test_commands_go_out_at_twenty_hertz(driven):
    driven.drive(0.5)
    driven.commands.drain()
    driven.drive(2.0)
    sent = [item.message for item in driven.commands.drain()]
    # Six renewals take a step of 10 ms each from the 40.
    assert 37 <= len(sent) <= 41
    assert [m.seq for m in sent] == list(range(sent[0].seq, sent[0].seq + len(sent)))


def test_silence_takes_the_throttle_then_stops_then_gives_the_car_back(driven):
    driven.drive(2.0)
    driven.commands.drain()
    car = driven.silent(0.7)
    assert driven.commands.drain()[-1].message.throttle == 0.0
    assert car.owner == "ros2"
    car = driven.silent(0.5)
    assert car.owner == "world"
    assert abs(car.speed_mps) < 0.001
    driven.commands.drain()
    driven.silent(1.0)
    assert driven.commands.drain() == []


def test_a_car_that_somebody_else_drives_is_not_touched(driven):
    request = LeaseRequest(vehicle="n1", owner="operator", verb="acquire", ttl_ms=60_000)
    assert isinstance(driven.city.lockstep.call(request), LeaseReply)
    car = driven.drive(0.5)
    assert driven.commands.drain() == []
    assert car.owner == "operator"


def test_who_takes_the_car_over_is_not_fought_for_it(driven):
    driven.drive(1.0)
    theft = LeaseRequest(
        vehicle="n1", owner="operator", verb="steal", reason="it drifts", ttl_ms=60_000
    )
    stolen = driven.city.lockstep.call(theft)
    driven.drive(0.5)
    back = LeaseRequest(vehicle="n1", owner="operator", verb="release", epoch=stolen.epoch)
    assert not isinstance(driven.city.lockstep.call(back), Refused)
    assert driven.drive(2.0).owner == "world"  # the node never let go
    driven.silent(1.2)
    assert driven.drive(0.5).owner == "ros2"


def test_a_stopped_city_stops_it_too(driven):
    driven.drive(1.0)
    stop = StopRequest(engaged=True, by="test", reason="test")
    assert isinstance(driven.city.lockstep.call(stop), CityStop)
    car = driven.drive(1.0)
    assert abs(car.speed_mps) < 0.001
    assert car.mode == "stop"


def test_at_its_end_it_gives_the_car_back(driven):
    driven.drive(1.0)
    driven.city.lockstep.remove(driven.city.ros)
    assert driven.silent(0.2).owner == "world"


def test_cars_boxes_and_lamps_are_drawn():
    made = RosCity(more=[TrafficPart(RosCity().ros._map)])
    with made.lockstep as lockstep:
        made.graph.wanted = {"/city/markers"}
        lockstep.run_for(2.0)
        drawn = made.graph.sent("/city/markers")[-1]
    by_space = {}
    for marker in drawn.markers:
        by_space.setdefault(marker.ns, []).append(marker)
    assert [m.text for m in by_space["names"]] == ["n1", "n2"]
    assert_allclose((by_space["cars"][0].scale.x, by_space["cars"][0].scale.y), (0.3, 0.175))
    lamps = by_space["signals"]
    assert len(lamps) == len(made.ros._map.lights)
    reds = [m for m in lamps if m.color.r > 0.8 and m.color.g < 0.2]
    assert reds
    # Red is the topmost of three lamps 5 cm apart, the lowest 16 cm above the floor.
    assert_allclose([m.pose.position.z for m in reds], 0.26)
    assert len(to_cdr("visualization_msgs/MarkerArray", drawn)) > 1000


def test_the_roads_are_drawn_once_for_all(city):
    city.lockstep.run_for(1.0)
    (drawn,) = city.graph.sent("/city/roads")
    lanes = next(m for m in drawn.markers if m.ns == "lanes")
    assert (lanes.lifetime.sec, lanes.lifetime.nanosec) == (0, 0)
    points = np.array([(p.x, p.y) for p in lanes.points])
    floor = city.ros._map.floor
    assert len(points) % 2 == 0
    # Lines of a hand's breadth, all of them on the floor.
    assert np.hypot(*(points[1::2] - points[::2]).T).max() < 0.5
    assert points[:, 0].min() >= floor.x_m[0]
    assert points[:, 0].max() <= floor.x_m[1]


def row(vehicle, car="nigel"):
    return SnapshotVehicle(
        vehicle=vehicle, kind="real", car=car, tag_id=1, x_m=1.0, y_m=0.0, yaw_rad=math.pi / 2,
        speed_mps=0.0, steering_rad=0.0,
    )  # fmt: skip


def snapshot(*rows, t_ns=0):
    return WorldSnapshot(t_ns=t_ns, tick=0, vehicles=rows)


@pytest.mark.parametrize("other", [row("a_b"), row("stranger", car="spaceship")])
def test_a_car_that_ros_cannot_show_is_left_out_and_told_of(graph, caplog, other):
    part = RosPart(load_map("driving_school"), graph)
    for _ in range(2):
        part.step(0, [Incoming(snapshot(row("a-b"), other), 0)])
    shown = [topic for topic in graph.topics if topic.endswith("/odom")]
    assert shown == ["/a_b/odom"]
    assert caplog.text.count("ros_car_not_shown") == 1
    assert other.vehicle in caplog.text


def test_a_car_is_drawn_about_its_middle():
    city_map = load_map("driving_school")
    drawn = markers.moving(city_map, snapshot(row("n1")), {}, {"nigel": load_car("nigel")})
    at = next(m for m in drawn.markers if m.ns == "cars").pose.position
    # 8 cm ahead of the rear axle at (1, 0), looking along y.
    assert_allclose((at.x, at.y), (1.0, 0.08), atol=1e-9)


@pytest.mark.parametrize(("t_ns", "are_lit"), [(0, True), (500_000_000, False)])
def test_flashing_lamps_flash(t_ns, are_lit):
    city_map = load_map("driving_school")
    light = city_map.lights[0]
    flashing = SignalGroup(group=light.group, colour="flashing_red", since_ns=0, min_end_ns=0)
    spat = Spat(
        junction=light.junction, t_ns=0, seq=0, mode="flash", plan="calm", groups=(flashing,)
    )
    drawn = markers.moving(city_map, snapshot(t_ns=t_ns), {spat.junction: spat}, {})
    lamps = {m.id for m in drawn.markers if m.ns == "signals"}
    assert (light.light_id in lamps) == are_lit
