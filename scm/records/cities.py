"""Cities on the bus."""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.records.fields import Name, Title, TNs
from scm.records.stations import StationRow


class CityRow(msgspec.Struct, kw_only=True, frozen=True):
    """One city.

    Attributes:
        name: Chunk of all its keys on the bus.
        map: Name of its map; `title` is for people.
        software: Version of this program.
        interface: Version of this interface, the first chunk of all addresses.
        seed: Of all its randomness; None: the world was not received yet.
        lanes: How many the map has; likewise `junctions`.
        junctions: Junctions.
        vehicles: How many cars are on the map.
        t_ns: Time of the world; None: not received yet.
        tick: Of the world's newest snapshot; None: likewise.
        real_time_factor: Simulated over elapsed time, over the last second.
        snapshot_age_s: Age of the world's newest snapshot.
        stopped: Whether the city-wide stop is engaged.
        parts: Its own processes that are there.
    """

    name: Name
    map: Annotated[str, Meta(examples=["driving_school"])]
    title: Title
    software: Annotated[str, Meta(examples=["0.1.0"])]
    interface: Annotated[str, Meta(examples=["v1"])]
    seed: int | None
    lanes: int
    junctions: int
    vehicles: int
    t_ns: TNs | None
    tick: int | None
    real_time_factor: float
    snapshot_age_s: float | None
    stopped: bool
    parts: tuple[StationRow, ...]


class Cities(msgspec.Struct, kw_only=True, frozen=True):
    """The cities that this server shows.

    Attributes:
        cities: One: a server belongs to a city.
    """

    cities: tuple[CityRow, ...]
