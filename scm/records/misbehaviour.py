"""Scores of stations whose messages are checked."""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.records.fields import StationName, TNs


class StationScore(msgspec.Struct, kw_only=True, frozen=True):
    """One station.

    Attributes:
        station: Its name on the bus.
        station_id: Its number in the CAMs.
        score: 0 is ordinary; from 5 up it is suspected, until it falls below 2.
        worst: The check that last gave it points; empty: none.
        suspected: Whether a report stands against it.
        tag_unseen: Whether it is a car of the city whose tag the Eye cannot see though it overlooks
            its place, so no position is confirmed. No accusation.
    """

    station: StationName
    station_id: int
    score: float
    worst: Annotated[str, Meta(examples=["speed_jump"])]
    suspected: bool
    tag_unseen: bool = False


class Misbehaviour(msgspec.Struct, kw_only=True, frozen=True):
    """Scores of the stations on the air.

    Attributes:
        watched: Whether a misbehaviour part is there: it has published scores within the last
            seconds.
        witness: Whether an Eye is there to hold claims against.
        t_ns: Of these scores; None: there are none.
        stations: With the score of each.
        reported: Names of those that were ever reported; who is suspected now stands in `stations`.
    """

    watched: bool
    witness: bool
    t_ns: TNs | None
    stations: tuple[StationScore, ...]
    reported: Annotated[tuple[str, ...], Meta(examples=[["n5"]])]
