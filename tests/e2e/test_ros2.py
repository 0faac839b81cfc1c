"""ROS 2 as another team speaks it over Zenoh: it sees our city, and drives a car of it.

The other side is `zenoh_ros2_sdk`, written against rmw_zenoh too. Its keys, tokens, attachments and
type hashes are its own; its CDR is rosbags', as ours. What it would fetch by git, the text of
messages, it is given.
"""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.v2x.router import Router, free_endpoint
from tests.e2e.city_process import wait_for

pytest.importorskip("rosbags", reason="ROS 2 messages are made by rosbags: scm[ros2]")
sdk = pytest.importorskip("zenoh_ros2_sdk", reason="another team's ROS 2 over Zenoh: scm[dev]")

from zenoh_ros2_sdk.discovery import get_topic_info, get_topic_names_and_types  # noqa: E402
from zenoh_ros2_sdk.utils import get_type_hash  # noqa: E402

from scm.ros2 import types  # noqa: E402
from scm.ros2.car import COMMANDS  # noqa: E402

START_S = 60.0  # a cold start compiles the physics
SPEED = 0.15
KINDS = (
    "rosgraph_msgs/Clock", "tf2_msgs/TFMessage", "nav_msgs/Odometry", "sensor_msgs/LaserScan",
    "sensor_msgs/Imu", "sensor_msgs/CompressedImage", "visualization_msgs/MarkerArray",
    *COMMANDS.values(),
)  # fmt: skip
LATCHED = ":1:,1:,:,:,,"
SPEAKER = """
import sys, time
from zenoh_ros2_sdk import ROS2Publisher
talk = ROS2Publisher("/talk", "std_msgs/msg/String", msg_definition="string data\\n",
                     type_hash=sys.argv[2], router_port=int(sys.argv[1]), domain_id=0)
while True:
    talk.publish(data="hello")
    time.sleep(0.1)
"""


def texts(kind):
    """Return the text of a message and of all it is made of, by full name, innermost first."""
    full = kind.replace("/", "/msg/")
    whole, _ = types.store().generate_msgdef(full, ros_version=2)
    first, *others = whole.split("=" * 80 + "\n")
    found = {}
    for part in others:
        head, _, body = part.partition("\n")
        found[head.removeprefix("MSG: ").replace("/", "/msg/")] = body
    return dict(reversed(found.items())) | {full: first}


class RosNode:
    """The other team's side."""

    def __init__(self, endpoint):
        self.port = int(endpoint.rpartition(":")[2])
        self.session = sdk.ZenohSession.get_instance("127.0.0.1", self.port)
        self.ends = []

    def _facts(self, kind):
        full = kind.replace("/", "/msg/")
        told = texts(kind)
        for name, text in told.items():
            if name not in self.session.store.types:
                self.session.register_message_type(text, name)
        needed = {name: text for name, text in told.items() if name != full}
        type_hash = get_type_hash(full, told[full], needed)
        return {
            "msg_type": full, "msg_definition": told[full], "type_hash": type_hash,
            "router_port": self.port, "domain_id": 0,
        }  # fmt: skip

    def hear(self, topic, kind, qos=None):
        got = []
        facts = self._facts(kind)
        self.ends.append(sdk.ROS2Subscriber(topic, callback=got.append, qos=qos, **facts))
        return got

    def speak(self, topic, kind):
        publisher = sdk.ROS2Publisher(topic, **self._facts(kind))
        self.ends.append(publisher)
        return publisher

    def message(self, kind, **fields):
        return self.session.store.types[kind.replace("/", "/msg/")](**fields)

    def topics(self):
        found = get_topic_names_and_types(domain_id=0, router_port=self.port)
        return {topic: kinds for topic, (*kinds,) in found}

    def close(self):
        for end in self.ends:
            end.close()
        self.session.close()


class Stage:
    """A world with one car and the ROS part as processes, an ear on the city's bus."""

    def __init__(self, router):
        self.ros_endpoint = free_endpoint()
        at = ("driving_school", "--connect", router.listen)
        self.children = [
            self._start("world", *at, "--hosted", "1"),
            self._start("ros2", *at, "--ros-listen", self.ros_endpoint),
        ]
        self.bus = ZenohBus("city", "test", router.listen)
        self.box = Mailbox(5000)
        self.bus.subscribe(WorldSnapshot, {}, self.box)
        self.newest = None

    def _start(self, *command):
        return subprocess.Popen([sys.executable, "-m", "scm", *command], stderr=subprocess.PIPE)

    def ready(self):
        for child in self.children:
            if child.poll() is not None:
                raise AssertionError(child.stderr.read().decode())
        return self.car()

    def car(self):
        for item in self.box.drain():
            self.newest = item.message
        return self.newest.vehicles[0] if self.newest and self.newest.vehicles else None

    def close(self):
        self.bus.close()
        for child in self.children:
            child.send_signal(signal.SIGTERM)
        for child in self.children:
            try:
                child.wait(timeout=5.0)
            finally:
                child.kill()
                child.stderr.close()


@pytest.fixture(scope="module")
def stage():
    with Router(free_endpoint()) as router:
        made = Stage(router)
        try:
            wait_for(made.ready, START_S, "the world has a car")
            yield made
        finally:
            made.close()


