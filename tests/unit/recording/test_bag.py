"""ROS 1 and ROS 2 bags are tables: a topic's messages the rows, their fields the columns."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from scm.errors import RecordingError
from scm.recording import columns as limits
from scm.recording.read import Recording, read_recordings
from scm.recording.table import read_table
from tests.unit.recording.made_bag import HALF_YAW, LATE_NS, ROWS, START_NS, STEP_NS, write_bag

POSES = """\
  - file: FILE
    topic: /odom
    time: {column: stamp_s}
    where: "header.frame_id == 'map'"
    channels:
      pose.x: {column: pose.pose.position.x, unit: m}
      pose.y: {expression: "pose.pose.position.y + pose.covariance[1]", unit: m}
      pose.yaw:
        expression: "2 * atan2(pose.pose.orientation.z, pose.pose.orientation.w)"
        unit: rad
"""
COMMANDS = """\
  - file: FILE
    topic: /joy
    time: {column: received_s}
    channels:
      command.throttle: {column: "axes[0]"}
      command.steering: {column: "axes[1]"}
"""
KINDS = ["drive.bag", "drive.db3", "drive.mcap"]


def described(folder: Path, tables: str, file: Path) -> Path:
    text = f"recording: 1\nvehicle: nigel\ntables:\n{tables}"
    path = folder / "recording.yaml"
    path.write_text(text.replace("FILE", file.relative_to(folder).as_posix()))
    return path


def read_one(folder: Path, tables: str, file: Path) -> Recording:
    (recording,) = read_recordings(described(folder, tables, file))
    return recording


@pytest.mark.parametrize("kind", [*KINDS, "folder of drive.db3", "folder of drive.mcap"])
def test_poses_and_commands_of_a_bag_become_channels(tmp_path: Path, kind: str) -> None:
    file = write_bag(tmp_path / kind.rsplit(maxsplit=1)[-1])
    file = file.parent if kind.startswith("folder") else file
    recording = read_one(tmp_path, POSES + COMMANDS, file)
    assert_allclose(recording.channel("pose.x").values, range(1, ROWS))
    assert_allclose(recording.channel("pose.y").values, 3.0)
    assert_allclose(recording.channel("pose.yaw").values, 2 * HALF_YAW)
    throttle, steering = (recording.channel(f"command.{c}") for c in ("throttle", "steering"))
    assert_allclose(throttle.values, [0.0, 0.1, 0.2, 0.3, 0.4], atol=1e-7)
    assert len(steering.values) == ROWS - 1, "the message without a second axis is left out"


@pytest.mark.parametrize("kind", KINDS)
def test_times_are_kept_to_the_nanosecond(tmp_path: Path, kind: str) -> None:
    recording = read_one(tmp_path, POSES + COMMANDS, write_bag(tmp_path / kind))
    stamped, received = recording.channel("pose.x").t, recording.channel("command.throttle").t
    since_ns = START_NS % 10**9 + STEP_NS * np.arange(ROWS)
    assert_array_equal(np.round(stamped * 1e9), since_ns[1:])
    assert_array_equal(np.round(received * 1e9), since_ns + LATE_NS)


def test_a_table_of_rough_times_is_counted_from_the_same_instant(tmp_path: Path) -> None:
    (tmp_path / "volts.csv").write_text(f"t,u\n{START_NS / 1e9},7.5\n{START_NS / 1e9 + 1},7.4\n")
    volts = """\
  - file: volts.csv
    time: {column: t, unit: s}
    channels:
      battery.voltage: {column: u, unit: V}
"""
    recording = read_one(tmp_path, POSES + volts, write_bag(tmp_path / "drive.bag"))
    began_s = START_NS % 10**9 / 1e9
    assert_allclose(recording.channel("battery.voltage").t, [began_s, began_s + 1], atol=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("topic: /odom", "topic: /odm", "no topic '/odm' (did you mean '/odom'?)"),
        ("    topic: /odom\n", "", "needs a topic, one of /joy, /odom, /said, /silent"),
        ("topic: /odom", "topic: /silent", "topic '/silent' holds no messages"),
        ("position.x", "positon.x", "(did you mean 'pose.pose.position.x'?)"),
        ("pose.pose.position.x", "pose.pose", "no column 'pose.pose' (did you mean"),
        ("pose.pose.position.x", "pose.covariance.size", "no column 'pose.covariance.size'"),
        ("column: stamp_s", "column: recieved_s", "(did you mean 'received_s'?)"),
        ("covariance[1]", "covariance[99]", "no column 'pose.covariance[99]'"),
        ("pose.pose.position.x", "header.frame_id", "line 1, column 'header.frame_id': got 'odom'"),
    ],
)
def test_what_a_bag_has_not_is_refused_with_what_it_has(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    file = write_bag(tmp_path / "drive.bag")
    with pytest.raises(RecordingError) as error:
        read_one(tmp_path, POSES.replace(old, new), file)
    assert said in str(error.value)
    assert "drive.bag" in str(error.value)


def test_a_bag_is_no_description(tmp_path: Path) -> None:
    with pytest.raises(
        RecordingError, match=r"drive\.bag: a file of data: give the recording.yaml"
    ):
        read_recordings(write_bag(tmp_path / "drive.bag"))


def test_stamps_that_nobody_set_are_refused(tmp_path: Path) -> None:
    file = write_bag(tmp_path / "drive.bag", stamped=False)
    with pytest.raises(RecordingError, match="stamp_s is 0 in every message: use received_s"):
        read_one(tmp_path, POSES, file)


def test_a_topic_of_a_file_that_is_no_bag_is_refused(tmp_path: Path) -> None:
    (tmp_path / "pose.csv").write_text("t,x\n0,1\n")
    with pytest.raises(RecordingError, match="no ROS bag: it has no topic '/odom'"):
        read_one(tmp_path, POSES, tmp_path / "pose.csv")


def test_a_topic_that_is_too_large_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = write_bag(tmp_path / "drive.bag")
    monkeypatch.setattr(limits, "MAX_BYTES", 200)
    with pytest.raises(RecordingError, match=r"topic '/odom' holds more than .* split it"):
        read_table(file, "/odom")
    assert read_table(file, "/said", ["data"]).rows == ROWS, "another topic is small enough"


def test_the_names_of_a_bag_are_all_its_numbers(tmp_path: Path) -> None:
    columns = read_table(write_bag(tmp_path / "drive.bag"), "/joy")
    assert {*columns} == {
        "received_s", "stamp_s", "header.seq", "header.stamp", "header.frame_id",
        "axes[0]", "axes[1]", "buttons[0]",
    }  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_bag_is_refused_in_a_sentence(tmp_path: Path, kind: str) -> None:
    file = write_bag(tmp_path / kind)
    whole = file.read_bytes()
    dice = np.random.default_rng(1)
    for number in range(60):
        torn = bytearray(whole[: dice.integers(len(whole))] if number % 3 == 0 else whole)
        for at in dice.integers(len(torn) or 1, size=number % 3 * 8):
            torn[at : at + 1] = dice.bytes(1)
        file.write_bytes(torn)
        try:
            assert read_table(file, "/odom", ["pose.pose.position.x"]).rows <= ROWS
        except RecordingError as error:
            assert str(error).startswith(f"{file}: ")  # noqa: PT017  damage may go unnoticed
            assert "\n" not in str(error)  # noqa: PT017
