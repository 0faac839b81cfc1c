"""`scm show`: a map, a car, the physical effects or the messages, for people."""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:
    from scm.records.city_map import CityMap
    from scm.vehicles.car import Car

Row = tuple[str, ...]

_MAP_KINDS = {
    "lanes": "lane",
    "junctions": "junction",
    "lights": "light",
    "signs": "sign",
    "crosswalks": "crosswalk",
    "walls": "wall",
    "spawns": "spawn",
    "cameras": "camera",
}
_SLOPES = "its floor has slopes: simulated cars get tyres that hold on them, see docs/floor.md\n"


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", choices=("map", "car", "terms", "messages"))
    parser.add_argument(
        "name", nargs="?", help="map or car, by name or file, or an effect; default: list them"
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="map: the SVG picture to write (NAME.svg)"
    )
    parser.add_argument(
        "--docs", type=Path, metavar="DIR", help="terms: write a page and a picture of each"
    )
    parser.add_argument("--map", help="car: say which of this map's lanes it cannot follow")


def _run(arguments: argparse.Namespace) -> int:
    show: dict[str, Callable[[argparse.Namespace], str]] = {
        "map": _map,
        "car": _car,
        "terms": _terms,
        "messages": _messages,
    }
    print(show[arguments.what](arguments))
    return 0


def _map(arguments: argparse.Namespace) -> str:
    from scm.maps.draw import draw_svg
    from scm.maps.load import load_map, map_names

    if arguments.name is None:
        return "\n".join(map_names())
    city_map = load_map(arguments.name)
    out: Path = arguments.out or Path(f"{city_map.name}.svg")
    out.write_text(draw_svg(city_map, names=True, spawns=True), encoding="utf-8")
    counts = ", ".join(
        f"{count} {singular if count == 1 else plural}"
        for plural, singular in _MAP_KINDS.items()
        if (count := len(getattr(city_map, plural)))
    )
    slopes = "" if city_map.floor.is_level else _SLOPES
    names = "".join(f"{head}\n{indent(_columns(rows), '  ')}\n" for head, rows in _named(city_map))
    return f"{city_map.title}: {counts}\nfrom: {city_map.source}\n{slopes}{names}drawn in {out}"


def _named(city_map: "CityMap") -> Iterator[tuple[str, list[Row]]]:
    """Return what scripts and pages call by name, kind by kind: a heading and its rows."""
    from scm.maps.route import Roads

    roads = Roads(city_map)
    lanes: list[Row] = [
        (name, f"{roads.length_of(name):.2f} m", f"{roads.definition(name).speed_limit_mps:g} m/s",
         ", ".join(roads.successors(name)) or "nothing")
        for name in roads.lanes
    ]  # fmt: skip
    junctions: list[Row] = [
        (junction.name, ", ".join(group.name for group in junction.groups))
        for junction in city_map.junctions
    ]
    crossings: list[Row] = [
        (crossing.name, ", ".join(approach.name for approach in crossing.approaches))
        for crossing in city_map.crossings
    ]
    spawns: list[Row] = [
        (spawn.name, f"lane {spawn.lane} at {spawn.at_m or 0.0:.2f} m" if spawn.lane else "",
         "x {:.2f} m, y {:.2f} m, yaw {:.2f} rad".format(*roads.spawn_pose(spawn.name)))
        for spawn in city_map.spawns
    ]  # fmt: skip
    kinds = {
        "lanes: length, speed limit, leads to": lanes,
        "junctions: signal groups": junctions,
        "crossings without signals: approaches": crossings,
        "spawn places": spawns,
    }
    return ((heading, rows) for heading, rows in kinds.items() if rows)


def _columns(rows: Sequence[Row]) -> str:
    """Return rows as text, their columns one below the other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(map(str.ljust, row, [*widths[:-1], 0])).rstrip() for row in rows)


def _car(arguments: argparse.Namespace) -> str:
    from scm.vehicles.car import car_names, load_car
    from scm.vehicles.describe import describe_car

    if arguments.name is None:
        return "\n".join(car_names())
    car = load_car(arguments.name)
    return describe_car(car) + ("" if arguments.map is None else _on_map(car, arguments.map))


def _on_map(car: "Car", name: str) -> str:
    from scm.maps.bends import misfit
    from scm.maps.load import load_map
    from scm.vehicles.drivers.limits import limits_of, turning_radius_m

    problem = misfit(load_map(name), turning_radius_m(car), limits_of(car).width)
    return f"ON MAP {name}: {problem or 'it can follow all lanes'}"


def _terms(arguments: argparse.Namespace) -> str:
    from scm.vehicles.describe_effects import describe_term, list_effects

    if arguments.docs is not None:
        return _manual(arguments.docs, arguments.name)
    return list_effects() if arguments.name is None else describe_term(arguments.name)


def _manual(folder: Path, name: str | None) -> str:
    from scm.clock import WallClock
    from scm.progress import Progress
    from scm.vehicles.manual.folder import chosen_effects, write_manual

    chosen = chosen_effects(name)
    count = len(chosen)
    with closing(Progress(sys.stderr, WallClock())) as progress:
        write_manual(
            folder, chosen, lambda done, _: progress.step("writing pages", done, count),
            index=name is None,
        )  # fmt: skip
    return f"{count} page{'s' * (count > 1)} with pictures in {folder}"


def _messages(arguments: argparse.Namespace) -> str:
    from scm.v2x.message import Request
    from scm.v2x.messages import message_classes

    del arguments
    rows = []
    for kind in message_classes():
        reply = f" -> {kind.REPLY.__name__}" if issubclass(kind, Request) else ""
        rate = f"{kind.RATE_HZ:g} Hz" if kind.RATE_HZ else ""
        about = (kind.__doc__ or "").partition("\n")[0]
        rows.append((kind.__name__ + reply, kind.KEY, kind.DELIVERY.value, rate, about))
    return _columns(rows)


COMMAND = Command(
    help="Show a map, a car, the physical effects or the messages.",
    example="scm show car nigel",
    arguments=_arguments,
    run=_run,
)
