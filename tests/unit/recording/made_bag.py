"""Small ROS bags as a car would write them: poses, a joystick, and what gets in the way."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

START_NS = 1_700_000_000_123_456_789
STEP_NS = 20_000_001
LATE_NS = 5_000_003
ROWS = 5
HALF_YAW = 0.25
ODOMETRY, JOY, TEXT = "nav_msgs/msg/Odometry", "sensor_msgs/msg/Joy", "std_msgs/msg/String"


def write_bag(path: Path, *, stamped: bool = True) -> Path:
    """Write `.bag`, or the folder of a ROS 2 bag: `.db3` or `.mcap` in its name say which."""
    if path.suffix == ".bag":
        store = get_typestore(Stores.ROS1_NOETIC)
        with Writer1(path) as writer:
            _write(writer, store, store.serialize_ros1, stamped=stamped)
        return path
    plugin = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
    folder, store = path.with_suffix(""), get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(folder, version=9, storage_plugin=plugin) as writer:
        _write(writer, store, store.serialize_cdr, stamped=stamped)
    return folder / path.name


def _write(writer, store: Typestore, serialize, *, stamped: bool) -> None:
    topics = {"/odom": ODOMETRY, "/joy": JOY, "/said": TEXT}
    connections = {
        topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in topics.items()
    }
    writer.add_connection("/silent", TEXT, typestore=store)
    for t_ns, topic, message in _messages(store, stamped=stamped):
        writer.write(connections[topic], t_ns, serialize(message, topics[topic]))


def _messages(store: Typestore, *, stamped: bool) -> Iterator[tuple[int, str, object]]:
    types = store.types
    twist = types["geometry_msgs/msg/TwistWithCovariance"](
        types["geometry_msgs/msg/Twist"](_vector(types, 1.5), _vector(types, 0.0)), np.zeros(36)
    )
    turned = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, np.sin(HALF_YAW), np.cos(HALF_YAW))
    for k in range(ROWS):
        t_ns = START_NS + k * STEP_NS
        header = _header(store, t_ns if stamped else 0, "map" if k else "odom")
        at = types["geometry_msgs/msg/Point"](float(k), 2.0, 0.0)
        pose = types["geometry_msgs/msg/PoseWithCovariance"](
            types["geometry_msgs/msg/Pose"](at, turned), np.arange(36.0)
        )
        yield t_ns + LATE_NS, "/odom", types[ODOMETRY](header, "base_link", pose, twist)
        axes = np.array([0.1 * k, -0.5], np.float32)[: 1 if k == 2 else 2]
        yield t_ns + LATE_NS, "/joy", types[JOY](header, axes, np.array([1], np.int32))
        yield t_ns + LATE_NS, "/said", types[TEXT]("hello")


def _vector(types, x: float) -> object:
    return types["geometry_msgs/msg/Vector3"](x, 0.0, 0.0)


def _header(store: Typestore, t_ns: int, frame: str) -> object:
    stamp = store.types["builtin_interfaces/msg/Time"](t_ns // 10**9, t_ns % 10**9)
    kind = store.types["std_msgs/msg/Header"]
    numbered = {"seq": 7} if "seq" in kind.__dataclass_fields__ else {}
    return kind(stamp=stamp, frame_id=frame, **numbered)
