"""What the world knows of its borders: who comes, who has left, who came; records of both."""

from dataclasses import dataclass, field

import msgspec

from scm.clock import NS_PER_S
from scm.maps.border import Exit, exits_of
from scm.records.city_map import CityMap
from scm.v2x.exchange import Incoming
from scm.v2x.messages.handover_request import HandoverRequest
from scm.v2x.request_retry import RetriedRequest

PATIENCE_S = 1e9
"""A transfer is repeated until it is answered, however long the link is down."""
TRY_S = 0.5
MAX_ARRIVALS = 4096  # cars of each city whose last transfer is remembered
MAX_GHOSTS = 32  # cars behind the border; each takes a vehicle index


class OutgoingRecord(msgspec.Struct, kw_only=True, frozen=True):
    """A car that has left and that the next city has not confirmed."""

    city: str
    request: HandoverRequest


class ArrivalRecord(msgspec.Struct, kw_only=True, frozen=True):
    """The last transfer of a car from a city, and how it was answered.

    Attributes:
        refused: The code of a refusal; empty: the car came.
        detail: Of a refusal.
    """

    epoch: int
    refused: str = ""
    detail: str = ""


@dataclass(slots=True)
class Leaving:
    """A car of this city that is on its way to the next one."""

    road: Exit
    request: HandoverRequest
    tries: RetriedRequest


def leaving(road: Exit, request: HandoverRequest, now_ns: int) -> Leaving:
    """Return a transfer that is to be sent from now on."""
    return Leaving(road, request, RetriedRequest(request, now_ns, PATIENCE_S, TRY_S))


@dataclass(slots=True)
class Approaching:
    """A car that comes to the border, and its claim to a place behind it.

    Attributes:
        until_ns: It may cross until then.
        sent_ns: When the last request for it was sent.
        why: Why it was refused last, as events report it once.
    """

    road: Exit
    until_ns: int = 0
    sent_ns: int = -NS_PER_S
    why: str = ""


@dataclass(slots=True)
class Border:
    """What the world knows of its borders.

    Attributes:
        city: The name of this city on the bus.
        exits: Roads that lead out, by the number of their last lane.
        approaching: Cars that come to the border, by name.
        leaving: Cars that have left and are not confirmed, by name.
        arrivals: The last transfer of each car from each city, by (city, car).
        reserved: Places that are held: (city, car) by lane, and until when.
        early: Transfers of a moment that this world has not reached.
        ghosts: Indices of cars behind the border by (city, car), and when they were last reported.
    """

    city: str
    exits: dict[int, Exit]
    approaching: dict[str, Approaching] = field(default_factory=dict)
    leaving: dict[str, Leaving] = field(default_factory=dict)
    arrivals: dict[tuple[str, str], ArrivalRecord] = field(default_factory=dict)
    reserved: dict[str, tuple[tuple[str, str], int]] = field(default_factory=dict)
    early: list[Incoming] = field(default_factory=list)
    ghosts: dict[tuple[str, str], tuple[int, int]] = field(default_factory=dict)

    def remember(self, key: tuple[str, str], arrival: ArrivalRecord) -> list[tuple[str, str]]:
        """Remember a car's last transfer from a city; return those of the city to be forgotten.

        Of more than `MAX_ARRIVALS` cars of a city the ones that came longest ago are forgotten: no
        transfer is as old, since one car a road is on its way at a time.
        """
        self.arrivals.pop(key, None)
        self.arrivals[key] = arrival
        forgotten = [one for one in self.arrivals if one[0] == key[0]][:-MAX_ARRIVALS]
        for one in forgotten:
            del self.arrivals[one]
        return forgotten

    def pop_early(self) -> list[Incoming]:
        """Return and forget the transfers that waited for this tick."""
        early, self.early = self.early, []
        return early


def border_of(city_map: CityMap, city: str, numbers: dict[str, int]) -> Border:
    """Return the border of a city; `numbers` are those of its lanes."""
    return Border(city, {numbers[road.lane]: road for road in exits_of(city_map)})
