"""`scm monitor`: one part of the city, on its own."""

import argparse

from scm.command import Command, part_arguments, run_part


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    parser.add_argument(
        "--fault",
        action="append",
        default=[],
        metavar="JUNCTION=FAULT",
        help="a fault that was latched before and is not reset yet; may be repeated",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.load import load_map
    from scm.traffic.monitor_part import MonitorPart

    faults = dict(fault.partition("=")[::2] for fault in arguments.fault)
    part = MonitorPart(load_map(arguments.map), faults)
    return run_part(part, arguments)


COMMAND = Command(
    help="The second channel that doubts the signals.",
    example="scm monitor driving_school --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