@pytest.fixture(scope="module")
def node(stage):
    made = RosNode(stage.ros_endpoint)
    try:
        wait_for(lambda: "/n1/odom" in made.topics(), 90.0, "the car's topics are in the graph")
        yield made
    finally:
        made.close()


@pytest.mark.parametrize("kind", KINDS)
def test_another_teams_code_finds_the_same_hash(kind):
    told = texts(kind)
    full = kind.replace("/", "/msg/")
    assert get_type_hash(full, told.pop(full), told) == types.hash_of(kind)


def test_another_teams_tool_lists_our_topics_with_types_and_hashes(node):
    topics = node.topics()
    assert topics == {
        "/clock": ["rosgraph_msgs/msg/Clock"],
        "/tf": ["tf2_msgs/msg/TFMessage"],
        "/tf_static": ["tf2_msgs/msg/TFMessage"],
        "/city/markers": ["visualization_msgs/msg/MarkerArray"],
        "/city/roads": ["visualization_msgs/msg/MarkerArray"],
        "/map": ["nav_msgs/msg/OccupancyGrid"],
        "/n1/map": ["nav_msgs/msg/OccupancyGrid"],
        "/n1/goal_pose": ["geometry_msgs/msg/PoseStamped"],
        "/n1/odom": ["nav_msgs/msg/Odometry"],
        "/n1/scan": ["sensor_msgs/msg/LaserScan"],
        "/n1/imu": ["sensor_msgs/msg/Imu"],
        "/n1/camera/compressed": ["sensor_msgs/msg/CompressedImage"],
        "/n1/cmd_vel": ["geometry_msgs/msg/Twist"],
        "/n1/ackermann_cmd": ["ackermann_msgs/msg/AckermannDrive"],
    }
    odom = get_topic_info("/n1/odom", domain_id=0, router_port=node.port, verbose=True)
    (publisher,) = odom.publishers
    assert publisher.node_name == "scm"
    assert publisher.type_hash == types.hash_of("nav_msgs/Odometry")
    cmd = get_topic_info("/n1/cmd_vel", domain_id=0, router_port=node.port, verbose=True)
    assert (cmd.publisher_count, cmd.subscriber_count) == (0, 1)


def test_its_subscriber_gets_our_messages(stage, node):
    odometry = node.hear("/n1/odom", "nav_msgs/Odometry")
    scans = node.hear("/n1/scan", "sensor_msgs/LaserScan")
    clocks = node.hear("/clock", "rosgraph_msgs/Clock")
    mounts = node.hear("/tf_static", "tf2_msgs/TFMessage", qos=LATCHED)
    wait_for(lambda: odometry and scans and clocks, 60.0, "odometry, a scan and the time arrive")
    assert (odometry[-1].header.frame_id, odometry[-1].child_frame_id) == (
        "n1/odom",
        "n1/base_link",
    )
    scan = scans[-1]
    assert scan.header.frame_id == "n1/laser"
    assert len(scan.ranges) == 360
    hits = scan.ranges[np.isfinite(scan.ranges)]
    assert hits.size
    assert (hits.min() >= 0.15, hits.max() <= 12.5) == (True, True)
    stamp = clocks[-1].clock
    assert abs(stamp.sec - time.time()) < 5.0
    # Published before this node was there: what is latched comes all the same.
    (kept,) = mounts
    assert "n1/laser" in {transform.child_frame_id for transform in kept.transforms}


def test_its_publisher_drives_a_car_and_silence_stops_it(stage, node):
    cmd = node.speak("/n1/cmd_vel", "geometry_msgs/Twist")
    vector = node.message
    assert stage.car().owner == "world"

    def drives():
        cmd.publish(
            linear=vector("geometry_msgs/Vector3", x=SPEED, y=0.0, z=0.0),
            angular=vector("geometry_msgs/Vector3", x=0.0, y=0.0, z=0.1),
        )
        car = stage.car()
        return car.owner == "ros2" and car.speed_mps == pytest.approx(SPEED, rel=0.05)

    cars = []

    def has_settled():
        cars.append(stage.car() if drives() else None)
        return len(cars) > 10 and all(cars[-10:])

    wait_for(has_settled, 60.0, "for half a second the car is the node's, and as fast as it says")
    first, last = cars[-10], stage.car()
    assert np.hypot(last.x_m - first.x_m, last.y_m - first.y_m) > 0.3 * SPEED
    silent = time.monotonic()
    wait_for(lambda: abs(stage.car().speed_mps) < 0.005, 2.0, "the car stands")
    wait_for(lambda: stage.car().owner == "world", 2.0, "the lease is given back")
    assert 0.7 < time.monotonic() - silent < 2.0


def test_ros_nodes_hear_each_other_at_our_router(stage, node):
    got = node.hear("/talk", "std_msgs/String")
    command = [sys.executable, "-c", SPEAKER, str(node.port), types.hash_of("std_msgs/String")]
    with subprocess.Popen(command) as speaker:
        try:
            wait_for(lambda: got, 120.0, "the other node is heard")
        finally:
            speaker.kill()
    assert got[0].data == "hello"
