"""SSEM: TS 103 301 with SAE J2735."""

from typing import Any

from scm.v2x.etsi.priority import ROLES, SSEM_ID, STATUSES, SsemBody
from scm.v2x.uper.parts import (
    ACCESS_POINT,
    INTERSECTION_ID,
    Chosen,
    Each,
    Fields,
    Names,
    header_of,
    plain,
    read_header,
)

_REQUESTER = Fields(
    ("id", "id", Chosen("stationID")),
    ("request", "request"),
    ("sequence_number", "sequenceNumber"),
    ("role", "role", Names(ROLES)),
)
_PACKAGE = Fields(
    ("requester", "requester", _REQUESTER),
    ("inbound_on", "inboundOn", ACCESS_POINT),
    ("outbound_on", "outboundOn", ACCESS_POINT),
    ("minute", "minute"),
    ("second", "second"),
    ("duration", "duration"),
    ("status", "status", Names(STATUSES)),
)
_STATUS = Fields(
    ("sequence_number", "sequenceNumber"),
    ("id", "id", INTERSECTION_ID),
    ("sig_status", "sigStatus", Each(_PACKAGE)),
)
_SSM = Fields(
    ("timestamp", "timeStamp"),
    ("second", "second"),
    ("sequence_number", "sequenceNumber"),
    ("status", "status", Each(_STATUS)),
)


def to_asn(body: SsemBody) -> dict[str, Any]:
    """Return an SSEM's value of ASN.1."""
    record = plain(body)
    return {"header": header_of(record, SSEM_ID), "ssm": _SSM.to_asn(record)}


def of_asn(value: dict[str, Any]) -> dict[str, Any]:
    """Return the record of an SSEM's value of ASN.1."""
    return {**read_header(value), **_SSM.of_asn(value["ssm"])}
