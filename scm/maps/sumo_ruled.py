"""Which ways over the junctions of a SUMO network are ruled together, and whether by lights.

Junctions of one traffic light are one junction here, and so are the lights of one junction.

    a light for some of its ways    the others get a light too, where they meet any of them
    no light                        signs
    no ways of two lanes meet       nothing to rule
"""

import re
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from scm.maps.sumo_read import NetLink

Meets = Callable[[NetLink, NetLink], bool]


@dataclass(frozen=True, slots=True)
class Ruled:
    """The ways over one junction of ours.

    Attributes:
        name: On the bus.
        signals: The traffic lights of the network that control it; none: it has signs.
        approaches: By lane, its ways.
    """

    name: str
    signals: tuple[str, ...]
    approaches: Mapping[str, tuple[NetLink, ...]]

    def numbers(self, lane: str) -> list[int]:
        """Return the places of a lane's ways in a phase's state; none: the network lets them go."""
        return [link.number for link in self.approaches[lane] if link.signal]


def ruled(links: Iterable[NetLink], meets: Meets) -> tuple[list[Ruled], list[str]]:
    """Return the junctions where ways meet, and the traffic lights where none do.

    Args:
        links: All ways.
        meets: Whether two ways of different lanes come closer than a lane is wide.
    """
    found: list[Ruled] = []
    idle: list[str] = []
    members = _together(links)
    for ways, name in zip(members, bus_names(map(_key, members)), strict=True):
        signals = tuple(dict.fromkeys(link.signal for link in ways if link.signal))
        approaches = _approaches(ways, meets, lit=bool(signals))
        if approaches:
            found.append(Ruled(name, signals, approaches))
        else:
            idle += signals
    return found, idle


def bus_names(ids: Iterable[str]) -> list[str]:
    """Return names for use on the bus for ids, each once."""
    names: list[str] = []
    for given in ids:
        base = re.sub(r"[^a-z0-9_-]", "_", given.lower())[:22]
        base = base if re.search("[a-z0-9]", base) else "junction"
        name, count = base, 1
        while name in names:
            count += 1
            name = f"{base}_{count}"
        names.append(name)
    return names


def _key(ways: Sequence[NetLink]) -> str:
    return next((link.signal for link in ways if link.signal), ways[0].node)


def _together(links: Iterable[NetLink]) -> list[list[NetLink]]:
    """Return the ways of each set of junctions that share traffic lights."""
    leader: dict[Hashable, Hashable] = {}

    def lead(key: Hashable) -> Hashable:
        while leader.setdefault(key, key) != key:
            leader[key] = key = leader[leader[key]]
        return key

    links = list(links)
    for link in links:
        if link.signal:
            leader[lead(("light", link.signal))] = lead(link.node)
    found: dict[Hashable, list[NetLink]] = defaultdict(list)
    for link in links:
        found[lead(link.node)].append(link)
    return list(found.values())


def _approaches(
    ways: Iterable[NetLink], meets: Meets, *, lit: bool
) -> dict[str, tuple[NetLink, ...]]:
    """Return what is ruled of a junction, by lane; nothing where no ways of two lanes meet."""
    by_lane: dict[str, list[NetLink]] = defaultdict(list)
    for link in ways:
        by_lane[link.start].append(link)
    meeting: set[str] = set()
    for one, other in combinations(by_lane, 2):
        if any(meets(a, b) for a in by_lane[one] for b in by_lane[other]):
            meeting |= {one, other}
    if not meeting:
        return {}
    return {
        lane: tuple(links)
        for lane, links in by_lane.items()
        if lane in meeting or not lit or any(link.signal for link in links)
    }
