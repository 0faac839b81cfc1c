"""Records of misbehaviour_parts.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec


class StationScore(msgspec.Struct, kw_only=True, frozen=True):
    """One station.

    Attributes:
        station: Its name on the bus.
        station_id: Its number in the CAMs.
        score: 0 is ordinary; from 5 up it is suspected, until it falls below 2.
        worst: The check that last gave it points; empty: none.
        suspected: Whether a report stands against it.
        tag_unseen: Whether it is a car of the city whose tag the Eye cannot see though it
            overlooks its place: nobody confirms where it is. No accusation.
    """

    station: str
    station_id: int
    score: float
    worst: str
    suspected: bool
    tag_unseen: bool = False


class Misbehaviour(msgspec.Struct, kw_only=True, frozen=True):
    """What is held against those who speak on the air.

    Attributes:
        watched: Whether a misbehaviour part is there: it has told scores within the last seconds.
        witness: Whether an Eye is there to hold claims against.
        t_ns: Of these scores; None: there are none.
        stations: With the score of each.
        reported: Names of those that were ever reported; who is suspected now stands in
            `stations`.
    """

    watched: bool
    witness: bool
    t_ns: int | None
    stations: tuple[StationScore, ...]
    reported: tuple[str, ...]


class Observation(msgspec.Struct, kw_only=True, frozen=True):
    """What one check found.

    Attributes:
        kind: Class of observations of ETSI TS 103 759.
        check: Name of the check, a file of `scm/traffic/misbehaviour/checks`.
        plausibility: Of the worst claim: how often an honest car would seem so bad.
        claims: How many were at least doubtful.
    """

    kind: Literal["beacon", "longAcc", "position", "security", "speed", "static"]
    check: str
    plausibility: float
    claims: int


class Ellipse(msgspec.Struct, kw_only=True, frozen=True):
    """How sure a position is: 0.01 m, 4095 unknown; 0.1 degree, 3601 unknown.

    Attributes:
        semi_major: Of the ellipse [cm]; 4095: not known.
        semi_minor: Of the ellipse [cm]; 4095: not known.
        semi_major_orientation: Clockwise from north [0.1 degree]; 3601: not known.
    """

    semi_major: int = 4095
    semi_minor: int = 4095
    semi_major_orientation: int = 3601


class Altitude(msgspec.Struct, kw_only=True, frozen=True):
    """0.01 m, 800001 unknown; confidence: a class, 15 unknown.

    Attributes:
        value: By the units of the standard.
        confidence: How sure that is, in the steps of the standard.
    """

    value: int = 800001
    confidence: int = 15


class ReferencePosition(msgspec.Struct, kw_only=True, frozen=True):
    """1e-7 degree of the enlarged city.

    Attributes:
        latitude: Of the enlarged city [1e-7 degree].
        longitude: Of the enlarged city [1e-7 degree].
        position_confidence_ellipse: How sure a position is: 0.01 m, 4095 unknown; 0.1 degree, 3601
            unknown.
        altitude: 0.01 m, 800001 unknown; confidence: a class, 15 unknown.
    """

    latitude: int
    longitude: int
    position_confidence_ellipse: Ellipse | None = None
    altitude: Altitude | None = None


class BasicContainer(msgspec.Struct, kw_only=True, frozen=True):
    """Who and where: the middle of the front bumper.

    Attributes:
        station_type: By the standard; 5: passenger car.
        reference_position: 1e-7 degree of the enlarged city.
    """

    station_type: int = 5
    reference_position: ReferencePosition


class Heading(msgspec.Struct, kw_only=True, frozen=True):
    """0.1 degree clockwise from north, map +y, 3601 unknown; confidence likewise, 127 unknown.

    Attributes:
        value: By the units of the standard.
        confidence: How sure that is, in the steps of the standard.
    """

    value: int
    confidence: int = 127


class Speed(msgspec.Struct, kw_only=True, frozen=True):
    """0.01 m/s, 16383 unknown; confidence 0.01 m/s, 127 unknown.

    Attributes:
        value: By the units of the standard.
        confidence: How sure that is, in the steps of the standard.
    """

    value: int
    confidence: int = 127


class VehicleLength(msgspec.Struct, kw_only=True, frozen=True):
    """0.1 m, 1023 unknown; confidence: 0 no trailer, 4 unknown.

    Attributes:
        value: By the units of the standard.
        confidence: How sure that is, in the steps of the standard.
    """

    value: int
    confidence: int = 0


class Acceleration(msgspec.Struct, kw_only=True, frozen=True):
    """0.1 m/s^2, 161 unknown; confidence 0.1 m/s^2, 102 unknown.

    Attributes:
        value: By the units of the standard.
        confidence: How sure that is, in the steps of the standard.
    """

    value: int = 161
    confidence: int = 102


class Curvature(msgspec.Struct, kw_only=True, frozen=True):
    """1e-4 1/m, + = left, 1023 unknown; confidence: a class, 7 unknown.

    Attributes:
        value: By the units of the standard.
        confidence: How sure that is, in the steps of the standard.
    """

    value: int = 1023
    confidence: int = 7
