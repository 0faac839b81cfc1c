"""Bags as people have them: old, cut off, being written, packed, without metadata."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from numpy.testing import assert_allclose
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from scm.errors import RecordingError
from scm.recording.bag_types import KNOWN
from scm.recording.table import read_table

DRIVE = "ackermann_msgs/msg/AckermannDriveStamped"
OWN = "my_msgs/msg/Wheel"
OWN_PARTS = {"my_msgs/msg/Side": "int8 side\n", OWN: "std_msgs/Header header\nSide at\nfloat32 v\n"}
MANY = 400
WANTED = ["stamp_s", "drive.speed", "drive.steering_angle"]


def store_of(types: dict[str, str], base: Stores = Stores.ROS2_HUMBLE) -> Typestore:
    store = get_typestore(base)
    found = {}
    for kind, text in types.items():
        found.update(get_types_from_msg(text, kind))
    store.register(found)
    return store


def header(store: Typestore, k: int) -> object:
    stamp = store.types["builtin_interfaces/msg/Time"](100 + k // 50, k % 50 * 20_000_000)
    kind = store.types["std_msgs/msg/Header"]
    numbered = {"seq": k} if "seq" in kind.__dataclass_fields__ else {}
    return kind(stamp=stamp, frame_id="", **numbered)


def drives(store: Typestore) -> list[tuple[int, object]]:
    of = store.types["ackermann_msgs/msg/AckermannDrive"]
    rows = [of(0.1, 0.0, k / 10, 0.0, 0.0) for k in range(MANY)]
    return [
        ((100 * 50 + k) * 20_000_000, store.types[DRIVE](header(store, k), row))
        for k, row in enumerate(rows)
    ]


def expect_drives(file: Path, rows: int = MANY) -> None:
    read = read_table(file, "/drive", WANTED)
    assert read.rows == rows
    assert_allclose(read["drive.speed"], np.arange(rows) / 10, rtol=1e-6)
    assert_allclose(read["stamp_s"], 100 + np.arange(rows) / 50)


def write_drives(
    folder: Path,
    plugin: StoragePlugin = StoragePlugin.SQLITE3,
    mode: CompressionMode = CompressionMode.NONE,
) -> Path:
    """Write a bag of commands; return its folder, `drive`."""
    store = store_of(KNOWN)
    writer = Writer2(folder / "drive", version=8, storage_plugin=plugin)
    if mode is not CompressionMode.NONE:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/drive", DRIVE, typestore=store)
        for t_ns, message in drives(store):
            writer.write(connection, t_ns, store.serialize_cdr(message, DRIVE))
    return folder / "drive"


def without_definitions(file: Path) -> None:
    """Make a bag as ROS 2 wrote it before Iron."""
    with closing(sqlite3.connect(file)) as base:
        base.executescript("DROP TABLE message_definitions; DROP TABLE schema; DROP TABLE metadata")


def write_own(folder: Path) -> Path:
    """Write a bag whose type is defined nowhere in it."""
    store = store_of(OWN_PARTS)
    with Writer2(folder / "drive", version=8) as writer:
        connection = writer.add_connection("/wheel", OWN, typestore=store)
        side = store.types["my_msgs/msg/Side"](1)
        for k in range(MANY):
            message = store.types[OWN](header(store, k), side, k / 2)
            writer.write(connection, k * 20_000_000, store.serialize_cdr(message, OWN))
    file = folder / "drive" / "drive.db3"
    without_definitions(file)
    return file


def write_mcap(path: Path, *, encoding: str = "cdr", end: bool = True) -> Path:
    """Write an MCAP file of small chunks."""
    store = store_of(KNOWN)
    with path.open("wb") as stream:
        writer = McapWriter(stream, chunk_size=2000)
        writer.start(profile="ros2", library="test")
        text, _ = store.generate_msgdef(DRIVE, ros_version=2)
        schema = writer.register_schema(
            "ackermann_msgs/msg/AckermannDriveStamped", "ros2msg", text.encode()
        )
        channel = writer.register_channel("/drive", encoding, schema)
        for t_ns, message in drives(store):
            data = bytes(store.serialize_cdr(message, DRIVE))
            writer.add_message(channel, log_time=t_ns, publish_time=t_ns, data=data)
        if end:
            writer.finish()
        else:
            writer.flush()
    return path


def write_ros1(path: Path) -> Path:
    store = store_of(KNOWN, Stores.ROS1_NOETIC)
    writer = Writer1(path)
    writer.chunk_threshold = 2000
    with writer:
        connection = writer.add_connection("/drive", DRIVE, typestore=store)
        for t_ns, message in drives(store):
            writer.write(connection, t_ns, store.serialize_ros1(message, DRIVE))
    return path


def test_common_types_are_known_where_a_bag_defines_none(tmp_path: Path) -> None:
    folder = write_drives(tmp_path)
    without_definitions(folder / "drive.db3")
    expect_drives(folder)
    expect_drives(folder / "drive.db3")


def test_a_type_that_nobody_defines_is_named_with_what_to_give(tmp_path: Path) -> None:
    file = write_own(tmp_path)
    with pytest.raises(RecordingError, match=r"'/wheel' holds my_msgs/msg/Wheel.*definitions: "):
        read_table(file, "/wheel", ["v"])


@pytest.mark.parametrize("below", ["", "my_msgs/msg"])
def test_a_folder_of_definitions_gives_types(tmp_path: Path, below: str) -> None:
    file = write_own(tmp_path)
    folder = tmp_path / "types" / below
    folder.mkdir(parents=True)
    for kind, text in OWN_PARTS.items():
        (folder / f"{kind.split('/')[-1]}.msg").write_text(text)
    read = read_table(file, "/wheel", ["v", "at.side"], definitions=tmp_path / "types")
    assert_allclose(read["v"], np.arange(MANY) / 2)
    assert_allclose(read["at.side"], 1)
    (folder / "Side.msg").unlink()
    with pytest.raises(RecordingError, match="my_msgs/msg/Side, part of my_msgs/msg/Wheel"):
        read_table(file, "/wheel", ["v"], definitions=tmp_path / "types")
    (folder / "Side.msg").write_text("%%%\n")
    with pytest.raises(RecordingError, match=r"Side.msg: not a definition of a ROS message"):
        read_table(file, "/wheel", ["v"], definitions=tmp_path / "types")


def test_a_definition_of_another_version_is_refused(tmp_path: Path) -> None:
    file = write_own(tmp_path)
    (tmp_path / "Wheel.msg").write_text("int32 only\n")
    with pytest.raises(RecordingError, match=r"message 1 of /wheel: no my_msgs/msg/Wheel"):
        read_table(file, "/wheel", ["only"], definitions=tmp_path)


@pytest.mark.parametrize("plugin", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
@pytest.mark.parametrize(
    "mode", [CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE]
)
@pytest.mark.parametrize("metadata", [True, False])
def test_a_bag_is_read_packed_or_not_with_and_without_metadata(
    tmp_path: Path, plugin: StoragePlugin, mode: CompressionMode, metadata: bool
) -> None:
    folder = write_drives(tmp_path, plugin, mode)
    if not metadata:
        (folder / "metadata.yaml").unlink()
    expect_drives(folder)


def test_a_bag_of_several_files_is_read_in_order(tmp_path: Path) -> None:
    folder = write_drives(tmp_path)
    shutil.copyfile(folder / "drive.db3", folder / "drive_1.db3")
    with closing(sqlite3.connect(folder / "drive.db3")) as base, base:
        base.execute("DELETE FROM messages WHERE id > 150")
    with closing(sqlite3.connect(folder / "drive_1.db3")) as base, base:
        base.execute("DELETE FROM messages WHERE id <= 150")
    (folder / "metadata.yaml").unlink()
    expect_drives(folder)


def test_a_file_that_metadata_names_and_is_not_there_is_recorded(tmp_path: Path) -> None:
    folder = write_drives(tmp_path)
    text = (folder / "metadata.yaml").read_text()
    more = text.replace("- drive.db3", "- drive.db3\n  - drive_1.db3")
    assert more != text
    (folder / "metadata.yaml").write_text(more)
    read = read_table(folder, "/drive", WANTED)
    assert read.rows == MANY
    assert "drive_1.db3: metadata.yaml names it" in str(read.left_out[0])


def test_what_a_writer_has_not_merged_is_read(tmp_path: Path) -> None:
    folder = write_drives(tmp_path)
    file = tmp_path / "live.db3"
    shutil.copyfile(folder / "drive.db3", file)
    with closing(sqlite3.connect(file)) as writer:
        writer.execute("PRAGMA journal_mode=WAL")
        writer.execute("PRAGMA wal_autocheckpoint=0")
        row = writer.execute("SELECT topic_id, timestamp, data FROM messages LIMIT 1").fetchone()
        for k in range(5):
            writer.execute(
                "INSERT INTO messages VALUES (?, ?, ?, ?)", (MANY + 1 + k, row[0], 10**12, row[2])
            )
        writer.commit()
        assert read_table(file, "/drive", WANTED).rows == MANY + 5
        kept = tmp_path / "kept"
        kept.mkdir()
        for part in ("live.db3", "live.db3-wal"):
            shutil.copyfile(tmp_path / part, kept / part)
    assert read_table(kept / "live.db3", "/drive", WANTED).rows == MANY + 5


@pytest.mark.parametrize("name", ["drive.mcap", "drive.bag", "drive.bag.active"])
@pytest.mark.parametrize("share", [0.3, 0.7, 0.97])
def test_a_bag_that_is_cut_off_is_read_as_far_as_it_is_whole(
    tmp_path: Path, name: str, share: float
) -> None:
    file = (write_mcap if name.endswith("mcap") else write_ros1)(
        tmp_path / name.removesuffix(".active")
    )
    whole = file.read_bytes()
    file.unlink()
    (tmp_path / name).write_bytes(whole[: int(share * len(whole))])
    read = read_table(tmp_path / name, "/drive", WANTED)
    assert share * MANY * 0.4 < read.rows <= MANY
    assert_allclose(read["drive.speed"], np.arange(read.rows) / 10, rtol=1e-6)
    assert "cut off, or still being written" in str(read.left_out[0])


def test_a_bag_that_is_being_written_is_read(tmp_path: Path) -> None:
    file = write_mcap(tmp_path / "drive.mcap", end=False)
    read = read_table(file, "/drive", WANTED)
    assert read.rows > 0.9 * MANY
    assert "still being written" in str(read.left_out[0])


def test_a_database_that_is_cut_off_is_read_or_refused_in_words(tmp_path: Path) -> None:
    file = write_drives(tmp_path) / "drive.db3"
    whole = file.read_bytes()
    for share in (0.1, 0.5, 0.9):
        file.write_bytes(whole[: int(share * len(whole))])
        try:
            read = read_table(file, "/drive", WANTED)
        except RecordingError as error:
            assert str(file) in str(error)  # noqa: PT017
        else:
            assert read.rows < MANY
            assert "damaged" in str(read.left_out[0])


def test_messages_of_another_encoding_are_refused(tmp_path: Path) -> None:
    file = write_mcap(tmp_path / "drive.mcap", encoding="protobuf")
    with pytest.raises(RecordingError, match="messages of '/drive' are protobuf, expected"):
        read_table(file, "/drive", WANTED)
