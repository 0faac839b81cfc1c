"""Types of ROS messages: from the bag, from `.msg` files, or built in."""

from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from scm.errors import RecordingError, nearest, reading
from scm.recording.bag_file import CDR, ROS1, Topic

MAX_FILES = 5000  # .msg files of a folder; all of ROS has some 1000
IDL_PARTS = "=" * 80 + "\n"
# Messages of small cars that older bags hold without their definition, and that are not ROS's own.
KNOWN = {
    "ackermann_msgs/msg/AckermannDrive": """
        float32 steering_angle
        float32 steering_angle_velocity
        float32 speed
        float32 acceleration
        float32 jerk""",
    "ackermann_msgs/msg/AckermannDriveStamped": """
        std_msgs/Header header
        ackermann_msgs/AckermannDrive drive""",
    "vesc_msgs/msg/VescState": """
        float64 temp_fet
        float64 temp_motor
        float64 current_motor
        float64 current_input
        float64 avg_id
        float64 avg_iq
        float64 duty_cycle
        float64 speed
        float64 voltage_input
        float64 charge_drawn
        float64 charge_regen
        float64 energy_drawn
        float64 energy_regen
        int32 displacement
        int32 distance_traveled
        int32 fault_code
        float64 pid_pos_now
        int32 controller_id
        float64 ntc_temp_mos1
        float64 ntc_temp_mos2
        float64 ntc_temp_mos3
        float64 avg_vd
        float64 avg_vq""",
    "vesc_msgs/msg/VescStateStamped": """
        std_msgs/Header header
        vesc_msgs/VescState state""",
}
Types = dict[str, Any]  # of each type its constants and fields, as rosbags has them
Deserialize = Callable[[bytes], Any]


def deserializer(topic: Topic, definitions: Path | None, path: Path) -> Deserialize:
    """Return what makes a message of its bytes.

    Args:
        topic: Whose messages.
        definitions: Folder of `.msg` files, which rank behind what the bag says itself.
        path: Of the bag.

    Raises:
        RecordingError: when the messages are none of ROS, or their type is not known.
    """
    if topic.encoding not in (CDR, ROS1):
        msg = (
            f"{path}: messages of {topic.name!r} are {topic.encoding or 'of no encoding'}, "
            "expected those of ROS (cdr or ros1): write the values as a table"
        )
        raise RecordingError(msg)
    with reading(path, f"the definition of {topic.kind}"):
        store = _store(topic, definitions, path)
    read = store.deserialize_ros1 if topic.encoding == ROS1 else store.deserialize_cdr
    return lambda raw: read(raw, topic.kind)


def _store(topic: Topic, definitions: Path | None, path: Path) -> Typestore:
    if topic.language:
        return _defined(topic.kind, topic.language, topic.definition)
    known: Types = dict(get_typestore(Stores.ROS2_HUMBLE).fielddefs)
    for kind, text in KNOWN.items():
        known.update(get_types_from_msg(text, kind))
    if definitions is not None:
        known.update(_types_of_folder(definitions, topic.kind))
    return _registered(_needed(topic, known, path))


@lru_cache(maxsize=64)
def _defined(kind: str, language: str, definition: str) -> Typestore:
    """Return the types of a definition; parsing one takes as long as reading 1 000 messages."""
    if language == "msg":
        return _registered(get_types_from_msg(definition, kind))
    types: Types = {}
    for part in _idl_parts(definition):
        types.update(get_types_from_idl(part))
    return _registered(types)


def _registered(types: Types) -> Typestore:
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    return store


def _idl_parts(text: str) -> list[str]:
    """Return the definitions of a text, each of which may stand below a line of its name."""
    if not text.startswith(f"{IDL_PARTS}IDL: "):
        return [text]
    return [part.split("\n", 1)[1] for part in text.split(IDL_PARTS)[1:]]


def _types_of_folder(folder: Path, kind: str) -> Types:
    """Return the types that the `.msg` files of a folder define.

    Files below `<package>/msg` are of that package, others of the package of `kind`.
    """
    if not folder.is_dir():
        msg = f"{folder}: definitions: expected a folder of .msg files"
        raise RecordingError(msg)
    types: Types = {}
    files = sorted(folder.rglob("*.msg"))
    if not files or len(files) > MAX_FILES:
        msg = f"{folder}: definitions: expected 1 to {MAX_FILES} .msg files, got {len(files)}"
        raise RecordingError(msg)
    for file in files:
        package = (
            file.parent.parent.name if file.parent.name == "msg" else kind.split("/", maxsplit=1)[0]
        )
        with reading(file, "a definition of a ROS message"):
            text = file.read_text(encoding="utf-8")
            types.update(get_types_from_msg(text, f"{package}/msg/{file.stem}"))
    return types


def _needed(topic: Topic, known: Types, path: Path) -> Types:
    """Return a type and those that it is made of."""
    needed: Types = {}
    left = [topic.kind]
    while left:
        kind = left.pop()
        if kind in needed:
            continue
        if kind not in known:
            part = "" if kind == topic.kind else f", part of {topic.kind},"
            msg = (
                f"{path}: topic {topic.name!r} holds {kind}{part} whose definition is neither in "
                f"the bag nor known here{nearest(kind, list(known))}: give its table the folder "
                "of the .msg files, as `definitions: path/to/msg`"
            )
            raise RecordingError(msg)
        needed[kind] = known[kind]
        left += _named_in(known[kind][1])
    return needed


def _named_in(description: Any) -> Iterator[str]:
    """Yield the names of types in what rosbags knows of a type's fields."""
    if isinstance(description, str):
        if description.count("/") == 2:
            yield description
    elif isinstance(description, list | tuple):
        for part in description:
            yield from _named_in(part)
