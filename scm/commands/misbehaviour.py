"""`scm misbehaviour`: one part of the city, on its own."""

import argparse

from scm.command import Command, part_arguments, run_part


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.load import load_map
    from scm.traffic.misbehaviour.part import MisbehaviourPart

    return run_part(MisbehaviourPart(load_map(arguments.map)), arguments)


COMMAND = Command(
    help="Check what cars claim over the radio, with the Eye as witness.",
    example="scm misbehaviour driving_school --connect tcp/127.0.0.1:7447",
    arguments=part_arguments,
    run=_run,
)
