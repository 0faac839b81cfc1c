"""The ETSI collective perception message (CPM) as JSON records, in the units of the standard.

As in `scm.v2x.etsi` it speaks of the enlarged city: lengths and speeds times `SCALE`, time as it
is. Names and ranges are those of the open JSON schema of Orange's its-client, cpm 2.1.1, after
TS 103 324 v2.1.1 with TS 102 894-2. Objects stand east (x) and north (y) of the reference
position; map x is east and map y is north.
"""

from typing import Annotated

import msgspec
from msgspec import Meta

MONOVIDEO = 3
PASSENGER_CAR = 5
MOST_OBJECTS = 255
NO_ALTITUDE, NO_ALTITUDE_CONFIDENCE = 800_001, 15
NO_ELLIPSE, NO_ANGLE = 4095, 3601

_Byte = Annotated[int, Meta(ge=0, le=255)]
_Word = Annotated[int, Meta(ge=0, le=65_535)]
_Span = Annotated[int, Meta(ge=-2048, le=2047)]


class Coordinate(msgspec.Struct, kw_only=True, frozen=True):
    """0.01 m from the reference position; confidence: 0.01 m at 95 %, 4095 beyond, 4096 unknown."""

    value: Annotated[int, Meta(ge=-131_072, le=131_071)]
    confidence: Annotated[int, Meta(ge=1, le=4096)] = 4096


class VelocityComponent(msgspec.Struct, kw_only=True, frozen=True):
    """0.01 m/s, 16383 unknown; confidence: 0.01 m/s at 95 %, 126 beyond, 127 unknown."""

    value: Annotated[int, Meta(ge=-16_383, le=16_383)]
    confidence: Annotated[int, Meta(ge=1, le=127)] = 127


class Angle(msgspec.Struct, kw_only=True, frozen=True):
    """0.1 degree clockwise from north, 3601 unknown; confidence: 0.1 degree at 95 %, likewise."""

    value: Annotated[int, Meta(ge=0, le=3601)]
    confidence: Annotated[int, Meta(ge=1, le=127)] = 127


class AngularVelocity(msgspec.Struct, kw_only=True, frozen=True):
    """1 degree/s, + = left, 256 unknown; confidence: a class from 0 (1 degree/s) to 7 (unknown)."""

    value: Annotated[int, Meta(ge=-255, le=256)]
    confidence: Annotated[int, Meta(ge=0, le=7)] = 7


class Dimension(msgspec.Struct, kw_only=True, frozen=True):
    """0.1 m, 256 unknown; confidence: 0.1 m, 32 unknown."""

    value: Annotated[int, Meta(ge=1, le=256)]
    confidence: Annotated[int, Meta(ge=1, le=32)] = 32


class Position(msgspec.Struct, kw_only=True, frozen=True):
    """Where an object is: the middle of its outline on the ground."""

    x_coordinate: Coordinate
    y_coordinate: Coordinate


class CartesianVelocity(msgspec.Struct, kw_only=True, frozen=True):
    """To the east and to the north."""

    x_velocity: VelocityComponent
    y_velocity: VelocityComponent


class Velocity(msgspec.Struct, kw_only=True, frozen=True):
    """The standard's choice between two forms; this one."""

    cartesian_velocity: CartesianVelocity


class Angles(msgspec.Struct, kw_only=True, frozen=True):
    """Euler angles; a car on the floor has one."""

    z_angle: Angle


class ObjectClass(msgspec.Struct, kw_only=True, frozen=True):
    """Kind of road vehicle: 5 a passenger car."""

    vehicle: _Byte = PASSENGER_CAR


class Classification(msgspec.Struct, kw_only=True, frozen=True):
    """What an object is; confidence: percent, 101 unknown."""

    object_class: ObjectClass
    confidence: Annotated[int, Meta(ge=1, le=101)] = 101


class PerceivedObject(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """One car that was seen.

    Attributes:
        measurement_delta_time: From the reference time to when this was true [ms].
        object_id: Its tag's id.
        sensor_id_list: Which cameras saw it; None: none of late.
    """

    measurement_delta_time: _Span
    position: Position
    object_id: _Word
    velocity: Velocity
    angles: Angles
    z_angular_velocity: AngularVelocity
    object_dimension_x: Dimension | None = None
    object_dimension_y: Dimension | None = None
    sensor_id_list: tuple[_Byte, ...] | None = None
    classification: tuple[Classification, ...] = ()


class Ellipse(msgspec.Struct, kw_only=True, frozen=True):
    """Of the reference position: 0.01 m, 4095 unknown; 0.1 degree, 3601 unknown."""

    semi_major: Annotated[int, Meta(ge=0, le=4095)] = NO_ELLIPSE
    semi_minor: Annotated[int, Meta(ge=0, le=4095)] = NO_ELLIPSE
    semi_major_orientation: Annotated[int, Meta(ge=0, le=3601)] = NO_ANGLE


class Altitude(msgspec.Struct, kw_only=True, frozen=True):
    """0.01 m, 800001 unknown."""

    value: Annotated[int, Meta(ge=-100_000, le=800_001)] = NO_ALTITUDE
    confidence: Annotated[int, Meta(ge=0, le=15)] = NO_ALTITUDE_CONFIDENCE


class ReferencePosition(msgspec.Struct, kw_only=True, frozen=True):
    """The map's origin: 1e-7 degree of the enlarged city."""

    latitude: Annotated[int, Meta(ge=-900_000_000, le=900_000_001)]
    longitude: Annotated[int, Meta(ge=-1_800_000_000, le=1_800_000_001)]
    position_confidence_ellipse: Ellipse
    altitude: Altitude


class ManagementContainer(msgspec.Struct, kw_only=True, frozen=True):
    """When and where: reference_time counts ITS milliseconds since 2004."""

    reference_time: Annotated[int, Meta(ge=0, le=4_398_046_511_103)]
    reference_position: ReferencePosition


class SensorInformation(msgspec.Struct, kw_only=True, frozen=True):
    """One camera; sensor_type 3 is a single video camera."""

    sensor_id: _Byte
    sensor_type: Annotated[int, Meta(ge=0, le=31)] = MONOVIDEO
    shadowing_applies: bool = True


class CpmBody(msgspec.Struct, kw_only=True, frozen=True):
    """What a roadside unit perceives; containers without anything in them are left out."""

    protocol_version: _Byte = 2
    station_id: Annotated[int, Meta(ge=0, le=2**32 - 1)]
    management_container: ManagementContainer
    sensor_information_container: tuple[SensorInformation, ...] | None = None
    perceived_object_container: tuple[PerceivedObject, ...] = ()
