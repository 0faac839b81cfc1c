"""`scm import sumo`: a SUMO network as a map file."""

import argparse
from pathlib import Path

from scm.command import Command
from scm.errors import MapError


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
        "--scale", type=float, help="full size over ours (14, or what makes it fit the floor)"
    )
    parser.add_argument(
        "--floor", type=floor_of, metavar="WxD", help="floor that it must fit [m], as in 6x4"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.load import load_map
    from scm.maps.sumo import import_sumo
    from scm.maps.sumo_build import PLAN
    from scm.maps.sumo_toml import map_toml
    from scm.traffic.own_plan import OWN, adopted

    if arguments.scale is not None and not arguments.scale > 0.0:
        raise MapError(f"--scale: got {arguments.scale}, expected above 0")
    if not arguments.out.parent.is_dir():
        raise MapError(f"--out: no folder {arguments.out.parent} for {arguments.out.name}")
    made = import_sumo(arguments.net, scale=arguments.scale, floor_m=arguments.floor)
    built, unsafe = adopted(made.city_map)
    arguments.out.write_text(map_toml(built), encoding="utf-8")
    city = load_map(arguments.out)
    width, depth = (high - low for low, high in (city.floor.x_m, city.floor.y_m))
    print(f"{arguments.out}: 1:{made.scale:g} on {width:.1f} x {depth:.1f} m")
    print(
        f"  {len(city.lanes)} lanes, {len(city.junctions)} junctions with signals, "
        f"{len(city.crossings)} without"
    )
    print(
        f"  lanes within {1e3 * made.error_m:.0f} mm of the network's, least radius "
        f"{made.tightest_m:.2f} m, {made.shortened} lanes shortened for their turns"
    )
    if made.left_out:
        print(f"  {len(made.left_out)} turns back left out: a Nigel cannot drive them")
    if city.junctions:
        kept = sum(junction.plan == OWN for junction in city.junctions)
        print(f"  the network's signal programs kept at {kept} of {len(city.junctions)} junctions")
    for name, why in (made.unread | unsafe).items():
        print(f"  {name} runs plan {PLAN!r} instead: {why}")
    return 0


COMMAND = Command(
    help="A SUMO network as a map file; OpenStreetMap and OpenDRIVE by netconvert first.",
    example="scm import sumo town.net.xml --out town.toml --scale 14",
    arguments=_arguments,
    run=_run,
)
