"""`scm import sumo`: a SUMO network as a map file."""

import argparse
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command
from scm.errors import MapError

if TYPE_CHECKING:
    from scm.maps.sumo import Imported
    from scm.records.city_map import CityMap

MAX_NAMES = 4  # in a printed line
NEXT_STEP = (
    "  a program is kept where ways that cross are green one after the other, and all ways of a "
    "lane together: netconvert -s NET --tls.rebuild --tls.layout incoming -o NEW writes such ones"
)


def floor_of(text: str) -> tuple[float, float]:
    """Return width and depth [m] of `6x4`."""
    width, _, depth = text.partition("x")
    try:
        return float(width), float(depth)
    except ValueError as error:
        msg = f"got {text!r}, expected WIDTHxDEPTH in metre, as in 6x4"
        raise argparse.ArgumentTypeError(msg) from error


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("net", type=Path, metavar="NET", help="a SUMO network, .net.xml")
    parser.add_argument("--out", type=Path, required=True, metavar="MAP", help="map file to write")
    parser.add_argument(
        "--scale", type=float, help="full size divided by ours (14, or what fits the floor)"
    )
    parser.add_argument(
        "--floor", type=floor_of, metavar="WxD", help="floor that it must fit [m], such as 6x4"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.sumo import import_sumo
    from scm.traffic.signals.custom_plans import adopted

    if arguments.scale is not None and not 0.0 < arguments.scale < math.inf:
        raise MapError(f"--scale: got {arguments.scale}, expected a number above 0")
    if not arguments.out.parent.is_dir():
        raise MapError(f"--out: no folder {arguments.out.parent} for {arguments.out.name}")
    made = import_sumo(
        arguments.net,
        scale=arguments.scale,
        floor_m=arguments.floor,
        report=lambda words: print(f"{arguments.net}: {words}", flush=True),
    )
    built, unsafe = adopted(made.city_map)
    city = _written(built, arguments.out)
    print("\n".join(_report(arguments.out, city, made, made.unread | unsafe)))
    return 0


def _written(city_map: "CityMap", out: Path) -> "CityMap":
    """Write a map file after checking that a city can run on it; return its description.

    Raises:
        ScmError: a city would refuse the map, or the file cannot be written.
    """
    from scm.maps.load import map_of
    from scm.maps.sumo_toml import map_toml
    from scm.traffic.signals.part import TrafficPart

    text = map_toml(city_map)
    city = map_of(text, out)
    TrafficPart(city)
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise MapError(f"--out: {out} cannot be written: {error.strerror}") from error
    return city


def _report(
    out: Path, city: "CityMap", made: "Imported", why_not: Mapping[str, str]
) -> Iterator[str]:
    """Yield what became of a network, line by line."""
    from scm.traffic.signals.custom_plans import OWN

    width, depth = (high - low for low, high in (city.floor.x_m, city.floor.y_m))
    yield f"{out}: 1:{made.scale:g} on {width:.1f} x {depth:.1f} m"
    side = ", cars drive on the left" if city.drives_on == "left" else ""
    yield (
        f"  {len(city.lanes)} lanes, {len(city.junctions)} junctions with signals, "
        f"{len(city.crossings)} without{side}"
    )
    bends = "no bends" if math.isinf(made.tightest_m) else f"least radius {made.tightest_m:.2f} m"
    yield (
        f"  lanes within {1e3 * made.error_m:.0f} mm of the network's, {bends}, "
        f"{made.shortened} lanes shortened for their turns"
    )
    if made.left_out:
        yield f"  {len(made.left_out)} turns back left out: a Nigel cannot drive them"
    if made.idle_signals:
        yield f"  left out where no ways of cars meet: traffic lights {_some(made.idle_signals)}"
    if made.renamed:
        pairs = [f"{edge!r} is {name!r}" for edge, name in made.renamed.items()]
        yield f"  edges under other names here: {_some(pairs)}"
    if city.junctions:
        own = sum(junction.plan == OWN for junction in city.junctions)
        yield f"  the network's signal programs kept at {own} of {len(city.junctions)} junctions"
    yield from _refusals(why_not)


def _refusals(why_not: Mapping[str, str]) -> Iterator[str]:
    """Yield why junctions do not run the network's program: a line for each kind of reason."""
    from scm.maps.sumo_build import PLAN

    alike: dict[frozenset[str], list[str]] = {}
    for name, why in why_not.items():
        alike.setdefault(_kind(why), []).append(name)
    for names in alike.values():
        runs = "runs" if len(names) == 1 else f"({len(names)}) run"
        example = "" if len(names) == 1 else f"; at {names[0]!r}"
        yield f"  {_some(names)} {runs} plan {PLAN!r} instead{example}: {why_not[names[0]]}"
    if why_not:
        yield NEXT_STEP


def _kind(why: str) -> frozenset[str]:
    """Return a reason without its names and numbers: those of one kind are equal."""
    words = re.sub(r"'[^']*'|\d[\d.e+]*", "_", why)
    return frozenset(words.removeprefix("plan _: ").split("; "))


def _some(names: Sequence[str]) -> str:
    """Return the first few of many names."""
    more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
    return ", ".join(names[:MAX_NAMES]) + more


COMMAND = Command(
    help="Import a SUMO network as a map; convert OpenStreetMap and OpenDRIVE with netconvert.",
    example="scm import sumo town.net.xml --out town.toml --scale 14",
    arguments=_arguments,
    run=_run,
)
