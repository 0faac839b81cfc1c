"""The bytes and keys that rmw_zenoh puts on Zenoh."""

import struct
import sys

import pytest

from scm.errors import MessageError, RunError
from scm.ros2 import types
from scm.ros2.names import (
    Node,
    attachment,
    gid_of,
    qos,
    read_attachment,
    ros_name,
    topic_key,
    type_chunks,
)

NODE = Node(domain=7, zid="a1b2", name="scm")


# As ROS 2 Jazzy's own tools print them.
@pytest.mark.parametrize(
    ("kind", "begins"),
    [
        ("nav_msgs/Odometry", "RIHS01_3cc97dc7"),
        ("sensor_msgs/LaserScan", "RIHS01_64c19139"),
        ("std_msgs/String", "RIHS01_df668c74"),
        ("geometry_msgs/Twist", "RIHS01_9c45bf16"),
    ],
)
def test_a_types_hash_is_that_of_jazzy(kind, begins):
    assert types.hash_of(kind).startswith(begins)
    assert len(types.hash_of(kind)) == len("RIHS01_") + 64


def test_a_topics_key_names_domain_topic_type_and_hash():
    chunks = type_chunks("nav_msgs/Odometry", "RIHS01_3c")
    assert topic_key(7, "/n1/odom", chunks) == "7/n1/odom/nav_msgs::msg::dds_::Odometry_/RIHS01_3c"


def test_a_nodes_token_is_mangled_as_in_the_design():
    assert NODE.token == "@ros2_lv/7/a1b2/0/0/NN/%/%/scm"


def test_an_endpoints_token_ends_in_topic_type_hash_and_quality():
    token = NODE.endpoint_token(3, "MP", "/n1/odom", "std_msgs::msg::dds_::String_/RIHS01_d", qos())
    expected = "@ros2_lv/7/a1b2/0/3/MP/%/%/scm/%n1%odom/std_msgs::msg::dds_::String_/RIHS01_d/::,10"
    assert token == f"{expected}:,:,:,,"


def test_a_latched_topic_says_transient_local():
    assert qos(latched=True, depth=1) == ":1:,1:,:,:,,"


def test_an_attachment_is_33_bytes_of_sequence_time_and_gid():
    raw = attachment(2, 0x0102030405060708, bytes(range(16)))
    assert raw.hex() == "02000000000000000807060504030201" + "10" + bytes(range(16)).hex()
    assert read_attachment(raw) == (2, 0x0102030405060708, bytes(range(16)))


@pytest.mark.parametrize("raw", [b"", bytes(33), attachment(1, 2, bytes(16))[:-1]])
def test_what_is_no_attachment_is_refused(raw):
    with pytest.raises(MessageError, match="expected 33"):
        read_attachment(raw)


def test_each_endpoint_has_a_gid_of_its_own():
    assert gid_of("a") == gid_of("a")
    assert gid_of("a") != gid_of("b")
    assert len(gid_of("a")) == 16


@pytest.mark.parametrize(("vehicle", "name"), [("n1", "n1"), ("red-car", "red_car"), ("3", "v3")])
def test_a_cars_name_becomes_one_that_ros_allows(vehicle, name):
    assert ros_name(vehicle) == name


def test_a_message_goes_to_cdr_and_back():
    message = types.ros("builtin_interfaces/Time", sec=1, nanosec=2)
    raw = types.to_cdr("builtin_interfaces/Time", message)
    assert raw.hex() == "00010000" + "01000000" + "02000000"
    assert types.from_cdr("builtin_interfaces/Time", raw) == message


def test_bytes_that_make_no_message_are_refused():
    with pytest.raises(MessageError, match="geometry_msgs/Twist: 3 bytes"):
        types.from_cdr("geometry_msgs/Twist", b"abc")


def test_without_its_library_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    types.store.cache_clear()
    with pytest.raises(RunError, match=r"scm\[ros2\]"):
        types.store()


def test_a_twist_is_six_doubles_after_the_header():
    def vector(x, y, z):
        return types.ros("geometry_msgs/Vector3", x=x, y=y, z=z)

    twist = types.ros("geometry_msgs/Twist", linear=vector(1, 2, 3), angular=vector(4, 5, 6))
    expected = bytes((0, 1, 0, 0)) + struct.pack("<6d", 1, 2, 3, 4, 5, 6)
    assert types.to_cdr("geometry_msgs/Twist", twist) == expected


def test_text_is_counted_with_its_end_and_padded_to_the_next_number():
    stamp = types.ros("builtin_interfaces/Time", sec=1, nanosec=2)
    header = types.ros("std_msgs/Header", stamp=stamp, frame_id="map")
    point = types.ros("geometry_msgs/Point", x=1.0, y=2.0, z=3.0)
    raw = types.to_cdr(
        "geometry_msgs/PointStamped",
        types.ros("geometry_msgs/PointStamped", header=header, point=point),
    )
    # 16 bytes of time, length and "map" with its zero: doubles can follow at once.
    expected = struct.pack("<iII4s3d", 1, 2, 4, b"map\0", 1.0, 2.0, 3.0)
    assert raw == bytes((0, 1, 0, 0)) + expected
