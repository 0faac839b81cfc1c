"""The ROS side of the bridge on a real Zenoh: who may listen, what arrives, what is kept."""

import json
import time

import pytest
import zenoh

from scm.errors import AccessError, LinkError, RunError
from scm.ros2 import types
from scm.ros2.names import read_attachment
from scm.ros2.wire import Received, Wire
from scm.v2x.router import free_endpoint

STRING = "std_msgs/String"
KEY = "3/talk/std_msgs::msg::dds_::String_/" + types.hash_of(STRING)

pytestmark = pytest.mark.usefixtures("lasting_links")


def text(data):
    return types.ros(STRING, data=data)


def soon(condition):
    deadline = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture
def endpoint():
    return free_endpoint()


@pytest.fixture
def wire(endpoint):
    with Wire(endpoint, domain=3) as made:
        yield made


@pytest.fixture
def peer(wire, endpoint):
    off = {"multicast": {"enabled": False}}
    config = {"mode": "peer", "scouting": off, "connect": {"endpoints": [endpoint]}}
    config["listen"] = {"endpoints": ["tcp/127.0.0.1:0"]}
    with zenoh.open(zenoh.Config.from_json5(json.dumps(config))) as session:
        yield session


def test_it_listens_on_this_machine_alone():
    with pytest.raises(AccessError, match="everybody on the network"):
        Wire("tcp/0.0.0.0:7448")


def test_two_cannot_listen_at_one_place(wire, endpoint):
    with pytest.raises(RunError, match="another router"):
        Wire(endpoint)


def test_without_a_router_to_join_it_says_so(monkeypatch):
    monkeypatch.setattr("scm.ros2.wire.CONNECT_S", 0.2)
    with pytest.raises(LinkError, match="rmw_zenohd"):
        Wire(free_endpoint(), listen=False)


def test_what_is_published_carries_its_number_time_and_sender(wire, peer):
    topic = wire.publisher("/talk", STRING)
    assert not topic.is_wanted
    got = []
    received = zenoh.handlers.Callback(got.append, indirect=False)
    subscriber = peer.declare_subscriber(KEY, received)
    soon(lambda: topic.is_wanted)
    topic.publish(text("one"), 11)
    topic.publish(text("two"), 22)
    soon(lambda: len(got) == 2)
    subscriber.undeclare()
    assert types.from_cdr(STRING, got[1].payload.to_bytes()).data == "two"
    first, second = (read_attachment(sample.attachment.to_bytes()) for sample in got)
    assert (first[:2], second[:2]) == ((1, 11), (2, 22))
    assert first[2] == second[2]


def test_what_arrives_is_read_and_what_cannot_be_is_dropped(wire, peer):
    wire.subscribe("/talk", STRING)
    publisher = peer.declare_publisher(KEY)
    soon(lambda: publisher.matching_status.matching)
    publisher.put(b"nonsense")
    publisher.put(types.to_cdr(STRING, text("hello")))
    received = []
    soon(lambda: received.extend(wire.received()) or received)
    assert received == [Received("/talk", text("hello"))]
    assert wire.rejected == 1
    publisher.undeclare()


def test_an_end_leaves_the_graph(wire, peer):
    def tokens():
        replies = peer.liveliness().get("@ros2_lv/3/**")
        return sorted(str(reply.ok.key_expr).split("/")[5] for reply in replies)

    topic = wire.publisher("/talk", STRING)
    wire.subscribe("/talk", STRING)
    soon(lambda: tokens() == ["MP", "MS", "NN"])
    topic.close()
    soon(lambda: tokens() == ["MS", "NN"])
