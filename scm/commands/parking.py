"""`scm parking`: one part of the city, on its own."""

import argparse

from scm.command import Command, part_arguments, run_part


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.load import load_map
    from scm.traffic.parking.part import ParkingPart

    return run_part(ParkingPart(load_map(arguments.map)), arguments)


COMMAND = Command(
    help="Give parking bays to cars that request one, and let them drive there in turn.",
    example="scm parking parking_lot --connect tcp/127.0.0.1:7447",
    arguments=part_arguments,
    run=_run,
)
