"""CAM: EN 302 637-2 v1.4.1."""

from typing import Any

from scm.v2x.etsi.cam_spatem import CAM_ID, CamBody, ExteriorLights
from scm.v2x.uper.parts import (
    ALTITUDE,
    HEADING,
    PATH,
    SPEED,
    Chosen,
    Fields,
    Names,
    Only,
    Switches,
    header_of,
    plain,
    read_header,
)

_CURVATURE_CONFIDENCE = Names(
    (
        *("onePerMeter-0-00002", "onePerMeter-0-0001", "onePerMeter-0-0005", "onePerMeter-0-002"),
        *("onePerMeter-0-01", "onePerMeter-0-1", "outOfRange", "unavailable"),
    )
)
_YAW_RATE_CONFIDENCE = Names(
    (
        *("degSec-000-01", "degSec-000-05", "degSec-000-10", "degSec-001-00", "degSec-005-00"),
        *("degSec-010-00", "degSec-100-00", "outOfRange", "unavailable"),
    )
)
_LENGTH_CONFIDENCE = Names(
    (
        *("noTrailerPresent", "trailerPresentWithKnownLength", "trailerPresentWithUnknownLength"),
        *("trailerPresenceIsUnknown", "unavailable"),
    )
)
_ROLE = Names(
    (
        *("default", "publicTransport", "specialTransport", "dangerousGoods", "roadWork"),
        *("rescue", "emergency", "safetyCar", "agriculture", "commercial", "military"),
        *("roadOperator", "taxi", "reserved1", "reserved2", "reserved3"),
    )
)
_ELLIPSE = Fields(
    ("semi_major", "semiMajorConfidence"),
    ("semi_minor", "semiMinorConfidence"),
    ("semi_major_orientation", "semiMajorOrientation"),
)
_BASIC = Fields(
    ("station_type", "stationType"),
    (
        "reference_position",
        "referencePosition",
        Fields(
            ("latitude", "latitude"),
            ("longitude", "longitude"),
            ("position_confidence_ellipse", "positionConfidenceEllipse", _ELLIPSE),
            ("altitude", "altitude", ALTITUDE),
        ),
    ),
)
_HIGH = Fields(
    ("heading", "heading", HEADING),
    ("speed", "speed", SPEED),
    ("drive_direction", "driveDirection", Names(("forward", "backward", "unavailable"))),
    (
        "vehicle_length",
        "vehicleLength",
        Fields(
            ("value", "vehicleLengthValue"),
            ("confidence", "vehicleLengthConfidenceIndication", _LENGTH_CONFIDENCE),
        ),
    ),
    ("vehicle_width", "vehicleWidth"),
    (
        "longitudinal_acceleration",
        "longitudinalAcceleration",
        Fields(
            ("value", "longitudinalAccelerationValue"),
            ("confidence", "longitudinalAccelerationConfidence"),
        ),
    ),
    (
        "curvature",
        "curvature",
        Fields(
            ("value", "curvatureValue"),
            ("confidence", "curvatureConfidence", _CURVATURE_CONFIDENCE),
        ),
    ),
    (
        "curvature_calculation_mode",
        "curvatureCalculationMode",
        Names(("yawRateUsed", "yawRateNotUsed", "unavailable")),
    ),
    (
        "yaw_rate",
        "yawRate",
        Fields(
            ("value", "yawRateValue"), ("confidence", "yawRateConfidence", _YAW_RATE_CONFIDENCE)
        ),
    ),
)
_LOW = Fields(
    ("vehicle_role", "vehicleRole", _ROLE),
    ("exterior_lights", "exteriorLights", Switches(ExteriorLights.__struct_fields__)),
    ("path_history", "pathHistory", PATH),
)
_PARAMETERS = Fields(
    ("basic_container", "basicContainer", _BASIC),
    (
        "high_frequency_container",
        "highFrequencyContainer",
        Chosen(
            "basicVehicleContainerHighFrequency",
            Only("basic_vehicle_container_high_frequency", _HIGH),
        ),
    ),
    (
        "low_frequency_container",
        "lowFrequencyContainer",
        Chosen(
            "basicVehicleContainerLowFrequency", Only("basic_vehicle_container_low_frequency", _LOW)
        ),
    ),
)


def to_asn(body: CamBody) -> dict[str, Any]:
    """Return a CAM's value of ASN.1."""
    record = plain(body)
    return {
        "header": header_of(record, CAM_ID),
        "cam": {
            "generationDeltaTime": record["generation_delta_time"],
            "camParameters": _PARAMETERS.to_asn(record),
        },
    }


def of_asn(value: dict[str, Any]) -> dict[str, Any]:
    """Return the record of a CAM's value of ASN.1; a roadside unit's CAM is refused."""
    return {
        **read_header(value),
        "generation_delta_time": value["cam"]["generationDeltaTime"],
        **_PARAMETERS.of_asn(value["cam"]["camParameters"]),
    }
