"""Data elements that several ETSI messages share, as JSON records in the units of the standards.

Optional fields of the standard are None here and missing in the JSON when absent. Records with such
fields write no defaults, so all their required fields must be given.
Names and ranges: the open JSON schemas of Orange's its-client, after TS 102 894-2 and SAE J2735.
"""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.v2x.etsi.codes import coded

PROTOCOL_VERSION = 2
UNKNOWN_POSITION = (900_000_001, 1_800_000_001)
NO_ALTITUDE, NO_ALTITUDE_CONFIDENCE = 800_001, 15
NO_ELLIPSE, NO_ANGLE = 4095, 3601
NO_CONFIDENCE = 127
NO_DELTA, NO_DELTA_ALTITUDE = 131_072, 12_800

Bit = Annotated[int, coded(0, 1)]
Byte = Annotated[int, coded(0, 255)]
Word = Annotated[int, coded(0, 65_535)]
StationId = Annotated[int, coded(0, 2**32 - 1)]
StationType = Annotated[int, coded(0, 255, unavailable=0)]
Revision = Annotated[int, coded(0, 127)]
Latitude = Annotated[int, coded(-900_000_000, UNKNOWN_POSITION[0], unavailable=UNKNOWN_POSITION[0])]
Longitude = Annotated[
    int, coded(-1_800_000_000, UNKNOWN_POSITION[1], unavailable=UNKNOWN_POSITION[1])
]
AltitudeValue = Annotated[
    int,
    coded(-100_000, NO_ALTITUDE, unavailable=NO_ALTITUDE, out_of_range=(-100_000, 800_000)),
]
AltitudeConfidence = Annotated[
    int,
    coded(0, NO_ALTITUDE_CONFIDENCE, unavailable=NO_ALTITUDE_CONFIDENCE, out_of_range=(14,)),
]
SemiAxis = Annotated[
    int, coded(0, NO_ELLIPSE, unavailable=NO_ELLIPSE, out_of_range=(NO_ELLIPSE - 1,))
]
HeadingValue = Annotated[int, coded(0, NO_ANGLE, unavailable=NO_ANGLE)]
Confidence = Annotated[
    int, coded(1, NO_CONFIDENCE, unavailable=NO_CONFIDENCE, out_of_range=(NO_CONFIDENCE - 1,))
]
ItsTime = Annotated[int, coded(0, 4_398_046_511_103)]
MinuteOfYear = Annotated[int, coded(0, 527_040, unavailable=527_040)]
DSecond = Annotated[int, coded(0, 65_535, unavailable=range(61_000, 65_536))]
"""Milliseconds of a minute, or of a duration; 65535 unavailable, the rest from 61000 reserved."""
SignalGroupId = Annotated[int, coded(0, 255, unavailable=0)]
LaneId = Annotated[int, coded(0, 255, unavailable=0)]
ApproachId = Annotated[int, coded(0, 15, unavailable=0)]
Delta = Annotated[int, coded(-131_071, NO_DELTA, unavailable=NO_DELTA)]
Name = Annotated[str, Meta(min_length=1, max_length=63)]


class Ellipse(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """Confidence of a position: 0.01 m, 4095 unknown; 0.1 degree, 3601 unknown.

    Attributes:
        semi_major, semi_minor: Of the ellipse [cm]; 4095: not known.
        semi_major_orientation: Clockwise from north [0.1 degree]; 3601: not known.
    """

    semi_major: SemiAxis = NO_ELLIPSE
    semi_minor: SemiAxis = NO_ELLIPSE
    semi_major_orientation: HeadingValue = NO_ANGLE


class Altitude(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """0.01 m, 800001 unknown; confidence: a class, 15 unknown.

    Attributes:
        value, confidence: In the units and the confidence classes of the standard.
    """

    value: AltitudeValue = NO_ALTITUDE
    confidence: AltitudeConfidence = NO_ALTITUDE_CONFIDENCE


class ReferencePosition(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """1e-7 degree of the enlarged city.

    Attributes:
        latitude, longitude: Of the enlarged city [1e-7 degree].
    """

    latitude: Latitude
    longitude: Longitude
    position_confidence_ellipse: Ellipse = Ellipse()
    altitude: Altitude = Altitude()


class Heading(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """0.1 degree clockwise from north, map +y, 3601 unknown; confidence likewise, 127 unknown.

    Attributes:
        value, confidence: In the units and the confidence classes of the standard.
    """

    value: HeadingValue
    confidence: Confidence = NO_CONFIDENCE


class Speed(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """0.01 m/s, 16383 unknown; confidence 0.01 m/s, 127 unknown.

    Attributes:
        value, confidence: In the units and the confidence classes of the standard.
    """

    value: Annotated[int, coded(0, 16_383, unavailable=16_383, out_of_range=(16_382,))]
    confidence: Confidence = NO_CONFIDENCE


class DeltaPosition(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """From a reference: 1e-7 degree, 131072 unknown; 0.01 m up, 12800 unknown.

    Attributes:
        delta_latitude, delta_longitude: Against the reference position [1e-7 degree].
        delta_altitude: Against the reference position [cm].
    """

    delta_latitude: Delta
    delta_longitude: Delta
    delta_altitude: Annotated[
        int,
        coded(-12_700, 12_800, unavailable=NO_DELTA_ALTITUDE, out_of_range=(-12_700, 12_799)),
    ] = NO_DELTA_ALTITUDE


class PathPoint(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """A past position; path_delta_time: 0.01 s from here to the previous point in the list.

    Attributes:
        path_delta_time: Since the point before [10 ms].
    """

    path_position: DeltaPosition
    path_delta_time: Annotated[int, coded(1, 65_535)] | None = None


class IntersectionId(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """A junction's number; region None: numbers of this city."""

    id: Word
    region: Word | None = None
