"""Requests for priority at a junction (SREM) and their status (SSEM), as JSON records.

A body is the `message` of its-client's JSON schemas srem 2.0.1 and ssem 2.0.1; units of the
enlarged city. Field sets and units: TS 103 301 with SAE J2735.
"""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.v2x.etsi.codes import coded
from scm.v2x.etsi.mapem import Position3d, Velocity
from scm.v2x.etsi.parts import (
    ApproachId,
    Byte,
    DSecond,
    IntersectionId,
    LaneId,
    MinuteOfYear,
    Name,
    Revision,
    StationId,
)

SREM_ID, SSEM_ID = 9, 10
REQUEST, UPDATE, CANCEL = 1, 2, 3
NO_ANGLE_J2735 = 28_800
STATUSES = (
    "unknown",
    "requested",
    "processing",
    "watchOtherTraffic",
    "granted",
    "rejected",
    "maxPresence",
    "reserviceLocked",
)
"""SAE J2735 PrioritizationResponseStatus; the index is the number in the message."""
ROLES = (
    "basicVehicle",
    "publicTransport",
    "specialTransport",
    "dangerousGoods",
    "roadWork",
    "roadRescue",
    "emergency",
    "safetyCar",
    "none-unknown",
    "truck",
    "motorcycle",
    "roadSideSource",
    "police",
    "fire",
    "ambulance",
    "dot",
    "transit",
    "slowMoving",
    "stopNgo",
    "cyclist",
    "pedestrian",
    "nonMotorized",
    "military",
    "tram",
)
"""SAE J2735 BasicVehicleRole, likewise."""

_Role = Annotated[int, coded(0, 23, unavailable=8)]


class AccessPoint(msgspec.Struct, kw_only=True, frozen=True):
    """A way into or out of a junction. The schema requires all three; 0 is unknown."""

    lane: LaneId = 0
    approach: ApproachId = 0
    connection: Byte = 0


class SignalRequestRecord(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """One request; request_type: 1 new, 2 update, 3 cancellation."""

    id: IntersectionId
    request_id: Byte
    request_type: Annotated[int, coded(0, 3, unavailable=0)]
    inbound_lane: AccessPoint
    outbound_lane: AccessPoint | None = None


class RequestPackage(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """A request and the car's arrival: minute of the year, ms of the minute, duration in ms."""

    request: SignalRequestRecord
    minute: MinuteOfYear | None = None
    second: DSecond | None = None
    duration: DSecond | None = None


class RequestorType(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """Role as an index into `ROLES`; request: importance, 1 lowest to 14 highest."""

    role: _Role
    request: Annotated[int, coded(0, 15, unavailable=0)] | None = None


class TransmissionAndSpeed(msgspec.Struct, kw_only=True, frozen=True):
    """transmission: 2 forward, 3 reverse, 7 unknown; speed 0.02 m/s, 8191 unknown."""

    transmission: Annotated[int, coded(0, 7, unavailable=range(4, 8))]
    speed: Velocity


class RequestorPosition(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """Position of the car; heading 0.0125 degree clockwise from north."""

    position: Position3d
    heading: Annotated[int, coded(0, NO_ANGLE_J2735, unavailable=NO_ANGLE_J2735)] | None = None
    speed: TransmissionAndSpeed | None = None


class Requestor(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """The requesting station; id: the station id of its CAMs."""

    id: StationId
    type: RequestorType | None = None
    position: RequestorPosition | None = None
    name: Name | None = None


class SremBody(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """An SREM; timestamp: minute of the year, second: ms of the minute."""

    protocol_version: Byte
    station_id: StationId
    timestamp: MinuteOfYear | None = None
    second: DSecond
    sequence_number: Revision | None = None
    requests: Annotated[tuple[RequestPackage, ...], Meta(min_length=1, max_length=32)] | None = None
    requestor: Requestor


class Requester(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """The request that an SSEM answers: station, request id, sequence number of its SREM."""

    id: StationId
    request: Byte
    sequence_number: Revision
    role: _Role | None = None


class SignalStatusPackage(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """Status of one request, as an index into `STATUSES`."""

    requester: Requester | None = None
    inbound_on: AccessPoint
    outbound_on: AccessPoint | None = None
    minute: MinuteOfYear | None = None
    second: DSecond | None = None
    duration: DSecond | None = None
    status: Annotated[int, coded(0, 7, unavailable=0)]


class SignalStatusRecord(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """One junction; sequence_number: changes with the content."""

    sequence_number: Revision
    id: IntersectionId
    sig_status: Annotated[tuple[SignalStatusPackage, ...], Meta(min_length=1, max_length=32)]


class SsemBody(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """An SSEM; timestamp: minute of the year, second: ms of the minute."""

    protocol_version: Byte
    station_id: StationId
    timestamp: MinuteOfYear | None = None
    second: DSecond
    sequence_number: Revision | None = None
    status: Annotated[tuple[SignalStatusRecord, ...], Meta(min_length=1, max_length=32)]
