"""DENM: EN 302 637-3 v1.3.1; what the standard calls relevance distance is awareness distance."""

from typing import Any

from scm.v2x.etsi.denm import DENM_ID, DenmBody
from scm.v2x.uper.parts import (
    ALTITUDE,
    HEADING,
    PATH,
    SPEED,
    Each,
    Fields,
    Names,
    Only,
    header_of,
    plain,
    read_header,
)

_DISTANCE = Names(
    (
        *("lessThan50m", "lessThan100m", "lessThan200m", "lessThan500m", "lessThan1000m"),
        *("lessThan5km", "lessThan10km", "over10km"),
    )
)
_DIRECTION = Names(
    ("allTrafficDirections", "upstreamTraffic", "downstreamTraffic", "oppositeTraffic")
)
_CAUSE = Fields(("cause", "causeCode"), ("subcause", "subCauseCode"))
_POSITION = Fields(
    ("latitude", "latitude"),
    ("longitude", "longitude"),
    ("altitude", "altitude", ALTITUDE),
    (
        "position_confidence_ellipse",
        "positionConfidenceEllipse",
        Fields(
            ("semi_major_confidence", "semiMajorConfidence"),
            ("semi_minor_confidence", "semiMinorConfidence"),
            ("semi_major_orientation", "semiMajorOrientation"),
        ),
    ),
)
_MANAGEMENT = Fields(
    (
        "action_id",
        "actionID",
        Fields(
            ("originating_station_id", "originatingStationID"),
            ("sequence_number", "sequenceNumber"),
        ),
    ),
    ("detection_time", "detectionTime"),
    ("reference_time", "referenceTime"),
    ("termination", "termination", Names(("isCancellation", "isNegation"))),
    ("event_position", "eventPosition", _POSITION),
    ("awareness_distance", "relevanceDistance", _DISTANCE),
    ("relevance_traffic_direction", "relevanceTrafficDirection", _DIRECTION),
    ("validity_duration", "validityDuration"),
    ("transmission_interval", "transmissionInterval"),
    ("station_type", "stationType"),
    stationType=0,
)
_SITUATION = Fields(
    ("information_quality", "informationQuality"),
    ("event_type", "eventType", _CAUSE),
    ("linked_cause", "linkedCause", _CAUSE),
)
_LOCATION = Fields(
    ("event_speed", "eventSpeed", SPEED),
    ("event_position_heading", "eventPositionHeading", HEADING),
    ("detection_zones_to_event_position", "traces", Each(Only("path", PATH))),
    traces=[[]],
)
_CONTAINERS = Fields(
    ("management_container", "management", _MANAGEMENT),
    ("situation_container", "situation", _SITUATION),
    ("location_container", "location", _LOCATION),
)


def to_asn(body: DenmBody) -> dict[str, Any]:
    """Return a DENM's value of ASN.1; a location without traces gets one that is empty."""
    record = plain(body)
    return {"header": header_of(record, DENM_ID), "denm": _CONTAINERS.to_asn(record)}


def of_asn(value: dict[str, Any]) -> dict[str, Any]:
    """Return the record of a DENM's value of ASN.1; its à la carte container is left out."""
    return {**read_header(value), **_CONTAINERS.of_asn(value["denm"])}
