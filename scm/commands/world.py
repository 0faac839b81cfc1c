"""`scm world`: one part of the city, on its own."""

import argparse

from scm.command import Command, part_arguments, run_part, state_argument, state_of


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    state_argument(parser)
    parser.add_argument(
        "--hosted",
        type=int,
        default=0,
        metavar="N",
        help="cars to spawn at the start (%(default)s)",
    )
    parser.add_argument("--car", default="nigel", help="their car file (%(default)s)")
    parser.add_argument(
        "--radio",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="radio model instead of the map's, such as loss=0.3; see docs/radio.md",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.load import load_map
    from scm.maps.radio import with_radio
    from scm.vehicles.car import car_names
    from scm.world.part import WorldPart
    from scm.world.restore import read_restored

    hosted = tuple((f"n{i + 1}", arguments.car) for i in range(arguments.hosted))
    with state_of(arguments) as state:
        part = WorldPart(
            with_radio(load_map(arguments.map), arguments.radio),
            arguments.seed,
            hosted,
            restored=None if state is None else read_restored(state),
            city=arguments.city,
        )
        # Loaded when its first car comes, a kernel would stop the city for a moment.
        for car in car_names():
            part.world.cars.garage.prepare(car)
        return run_part(part, arguments, state)


COMMAND = Command(
    help="Simulate the shared world: cars, contacts, sensors, radio, leases.",
    example="scm world driving_school --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
