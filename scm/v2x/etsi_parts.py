"""Data elements that several ETSI messages share, as JSON records in the units of the standards.

A field that the standard leaves out when it is absent is None here and missing in the JSON.
Records that have such fields write no default at all, so everything required there must be given.
Names and ranges: the open JSON schemas of Orange's its-client, after TS 102 894-2 and SAE J2735.
"""

from typing import Annotated

import msgspec
from msgspec import Meta

PROTOCOL_VERSION = 2
UNKNOWN_POSITION = (900_000_001, 1_800_000_001)
NO_ALTITUDE, NO_ALTITUDE_CONFIDENCE = 800_001, 15
NO_ELLIPSE, NO_ANGLE = 4095, 3601
NO_CONFIDENCE = 127
NO_DELTA, NO_DELTA_ALTITUDE = 131_072, 12_800

Bit = Annotated[int, Meta(ge=0, le=1)]
Byte = Annotated[int, Meta(ge=0, le=255)]
Word = Annotated[int, Meta(ge=0, le=65_535)]
StationId = Annotated[int, Meta(ge=0, le=2**32 - 1)]
Revision = Annotated[int, Meta(ge=0, le=127)]
Latitude = Annotated[int, Meta(ge=-900_000_000, le=900_000_001)]
Longitude = Annotated[int, Meta(ge=-1_800_000_000, le=1_800_000_001)]
HeadingValue = Annotated[int, Meta(ge=0, le=3601)]
Confidence = Annotated[int, Meta(ge=1, le=127)]
ItsTime = Annotated[int, Meta(ge=0, le=4_398_046_511_103)]
MinuteOfYear = Annotated[int, Meta(ge=0, le=527_040)]
Delta = Annotated[int, Meta(ge=-131_071, le=131_072)]
Name = Annotated[str, Meta(min_length=1, max_length=63)]


class Ellipse(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """How sure a position is: 0.01 m, 4095 unknown; 0.1 degree, 3601 unknown."""

    semi_major: Annotated[int, Meta(ge=0, le=4095)] = NO_ELLIPSE
    semi_minor: Annotated[int, Meta(ge=0, le=4095)] = NO_ELLIPSE
    semi_major_orientation: HeadingValue = NO_ANGLE


class Altitude(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """0.01 m, 800001 unknown; confidence: a class, 15 unknown."""

    value: Annotated[int, Meta(ge=-100_000, le=800_001)] = NO_ALTITUDE
    confidence: Annotated[int, Meta(ge=0, le=15)] = NO_ALTITUDE_CONFIDENCE


class ReferencePosition(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """1e-7 degree of the enlarged city."""

    latitude: Latitude
    longitude: Longitude
    position_confidence_ellipse: Ellipse = Ellipse()
    altitude: Altitude = Altitude()


class Heading(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """0.1 degree clockwise from north, map +y, 3601 unknown; confidence likewise, 127 unknown."""

    value: HeadingValue
    confidence: Confidence = NO_CONFIDENCE


class Speed(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """0.01 m/s, 16383 unknown; confidence 0.01 m/s, 127 unknown."""

    value: Annotated[int, Meta(ge=0, le=16_383)]
    confidence: Confidence = NO_CONFIDENCE


class DeltaPosition(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """From a reference: 1e-7 degree, 131072 unknown; 0.01 m up, 12800 unknown."""

    delta_latitude: Delta
    delta_longitude: Delta
    delta_altitude: Annotated[int, Meta(ge=-12_700, le=12_800)] = NO_DELTA_ALTITUDE


class PathPoint(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """Where a car was; path_delta_time: 0.01 s from here to the point before it in the list."""

    path_position: DeltaPosition
    path_delta_time: Annotated[int, Meta(ge=1, le=65_535)] | None = None


class IntersectionId(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """A junction's number; region None: a number of this city's own."""

    id: Word
    region: Word | None = None
