"""Odometry and scans of any ROS bag are read by name: nobody writes out a quaternion."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from scm.errors import RecordingError
from scm.recording.read import Recording, read_recordings
from tests.unit.recording.made_bag import ODOMETRY, _header

SCAN = "sensor_msgs/msg/LaserScan"
START_NS, STEP_NS, LATE_NS, ROWS = 1_700_000_000_000_000_000, 140_000_000, 200_000_000, 6
YAW, VARIANCE, BEAMS = -2.5, 0.0004, 12
KINDS = ["drive.bag", "drive.db3", "drive.mcap"]
TABLE = """\
recording: 1
vehicle: nigel
tables:
  - file: FILE
    topic: /odom
    time: {column: stamp_s}
    channels: odometry
"""
SCANS = """\
  - file: FILE
    topic: /scan
    time: {column: stamp_s}
    channels: scan
"""


def write(path: Path, variance: float = VARIANCE, beams: int = BEAMS) -> Path:
    """Write a bag of odometry and scans; of the last scan a beam less came back."""
    first = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    types = store.types
    target = path if first else path.with_suffix("")
    plugin = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
    pack = store.serialize_ros1 if first else store.serialize_cdr
    with Writer1(path) if first else Writer2(target, version=9, storage_plugin=plugin) as bag:
        odom, scan = (
            bag.add_connection(topic, kind, typestore=store)
            for topic, kind in (("/odom", ODOMETRY), ("/scan", SCAN))
        )
        for k in range(ROWS):
            t_ns = START_NS + k * STEP_NS
            message = odometry(store, t_ns, float(k), variance)
            bag.write(odom, t_ns + LATE_NS, pack(message, ODOMETRY))
            ranges = np.full(beams - (k == ROWS - 1), 1.0 + k, np.float32)
            message = types[SCAN](
                _header(store, t_ns, "lidar"), -3.0, 3.0, 0.5, 0.001 + 0.0001 * k, 0.14, 0.15, 12.0,
                ranges, np.empty(0, np.float32),
            )  # fmt: skip
            bag.write(scan, t_ns + LATE_NS, pack(message, SCAN))
    return target


def odometry(store, t_ns: int, x: float, variance: float) -> object:
    types = store.types
    vector, place = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Point"]
    turned = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, np.sin(YAW / 2), np.cos(YAW / 2))
    return types[ODOMETRY](
        _header(store, t_ns, "odom"), "base_link",
        types["geometry_msgs/msg/PoseWithCovariance"](
            types["geometry_msgs/msg/Pose"](place(x, 2.0, 0.0), turned), np.full(36, variance)
        ),
        types["geometry_msgs/msg/TwistWithCovariance"](
            types["geometry_msgs/msg/Twist"](vector(0.4, 0.0, 0.0), vector(0.0, 0.0, -0.3)),
            np.zeros(36),
        ),
    )  # fmt: skip


def read(folder: Path, text: str, file: Path) -> Recording:
    (folder / "recording.yaml").write_text(text.replace("FILE", file.name))
    (recording,) = read_recordings(folder)
    return recording


@pytest.mark.parametrize("kind", KINDS)
def test_odometry_gives_pose_speed_and_yaw_rate(tmp_path: Path, kind: str) -> None:
    recording = read(tmp_path, TABLE, write(tmp_path / kind))
    assert set(recording.channels) == {"pose.x", "pose.y", "pose.yaw", "speed", "yaw_rate"}
    assert_allclose(recording.channel("pose.x").values, range(ROWS))
    assert_allclose(recording.channel("pose.x").t, 0.14 * np.arange(ROWS), atol=1e-9)
    for name, value in (("pose.y", 2.0), ("pose.yaw", YAW), ("speed", 0.4), ("yaw_rate", -0.3)):
        assert_allclose(recording.channel(name).values, value)


def test_a_covariance_that_is_given_is_the_noise(tmp_path: Path) -> None:
    recording = read(tmp_path, TABLE, write(tmp_path / "drive.bag"))
    assert recording.channel("pose.x").std == pytest.approx(0.02)
    assert recording.channel("pose.yaw").std == pytest.approx(0.02)
    assert recording.channel("speed").std is None, "a variance of 0 means that it is not known"


@pytest.mark.parametrize("variance", [0.0, -1.0, 1e6, np.nan])
def test_a_covariance_that_says_unknown_is_no_noise(tmp_path: Path, variance: float) -> None:
    recording = read(tmp_path, TABLE, write(tmp_path / "drive.bag", variance))
    assert recording.channel("pose.x").std is None


def test_a_channel_of_odometry_can_be_given_otherwise(tmp_path: Path) -> None:
    own = "{odometry: {point: [0.1, 0.0]}, speed: {sign: -1}, pose.x: {std: 7, unit: mm}}"
    text = TABLE.replace("channels: odometry", f"channels: {own}")
    recording = read(tmp_path, text, write(tmp_path / "drive.bag"))
    assert_allclose(recording.channel("speed").values, -0.4)
    assert recording.channel("pose.x").std == pytest.approx(0.007)
    assert recording.channel("pose.x").point == recording.channel("pose.y").point == (0.1, 0.0)
    assert recording.channel("pose.yaw").values[0] == pytest.approx(YAW)


def test_a_channel_of_odometry_with_a_column_of_its_own_replaces_it(tmp_path: Path) -> None:
    own = "channels: {odometry: {}, pose.x: {column: pose.pose.position.y, unit: cm}}"
    text = TABLE.replace("channels: odometry", own)
    recording = read(tmp_path, text, write(tmp_path / "drive.bag"))
    assert_allclose(recording.channel("pose.x").values, 0.02)
    assert recording.channel("pose.x").std is None


@pytest.mark.parametrize("kind", KINDS)
def test_scans_are_read_as_arrays_beside_the_channels(tmp_path: Path, kind: str) -> None:
    scans = read(tmp_path, TABLE + SCANS, write(tmp_path / kind)).scans
    assert scans is not None
    assert scans.ranges.shape == (ROWS, BEAMS)
    assert_allclose(scans.t, 0.14 * np.arange(ROWS), atol=1e-9)
    assert_allclose(scans.ranges[:, 0], 1.0 + np.arange(ROWS))
    assert_allclose(scans.angle_min, -3.0)
    assert_allclose(scans.angle_increment, 0.5)
    assert_allclose(scans.time_increment, 0.001 + 0.0001 * np.arange(ROWS), rtol=1e-5)
    assert_allclose(scans.range_min, 0.15, rtol=1e-6)
    assert_allclose(scans.range_max, 12.0)


def test_a_scan_of_fewer_beams_is_filled_up_with_nan(tmp_path: Path) -> None:
    scans = read(tmp_path, TABLE + SCANS, write(tmp_path / "drive.bag")).scans
    assert scans is not None
    assert np.isnan(scans.ranges[-1, -1])
    assert np.isfinite(scans.ranges[:-1]).all()


def test_scans_of_two_lidars_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="has the scans of another table too"):
        read(tmp_path, TABLE + SCANS + SCANS, write(tmp_path / "drive.bag"))


def test_where_leaves_scans_out(tmp_path: Path) -> None:
    some = SCANS.replace("    channels", "    where: scan_time > 1\n    channels")
    with pytest.raises(RecordingError, match="no row is left"):
        read(tmp_path, TABLE + some, write(tmp_path / "drive.bag"))


def test_a_recording_without_scans_has_none(tmp_path: Path) -> None:
    assert read(tmp_path, TABLE, write(tmp_path / "drive.bag")).scans is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("channels: odometry", "channels: odometri", "did you mean 'odometry'"),
        ("channels: scan", "channels: {scan: {unit: mm}}", "scan: expected nothing but"),
        ("channels: odometry", "channels: {odometry: {column: x}}", "odometry: expected nothing"),
        ("topic: /scan", "topic: /odom", "/odom.*holds nav_msgs/msg/Odometry.*LaserScan"),
        ("topic: /odom", "topic: /scan", "no column 'pose.pose.position.x'"),
    ],
)
def test_a_shortcut_for_other_messages_is_refused(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    with pytest.raises(RecordingError, match=message):
        read(tmp_path, (TABLE + SCANS).replace(old, new), write(tmp_path / "drive.bag"))


def test_a_scan_needs_a_bag(tmp_path: Path) -> None:
    (tmp_path / "scan.csv").write_text("t,ranges\n0,1\n1,1\n")
    text = TABLE + SCANS.replace("FILE", "scan.csv").replace("    topic: /scan\n", "")
    with pytest.raises(RecordingError, match=r"scan\.csv.*ROS bag"):
        read(tmp_path, text.replace("stamp_s}\n    channels: scan", "t}\n    channels: scan"),
             write(tmp_path / "drive.bag"))  # fmt: skip
