"""`scm monitor`: one part of the city, on its own."""

import argparse

from scm.command import Command, part_arguments, run_part, state_argument, state_of


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    state_argument(parser)


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import waited_ns
    from scm.maps.load import load_map
    from scm.store.records import FaultRecord, records
    from scm.traffic.monitor.part import MonitorPart

    with state_of(arguments) as state:
        stored = {} if state is None else records(state, "latches", "monitor", FaultRecord)
        faults = {junction: record.fault for junction, record in stored.items()}
        part = MonitorPart(load_map(arguments.map), faults, waited_ns)
        return run_part(part, arguments, state)


COMMAND = Command(
    help="Monitor the signals independently, and latch flashing red on a fault.",
    example="scm monitor driving_school --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
