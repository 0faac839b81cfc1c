"""`scm observer`: counts traffic and finds violations, on its own."""

import argparse

from scm.command import Command, part_arguments, run_part


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.load import load_map
    from scm.traffic.observation.part import ObserverPart

    return run_part(ObserverPart(load_map(arguments.map)), arguments)


COMMAND = Command(
    help="Measure traffic: counts, delays, queues and violations, from cameras and CAMs.",
    example="scm observer driving_school --connect tcp/127.0.0.1:7447",
    arguments=part_arguments,
    run=_run,
)
