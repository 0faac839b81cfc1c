"""The ETSI decentralised environmental notification (DENM) as JSON records, enlarged city.

A body is the `message` of its-client's JSON schema denm 2.3.0. Left out because we never send it:
the à la carte container, the zone of an event, linked events.
Field sets and units: EN 302 637-3 v1.3.1, TS 103 831 v2.2.1.
"""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.v2x.etsi.codes import coded
from scm.v2x.etsi.parts import (
    NO_ALTITUDE,
    NO_ALTITUDE_CONFIDENCE,
    NO_ANGLE,
    NO_ELLIPSE,
    AltitudeConfidence,
    AltitudeValue,
    Bit,
    Byte,
    Heading,
    HeadingValue,
    ItsTime,
    Latitude,
    Longitude,
    PathPoint,
    SemiAxis,
    Speed,
    StationId,
    StationType,
    Word,
)

DENM_ID = 1
CANCELLATION, NEGATION = 0, 1
DEFAULT_VALIDITY_S = 600
MAX_TRACES = 7


class ActionId(msgspec.Struct, kw_only=True, frozen=True):
    """Permanent id of an event: the station that first reported it, and its sequence number."""

    originating_station_id: StationId
    sequence_number: Word


class EventAltitude(msgspec.Struct, kw_only=True, frozen=True):
    """0.01 m, 800001 unknown; confidence: a class, 15 unknown."""

    value: AltitudeValue = NO_ALTITUDE
    confidence: AltitudeConfidence = NO_ALTITUDE_CONFIDENCE


class EventEllipse(msgspec.Struct, kw_only=True, frozen=True):
    """0.01 m, 4095 unknown; 0.1 degree, 3601 unknown."""

    semi_major_confidence: SemiAxis = NO_ELLIPSE
    semi_minor_confidence: SemiAxis = NO_ELLIPSE
    semi_major_orientation: HeadingValue = NO_ANGLE


class EventPosition(msgspec.Struct, kw_only=True, frozen=True):
    """Position of the event: 1e-7 degree of the enlarged city."""

    latitude: Latitude
    longitude: Longitude
    altitude: EventAltitude = EventAltitude()
    position_confidence_ellipse: EventEllipse = EventEllipse()


class DenmManagement(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """Id, position and validity of an event.

    Attributes:
        detection_time, reference_time: ITS milliseconds since 2004; updates change the second,
            repetitions do not.
        termination: 0 cancelled by its originator, 1 negated by another station.
        awareness_distance: A class: 0 within 50 m, 1 100 m, 2 200 m, 3 500 m, 4 1 km ...
        relevance_traffic_direction: 0 all, 1 upstream, 2 downstream, 3 opposite.
        validity_duration: Seconds from the detection.
        transmission_interval: Milliseconds between repetitions.
        station_type: Of the sender: 5 a car, 15 a roadside unit.
    """

    action_id: ActionId
    detection_time: ItsTime
    reference_time: ItsTime
    termination: Bit | None = None
    event_position: EventPosition
    awareness_distance: Annotated[int, coded(0, 7)] | None = None
    relevance_traffic_direction: Annotated[int, coded(0, 3)] | None = None
    validity_duration: Annotated[int, coded(0, 86_400)] = DEFAULT_VALIDITY_S
    transmission_interval: Annotated[int, coded(1, 10_000)] | None = None
    station_type: StationType = 0


class CauseCode(msgspec.Struct, kw_only=True, frozen=True):
    """Cause: 94 a stationary vehicle, 92 after a crash, 99 a dangerous situation ..."""

    cause: Byte
    subcause: Annotated[int, coded(0, 255, unavailable=0)] = 0


class DenmSituation(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """Type of the event; information_quality: 0 unknown, 1 lowest, 7 highest."""

    information_quality: Annotated[int, coded(0, 7, unavailable=0)]
    event_type: CauseCode
    linked_cause: CauseCode | None = None


class Trace(msgspec.Struct, kw_only=True, frozen=True):
    """A path that led to the event, newest point first."""

    path: Annotated[tuple[PathPoint, ...], Meta(max_length=40)] = ()


class DenmLocation(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """Motion of the event, and the paths that lead to it."""

    event_speed: Speed | None = None
    event_position_heading: Heading | None = None
    detection_zones_to_event_position: (
        Annotated[tuple[Trace, ...], Meta(min_length=1, max_length=MAX_TRACES)] | None
    ) = None


class DenmBody(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """A DENM; a termination has no situation."""

    protocol_version: Byte
    station_id: StationId
    management_container: DenmManagement
    situation_container: DenmSituation | None = None
    location_container: DenmLocation | None = None
