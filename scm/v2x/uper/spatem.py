"""SPATEM: TS 103 301 with SAE J2735."""

from typing import Any

from scm.v2x.etsi.cam_spatem import PHASE_STATES, SPATEM_ID, SpatemBody
from scm.v2x.uper.parts import (
    INTERSECTION_ID,
    Bits,
    Each,
    Fields,
    Names,
    header_of,
    plain,
    read_header,
)

_EVENT = Fields(
    ("event_state", "eventState", Names(PHASE_STATES)),
    (
        "timing",
        "timing",
        Fields(
            ("min_end_time", "minEndTime"),
            ("max_end_time", "maxEndTime"),
            ("likely_time", "likelyTime"),
            ("confidence", "confidence"),
            ("next_time", "nextTime"),
        ),
    ),
)
_STATE = Fields(
    ("signal_group", "signalGroup"), ("state_time_speed", "state-time-speed", Each(_EVENT))
)
_INTERSECTION = Fields(
    ("name", "name"),
    ("id", "id", INTERSECTION_ID),
    ("revision", "revision"),
    ("status", "status", Bits(16)),
    ("moy", "moy"),
    ("timestamp", "timeStamp"),
    ("states", "states", Each(_STATE)),
)
_SPAT = Fields(("timestamp", "timeStamp"), ("intersections", "intersections", Each(_INTERSECTION)))


def to_asn(body: SpatemBody) -> dict[str, Any]:
    """Return a SPATEM's value of ASN.1."""
    record = plain(body)
    return {"header": header_of(record, SPATEM_ID), "spat": _SPAT.to_asn(record)}


def of_asn(value: dict[str, Any]) -> dict[str, Any]:
    """Return the record of a SPATEM's value of ASN.1; advised speeds and queues are left out."""
    return {**read_header(value), **_SPAT.of_asn(value["spat"])}
