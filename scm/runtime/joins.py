"""Which neighbour of the map is joined where: the words of `scm up --join` and `--admit`."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from tempfile import TemporaryDirectory

from scm.errors import AccessError, RunError, nearest
from scm.records.city_map import CityMap
from scm.v2x.crossing import INNER, gateway_station
from scm.v2x.fleet_file import Fleet
from scm.v2x.gateway import check_endpoint


@dataclass(frozen=True, slots=True)
class Join:
    """One neighbour's link.

    Attributes:
        neighbour: The other city.
        endpoint: Of its gateway, or where this city waits for it.
        listens: Whether it waits.
    """

    neighbour: str
    endpoint: str
    listens: bool

    @property
    def words(self) -> tuple[str, str]:
        """The arguments of `scm gateway` for it."""
        return ("--admit" if self.listens else "--join", self.endpoint)


def joins_of(
    city: str, city_map: CityMap, join: Iterable[str], admit: Iterable[str], fleet: Fleet | None
) -> tuple[Join, ...]:
    """Return the links of a city that were requested, each `[NEIGHBOUR=]ENDPOINT`.

    Raises:
        RunError: when the map has no such neighbour, or one is named twice.
        AccessError: when an endpoint does not suit the fleet, or an authority is not known.
        MessageError: when the neighbour's name is too long.
    """
    known = [neighbour.city for neighbour in city_map.neighbours]
    found: dict[str, Join] = {}
    requested = [*((text, False) for text in join), *((text, True) for text in admit)]
    for text, listens in requested:
        option = "--admit" if listens else "--join"
        before, mark, after = text.partition("=")
        endpoint = after if mark else before
        neighbour = _neighbour(option, text, before if mark else "", known)
        if neighbour == city:
            msg = f"{option}: got {text!r}, but this city itself is named {city!r} (--city)"
            raise RunError(msg)
        if neighbour in found:
            msg = f"{option}: got {text!r}, but {neighbour} is joined already; expected each once"
            raise RunError(msg)
        gateway_station(neighbour)
        _check(option, endpoint, neighbour, fleet)
        found[neighbour] = Join(neighbour, endpoint, listens)
    return tuple(found.values())


@contextmanager
def inner_socket(joins: Sequence[Join]) -> Iterator[str]:
    """Make a socket endpoint in a folder that only this user can enter; empty without links."""
    if not joins:
        yield ""
        return
    with TemporaryDirectory(prefix="scm-") as folder:
        yield f"{INNER}/{folder}/city.sock"


def _neighbour(option: str, text: str, name: str, known: list[str]) -> str:
    if not known:
        msg = f"{option}: got {text!r}, but the map has no [[neighbours]]"
        raise RunError(msg)
    if not name and len(known) == 1:
        return known[0]
    if name not in known:
        close = nearest(name, known)
        msg = (
            f"{option}: got {text!r}, expected CITY=ENDPOINT with one of {', '.join(known)}{close}"
        )
        raise RunError(msg)
    return name


def _check(option: str, endpoint: str, neighbour: str, fleet: Fleet | None) -> None:
    try:
        check_endpoint(endpoint, None if fleet is None else fleet.auth)
    except AccessError as cause:
        msg = f"{option}: {cause}"
        raise AccessError(msg) from cause
    if fleet is not None and neighbour not in fleet.neighbours:
        expected = f"expected it from `scm fleet neighbour {neighbour} FILE`"
        msg = f"{option}: the authority of {neighbour} is not known, {expected}"
        raise AccessError(msg)
