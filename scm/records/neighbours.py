"""Neighbouring cities, as a city's gateways see them."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.fields import AgeS, CityName


class NeighbourRow(msgspec.Struct, kw_only=True, frozen=True):
    """One neighbouring city.

    Attributes:
        state: `waiting`: it has not joined yet; `lost`: it was joined before; `unknown`: the
            gateway to it does not run.
        since_ns: When this state began, on the clock of the gateway [ns].
        shows: What this city shows it; names of `messages` in the map.
        sees: What it shows this city; none while it is not joined.
        reason: Why it is not joined; empty: it is.
        age_s: Since the gateway reported it.
    """

    city: CityName
    state: Literal["waiting", "joined", "lost", "unknown"]
    since_ns: int | None = None
    shows: Annotated[tuple[str, ...], Meta(examples=[["states", "cams"]])] = ()
    sees: Annotated[tuple[str, ...], Meta(examples=[["states"]])] = ()
    reason: Annotated[str, Meta(examples=["no link: lab_b does not answer"])] = ""
    age_s: AgeS | None = None


class Neighbours(msgspec.Struct, kw_only=True, frozen=True):
    """The neighbours of the map.

    Attributes:
        neighbours: In the order of the map file.
    """

    neighbours: tuple[NeighbourRow, ...]
