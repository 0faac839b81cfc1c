"""The ETSI collective perception message (CPM) as JSON records, in the units of the standard.

As in `scm.v2x.etsi.cam_spatem` it uses the enlarged city: lengths and speeds times `SCALE`,
time as it is. Names and ranges are those of the open JSON schema of Orange's its-client, cpm 2.1.1,
after TS 103 324 v2.1.1 with TS 102 894-2. Objects stand east (x) and north (y) of the reference
position; map x is east and map y is north.
"""

from typing import Annotated

import msgspec

from scm.v2x.etsi.codes import coded
from scm.v2x.etsi.parts import (
    NO_CONFIDENCE,
    Byte,
    Confidence,
    HeadingValue,
    ItsTime,
    ReferencePosition,
    StationId,
    StationType,
    Word,
)

MONOVIDEO = 3
PASSENGER_CAR = 5
MAX_OBJECTS = 255

_Span = Annotated[int, coded(-2048, 2047)]


class Coordinate(msgspec.Struct, kw_only=True, frozen=True):
    """0.01 m from the reference position; confidence: 0.01 m at 95 %, 4095 beyond, 4096 unknown."""

    value: Annotated[int, coded(-131_072, 131_071, out_of_range=(-131_072, 131_071))]
    confidence: Annotated[int, coded(1, 4096, unavailable=4096, out_of_range=(4095,))] = 4096


class VelocityComponent(msgspec.Struct, kw_only=True, frozen=True):
    """0.01 m/s, 16383 unknown; confidence: 0.01 m/s at 95 %, 126 beyond, 127 unknown."""

    value: Annotated[
        int, coded(-16_383, 16_383, unavailable=16_383, out_of_range=(-16_383, 16_382))
    ]
    confidence: Confidence = NO_CONFIDENCE


class Angle(msgspec.Struct, kw_only=True, frozen=True):
    """0.1 degree clockwise from north, 3601 unknown; confidence: 0.1 degree at 95 %, likewise."""

    value: HeadingValue
    confidence: Confidence = NO_CONFIDENCE


class AngularVelocity(msgspec.Struct, kw_only=True, frozen=True):
    """1 degree/s, + = left, 256 unknown; confidence: a class from 0 (1 degree/s) to 7 (unknown)."""

    value: Annotated[int, coded(-255, 256, unavailable=256, out_of_range=(-255, 255))]
    confidence: Annotated[int, coded(0, 7, unavailable=7, out_of_range=(6,))] = 7


class Dimension(msgspec.Struct, kw_only=True, frozen=True):
    """0.1 m, 256 unknown; confidence: 0.1 m, 32 unknown."""

    value: Annotated[int, coded(1, 256, unavailable=256, out_of_range=(255,))]
    confidence: Annotated[int, coded(1, 32, unavailable=32, out_of_range=(31,))] = 32


class Position(msgspec.Struct, kw_only=True, frozen=True):
    """Position of an object: the centre of its outline on the ground."""

    x_coordinate: Coordinate
    y_coordinate: Coordinate


class CartesianVelocity(msgspec.Struct, kw_only=True, frozen=True):
    """To the east and to the north."""

    x_velocity: VelocityComponent
    y_velocity: VelocityComponent


class Velocity(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """The standard's choice of two forms; None: the polar one, which is not supported."""

    cartesian_velocity: CartesianVelocity | None = None


class Angles(msgspec.Struct, kw_only=True, frozen=True):
    """Euler angles; a car on the floor has one."""

    z_angle: Angle


class ObjectClass(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """Kind of road vehicle: 5 a passenger car. None: no road vehicle, but a person, a group ..."""

    vehicle: StationType | None = None


class Classification(msgspec.Struct, kw_only=True, frozen=True):
    """What an object is; confidence: percent, 101 unknown."""

    object_class: ObjectClass
    confidence: Annotated[int, coded(1, 101, unavailable=101)] = 101


class PerceivedObject(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """One perceived car; from other stations everything but the position may be None.

    Attributes:
        measurement_delta_time: From the reference time to the measurement [ms].
        object_id: Its tag's id.
        sensor_id_list: Cameras that saw it; None: none recently.
    """

    measurement_delta_time: _Span
    position: Position
    object_id: Word | None = None
    velocity: Velocity | None = None
    angles: Angles | None = None
    z_angular_velocity: AngularVelocity | None = None
    object_dimension_x: Dimension | None = None
    object_dimension_y: Dimension | None = None
    sensor_id_list: tuple[Byte, ...] | None = None
    classification: tuple[Classification, ...] = ()


class ManagementContainer(msgspec.Struct, kw_only=True, frozen=True):
    """Time and position: reference_time counts ITS milliseconds since 2004."""

    reference_time: ItsTime
    reference_position: ReferencePosition


class SensorInformation(msgspec.Struct, kw_only=True, frozen=True):
    """One camera; sensor_type 3 is a single video camera."""

    sensor_id: Byte
    sensor_type: Annotated[int, coded(0, 31, unavailable=0)] = MONOVIDEO
    shadowing_applies: bool = True


class CpmBody(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """What a roadside unit perceives; empty containers are left out."""

    protocol_version: Byte
    station_id: StationId
    management_container: ManagementContainer
    sensor_information_container: tuple[SensorInformation, ...] | None = None
    perceived_object_container: tuple[PerceivedObject, ...] = ()
