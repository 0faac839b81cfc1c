"""V2X frames as a capture file, as written by a sniffer beside an ITS-G5 road.

    Ethernet (0x8947) | GeoNetworking basic 4, common 8, single-hop broadcast 28 | BTP-B 4 | message

Addresses are derived from station ids. Frames are unsigned, so the basic header announces a common
header. Layout: EN 302 636-4-1 v1.4.1, 9 (GeoNetworking), EN 302 636-5-1 v2.2.1, 7 (BTP); capture
file: the classic format of libpcap with nanoseconds.
"""

import struct
from collections.abc import Iterable
from typing import BinaryIO, NamedTuple

from scm.clock import NS_PER_S
from scm.v2x.etsi.cam_spatem import PASSENGER_CAR, ROADSIDE_UNIT, CamBody
from scm.v2x.etsi.codes import number_of
from scm.v2x.etsi.convert import its_ms, place_of
from scm.v2x.etsi.denm import DenmBody
from scm.v2x.etsi.json_form import Body
from scm.v2x.etsi.mapem import MapemBody
from scm.v2x.etsi.priority import SremBody

ETHERTYPE = 0x8947
PORTS = {
    "cam": 2001,
    "denm": 2002,
    "mapem": 2003,
    "spatem": 2004,
    "srem": 2007,
    "ssem": 2008,
    "cpm": 2009,
}
"""BTP-B destination ports by message_type: TS 103 248."""
SPEED_MOST = 16_383

_MAGIC_NS = 0xA1B23C4D
_ETHERNET_LINK = 1
_SNAP = 65_535
_BROADCAST = b"\xff" * 6
_VERSION_1, _NEXT_COMMON = 0x10, 0x01
_LIFETIME_1S = 0x05  # one times one second
_ONE_HOP = 1
_NEXT_BTP_B, _SINGLE_HOP_BROADCAST = 0x20, 0x50
_TRAFFIC_CLASS = {"denm": 1, "cam": 2}
_TRAFFIC_CLASS_OTHER = 3
_MOBILE = 0x80
_COMMON = struct.Struct(">BBBBHBB")
_LONG_POSITION = struct.Struct(">8sIiihH")
_LOCAL = 0x02  # an address that no manufacturer gave


class Position(NamedTuple):
    """A station's own position in GeoNetworking.

    Attributes:
        station_id: 32 bits.
        station_type: 5 a car, 15 a roadside unit.
        latitude, longitude: 1e-7 degree.
        speed: 0.01 m/s, negative backward.      heading: 0.1 degree clockwise from north.
    """

    station_id: int
    station_type: int
    latitude: int
    longitude: int
    speed: int = 0
    heading: int = 0


def frame_of(kind: str, payload: bytes, position: Position, t_ns: int) -> bytes:
    """Return one message as an Ethernet frame.

    Args:
        kind: Its message_type, one of `PORTS`.
        payload: Its UPER.
        position: Of the sending station.
        t_ns: Time of sending.
    """
    address = bytes((_LOCAL, 0)) + position.station_id.to_bytes(4, "big")
    btp = struct.pack(">HH", PORTS[kind], 0) + payload
    mobile = 0 if position.station_type == ROADSIDE_UNIT else _MOBILE
    common = _COMMON.pack(
        _NEXT_BTP_B,
        _SINGLE_HOP_BROADCAST,
        _TRAFFIC_CLASS.get(kind, _TRAFFIC_CLASS_OTHER),
        mobile,
        len(btp),
        _ONE_HOP,
        0,
    )
    gn_address = bytes(((position.station_type & 0x1F) << 2, 0)) + address
    source = _LONG_POSITION.pack(
        gn_address,
        its_ms(t_ns) % 2**32,
        position.latitude,
        position.longitude,
        _accurate_speed(position.speed),
        position.heading,
    )
    basic = bytes((_VERSION_1 | _NEXT_COMMON, 0, _LIFETIME_1S, _ONE_HOP))
    ethernet = _BROADCAST + address + struct.pack(">H", ETHERTYPE)
    return ethernet + basic + common + source + bytes(4) + btp


def _accurate_speed(speed: int) -> int:
    """Return a 15-bit speed with the position's accuracy bit above it, as a signed word."""
    bits = max(-SPEED_MOST, min(SPEED_MOST, speed)) & 0x7FFF | 0x8000
    return bits - 0x1_0000


class Positions:
    """The last known positions of stations from their own messages; (0, 0) before the first.

    GeoNetworking has no code for unknown values: a message without a position leaves the last known
    one; an unknown speed or heading is 0.
    """

    def __init__(self) -> None:
        self._known: dict[int, Position] = {}

    def of(self, body: Body) -> Position:
        """Update and return the position of a message's sender."""
        station = body.station_id
        position = _position_in(body)
        if position is not None and place_of(position.latitude, position.longitude) is not None:
            self._known[station] = position
        return self._known.get(station, Position(station, ROADSIDE_UNIT, 0, 0))


def _position_in(body: Body) -> Position | None:
    """Return the sender's position in a message, or None."""
    if isinstance(body, CamBody):
        place, motion = body.position, body.motion
        speed, backward = number_of(motion.speed, "value"), number_of(motion, "drive_direction")
        return Position(
            body.station_id,
            body.basic_container.station_type,
            place.latitude,
            place.longitude,
            0 if speed is None or backward is None else -speed if backward else speed,
            (number_of(motion.heading, "value") or 0) % 3600,
        )
    if isinstance(body, MapemBody) and body.intersections:
        point = body.intersections[0].ref_point
        return Position(body.station_id, ROADSIDE_UNIT, point.latitude, point.longitude)
    if isinstance(body, SremBody) and body.requestor.position is not None:
        point = body.requestor.position.position
        return Position(body.station_id, PASSENGER_CAR, point.latitude, point.longitude)
    if isinstance(body, DenmBody):
        management = body.management_container
        if management.action_id.originating_station_id == body.station_id:
            event = management.event_position
            return Position(
                body.station_id, management.station_type, event.latitude, event.longitude
            )
    return None


def write_capture(stream: BinaryIO, frames: Iterable[tuple[int, bytes]]) -> int:
    """Write frames with their times [ns since 1970] as a capture; return their number."""
    stream.write(struct.pack("<IHHiIII", _MAGIC_NS, 2, 4, 0, 0, _SNAP, _ETHERNET_LINK))
    count = 0
    for t_ns, frame in frames:
        seconds, rest = divmod(t_ns, NS_PER_S)
        stream.write(struct.pack("<IIII", seconds, rest, len(frame), len(frame)) + frame)
        count += 1
    return count
