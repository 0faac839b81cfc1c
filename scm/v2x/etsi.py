"""ETSI facility messages, CAM and SPATEM, as JSON records in the units of the standards.

A 1:14 car is far below the resolution and the trigger thresholds of the standards (1e-7 degree is
15 cm of the full-scale city, and a 4 m step is longer than the map). So the V2X layer speaks of the
enlarged city: lengths, speeds and accelerations times `SCALE`, time unchanged, positions as
degrees from a reference point. Every field then means what the standard says.

In JSON the names are those of the records, in snake case as in the open JSON schemas of Orange's
its-client; the names of phase states and status bits are the standard's own.

Field sets and units: EN 302 637-2 v1.4.1 (CAM), TS 103 301 with SAE J2735 phase states (SPATEM).
"""

from typing import Annotated

import msgspec
from msgspec import Meta

SCALE = 14.0
REFERENCE_LATITUDE_DEG = 0.0
REFERENCE_LONGITUDE_DEG = 0.0

CAM_ID = 2
SPATEM_ID = 4
TIME_MARK_UNKNOWN = 36001

# A value beyond the standard's range is refused when read: it comes from the air.
_Byte = Annotated[int, Meta(ge=0, le=255)]
_Word = Annotated[int, Meta(ge=0, le=65_535)]
_Station = Annotated[int, Meta(ge=0, le=2**32 - 1)]
_TimeMark = Annotated[int, Meta(ge=0, le=36_111)]


class CamBody(msgspec.Struct, kw_only=True, frozen=True):
    """Basic and high-frequency containers of a CAM.

    Attributes:
        generation_delta_time: Milliseconds modulo 65536.
        latitude, longitude: 1e-7 degree of the enlarged city, at the middle of the front
            bumper.
        heading: 0.1 degree clockwise from north (map +y), 3601 unknown.
        speed: 0.01 m/s, 16383 unknown.      yaw_rate: 0.01 degree/s, + = left.
        vehicle_length, vehicle_width: 0.1 m.      longitudinal_acceleration: 0.1 m/s^2.
        curvature: 1e-4 1/m, + = left, 1023 unknown.      drive_direction: 0 forward, 1 backward.
    """

    protocol_version: _Byte = 2
    message_id: _Byte = CAM_ID
    station_id: _Station
    station_type: _Byte = 5
    generation_delta_time: _Word
    latitude: Annotated[int, Meta(ge=-900_000_000, le=900_000_001)]
    longitude: Annotated[int, Meta(ge=-1_800_000_000, le=1_800_000_001)]
    heading: Annotated[int, Meta(ge=0, le=3601)]
    speed: Annotated[int, Meta(ge=0, le=16_383)]
    drive_direction: Annotated[int, Meta(ge=0, le=2)] = 0
    vehicle_length: Annotated[int, Meta(ge=1, le=1023)]
    vehicle_width: Annotated[int, Meta(ge=1, le=62)]
    longitudinal_acceleration: Annotated[int, Meta(ge=-160, le=161)] = 161
    curvature: Annotated[int, Meta(ge=-1023, le=1023)] = 1023
    yaw_rate: Annotated[int, Meta(ge=-32_766, le=32_767)] = 32767


class MovementState(msgspec.Struct, kw_only=True, frozen=True):
    """One signal group of a SPATEM.

    Attributes:
        event_state: SAE J2735 MovementPhaseState by name, e.g. `protected-Movement-Allowed`.
        min_end_time, max_end_time: 0.1 s within the hour; 36001 is unknown.
    """

    signal_group: _Byte
    event_state: str
    min_end_time: _TimeMark
    max_end_time: _TimeMark = TIME_MARK_UNKNOWN


class SpatemBody(msgspec.Struct, kw_only=True, frozen=True):
    """One intersection of a SPATEM.

    Attributes:
        revision: Must equal that of the map the receiver holds.
        status: Names of the set bits: `fixedTimeOperation`, `failureFlash` ...
        moy: Minute of the year.      time_stamp: Milliseconds within the minute.
    """

    protocol_version: _Byte = 2
    message_id: _Byte = SPATEM_ID
    station_id: _Station
    intersection: _Word
    revision: Annotated[int, Meta(ge=0, le=127)]
    status: tuple[str, ...] = ()
    moy: Annotated[int, Meta(ge=0, le=527_040)]
    time_stamp: _Word
    states: tuple[MovementState, ...]
