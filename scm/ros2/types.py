"""Messages of ROS 2 Jazzy: created, hashed, and encoded as CDR and back, by `rosbags`.

A type is named by package and name: `nav_msgs/Odometry`.
"""

from functools import cache
from typing import Any

from scm.errors import MessageError, RunError

_MORE = {
    "ackermann_msgs/AckermannDrive": (
        "float32 steering_angle\nfloat32 steering_angle_velocity\n"
        "float32 speed\nfloat32 acceleration\nfloat32 jerk\n"
    ),
}


@cache
def store() -> Any:
    """Return the store of all known types.

    Raises:
        RunError: when the library is not installed.
    """
    try:
        from rosbags.typesys import (  # noqa: PLC0415  an extra, needed only for ROS 2
            Stores,
            get_types_from_msg,
            get_typestore,
        )
    except ModuleNotFoundError as cause:
        msg = "ROS 2 needs rosbags, which is not installed: pip install 'scm[ros2]'"
        raise RunError(msg) from cause
    types = get_typestore(Stores.ROS2_JAZZY)
    for kind, text in _MORE.items():
        types.register(get_types_from_msg(text, _full(kind)))
    return types


@cache
def hash_of(kind: str) -> str:
    """Return a type's hash, `RIHS01_` and 64 hex digits."""
    return str(store().hash_rihs01(_full(kind)))


def ros(kind: str, **fields: Any) -> Any:
    """Return a new message; all fields are given, with ROS's names and units."""
    return _class_of(kind)(**fields)


def constant(kind: str, name: str) -> int:
    """Return a constant of a type, such as `CUBE` of a marker."""
    return int(getattr(_class_of(kind), name))


def to_cdr(kind: str, message: Any) -> bytes:
    """Return a message's bytes: little-endian CDR after a header of four bytes."""
    return bytes(store().serialize_cdr(message, _full(kind)))


def from_cdr(kind: str, raw: bytes) -> Any:
    """Return the decoded message.

    Raises:
        MessageError: when the bytes are not a message of this type.
    """
    try:
        return store().deserialize_cdr(raw, _full(kind))
    except Exception as cause:  # the library raises many kinds of errors when decoding
        msg = f"{kind}: {len(raw)} bytes cannot be read: {type(cause).__name__}: {cause}"
        raise MessageError(msg) from cause


@cache
def _class_of(kind: str) -> Any:
    return store().types[_full(kind)]


def _full(kind: str) -> str:
    return kind.replace("/", "/msg/", 1)
