"""What rmw_zenoh uses of Zenoh: topic keys, liveliness tokens, and attachments of messages.

    key         <domain>/<topic>/<pkg>::msg::dds_::<Type>_/RIHS01_<64 hex digits>
    node        @ros2_lv/<domain>/<zid>/<node>/<node>/NN/%/<namespace>/<name>
    endpoint    @ros2_lv/<domain>/<zid>/<node>/<entity>/MP/%/<namespace>/<name>/<%topic>/<type>/
                <hash>/<reliability>:<durability>:<history>,<depth>:,:,:,,      (MS: a subscription)
    attachment  int64 sequence, int64 source time [ns], byte 16, 16 bytes gid; little-endian

Source: ros2/rmw_zenoh, docs/design.md, liveliness_utils.cpp, attachment_helpers.cpp (Jazzy). There
the gid is the XXH3 of the endpoint's token, here its BLAKE2: it only has to be unique, as nothing
looks it up in the graph.
"""

import hashlib
import re
import struct
from dataclasses import dataclass

from scm.errors import MessageError

DEFAULT_DEPTH = 10
_ATTACHMENT = struct.Struct("<qqB16s")
_GID_BYTES = 16


@dataclass(frozen=True, slots=True)
class Node:
    """A ROS node in a Zenoh session."""

    domain: int
    zid: str
    name: str
    number: int = 0

    @property
    def token(self) -> str:
        """The key of its liveliness token."""
        return f"{self._head(self.number)}/NN/{self._tail}"

    def endpoint_token(self, number: int, what: str, topic: str, kind: str, qos: str) -> str:
        """Return the key of the token of a publisher (`MP`) or a subscription (`MS`).

        Args:
            number: Of this endpoint, unique in its session.
            what: `MP` or `MS`.
            topic: With its leading slash.
            kind: The two last chunks of the topic's key: type and hash.
            qos: As `qos` makes it.
        """
        mangled = topic.replace("/", "%")
        return f"{self._head(number)}/{what}/{self._tail}/{mangled}/{kind}/{qos}"

    def _head(self, number: int) -> str:
        return f"@ros2_lv/{self.domain}/{self.zid}/{self.number}/{number}"

    @property
    def _tail(self) -> str:
        return f"%/%/{self.name}"


def topic_key(domain: int, topic: str, kind: str) -> str:
    """Return the Zenoh key of a topic."""
    return f"{domain}/{topic.strip('/')}/{kind}"


def type_chunks(kind: str, type_hash: str) -> str:
    """Return the type and hash chunks of a topic's key for a type such as `nav_msgs/Odometry`."""
    package, _, name = kind.partition("/")
    return f"{package}::msg::dds_::{name}_/{type_hash}"


def qos(*, latched: bool = False, depth: int = DEFAULT_DEPTH) -> str:
    """Return the quality of service in a token: reliable; `latched` is TRANSIENT_LOCAL."""
    return f":{1 if latched else ''}:,{depth}:,:,:,,"


def gid_of(token: str) -> bytes:
    """Return the 16 bytes that identify an endpoint."""
    return hashlib.blake2b(token.encode(), digest_size=_GID_BYTES).digest()


def attachment(sequence: int, t_ns: int, gid: bytes) -> bytes:
    """Return the attachment that rmw_zenoh expects with every message."""
    return _ATTACHMENT.pack(sequence, t_ns, _GID_BYTES, gid)


def read_attachment(raw: bytes) -> tuple[int, int, bytes]:
    """Return sequence number, source time [ns] and gid.

    Raises:
        MessageError: when it is not an attachment of rmw_zenoh.
    """
    if len(raw) != _ATTACHMENT.size or raw[16] != _GID_BYTES:
        msg = f"attachment: got {len(raw)} bytes ({raw[:17].hex()}), expected 33, the 17th being 16"
        raise MessageError(msg)
    sequence, t_ns, _, gid = _ATTACHMENT.unpack(raw)
    return sequence, t_ns, gid


def ros_name(vehicle: str) -> str:
    """Return a car's name as ROS allows it: letters, digits and _, no digit first."""
    name = re.sub(r"\W", "_", vehicle)
    return f"v{name}" if name[0].isdigit() else name
