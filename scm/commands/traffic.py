"""`scm traffic`: one part of the city, on its own."""

import argparse

from scm.command import Command, part_arguments, run_part, state_argument, state_of


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    state_argument(parser)
    parser.add_argument("--plan", help="signal plan at the start; default: the one of the map")
    parser.add_argument("--policy", default="fixed", help="of all junctions (%(default)s)")
    parser.add_argument(
        "--car",
        action="append",
        metavar="CAR",
        help="name or file of a car that drives here; repeatable; minimum times are safe for the "
        "slowest of them (nigel)",
    )
    parser.add_argument(
        "--learned", metavar="MODULE:FUNCTION", help="your own code, for the policy `learned`"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.load import load_map
    from scm.store.records import PlanRecord, records
    from scm.traffic.car_facts import facts_of, slowest_of
    from scm.traffic.signals.part import TrafficPart
    from scm.traffic.signals.policies.learned import load_learned
    from scm.traffic.signals.timing import NIGEL

    with state_of(arguments) as state:
        part = TrafficPart(
            load_map(arguments.map),
            arguments.plan,
            policy=arguments.policy,
            car=slowest_of(map(facts_of, arguments.car)) if arguments.car else NIGEL,
            learned=load_learned(arguments.learned) if arguments.learned else None,
            restored={} if state is None else records(state, "plans", "traffic", PlanRecord),
        )
        return run_part(part, arguments, state)


COMMAND = Command(
    help="Run the signals of a map's junctions.",
    example="scm traffic driving_school --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
