"""SREM: TS 103 301 with SAE J2735."""

from typing import Any

from scm.v2x.etsi.priority import ROLES, SREM_ID, SremBody
from scm.v2x.uper.parts import (
    ACCESS_POINT,
    INTERSECTION_ID,
    POSITION_3D,
    Chosen,
    Each,
    Fields,
    Names,
    header_of,
    plain,
    read_header,
)

_TYPES = Names(
    (
        "priorityRequestTypeReserved",
        "priorityRequest",
        "priorityRequestUpdate",
        "priorityCancellation",
    )
)
_IMPORTANCE = Names(
    (
        "requestImportanceLevelUnKnown",
        *(f"requestImportanceLevel{level}" for level in range(1, 15)),
        "requestImportanceReserved",
    )
)
_TRANSMISSION = Names(
    (
        *("neutral", "park", "forwardGears", "reverseGears"),
        *("reserved1", "reserved2", "reserved3", "unavailable"),
    )
)
_REQUEST = Fields(
    ("id", "id", INTERSECTION_ID),
    ("request_id", "requestID"),
    ("request_type", "requestType", _TYPES),
    ("inbound_lane", "inBoundLane", ACCESS_POINT),
    ("outbound_lane", "outBoundLane", ACCESS_POINT),
)
_REQUESTOR = Fields(
    ("id", "id", Chosen("stationID")),
    (
        "type",
        "type",
        Fields(("role", "role", Names(ROLES)), ("request", "request", _IMPORTANCE)),
    ),
    (
        "position",
        "position",
        Fields(
            ("position", "position", POSITION_3D),
            ("heading", "heading"),
            (
                "speed",
                "speed",
                # The standard's own spelling.
                Fields(("transmission", "transmisson", _TRANSMISSION), ("speed", "speed")),
            ),
        ),
    ),
    ("name", "name"),
)
_SRM = Fields(
    ("timestamp", "timeStamp"),
    ("second", "second"),
    ("sequence_number", "sequenceNumber"),
    (
        "requests",
        "requests",
        Each(
            Fields(
                ("request", "request", _REQUEST),
                ("minute", "minute"),
                ("second", "second"),
                ("duration", "duration"),
            )
        ),
    ),
    ("requestor", "requestor", _REQUESTOR),
)


def to_asn(body: SremBody) -> dict[str, Any]:
    """Return an SREM's value of ASN.1."""
    record = plain(body)
    return {"header": header_of(record, SREM_ID), "srm": _SRM.to_asn(record)}


def of_asn(value: dict[str, Any]) -> dict[str, Any]:
    """Return the record of an SREM's value of ASN.1."""
    return {**read_header(value), **_SRM.of_asn(value["srm"])}
