"""`scm traffic`: one part of the city, on its own."""

import argparse

from scm.command import Command, part_arguments, run_part, state_argument, state_of


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    state_argument(parser)
    parser.add_argument("--plan", help="signal plan at the start; default: the one of the map")


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.load import load_map
    from scm.traffic.part import TrafficPart

    with state_of(arguments) as state:
        part = TrafficPart(load_map(arguments.map), arguments.plan)
        return run_part(part, arguments, state)


COMMAND = Command(
    help="The signals of a map's junctions.",
    example="scm traffic driving_school --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
