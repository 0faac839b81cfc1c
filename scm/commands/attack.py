"""`scm attack`: a car that sends false messages, to test the misbehaviour part."""

import argparse
import gc

from scm.command import Command, credentials_argument
from scm.traffic.misbehaviour.attack import attack_names
from scm.v2x.router import DEFAULT_ENDPOINT


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("attack", metavar="NAME", help=", ".join(attack_names()))
    parser.add_argument(
        "--car", required=True, metavar="STATION", help="the car's name in the city"
    )
    parser.add_argument(
        "--map", default="driving_school", help="the city's map, name or file (%(default)s)"
    )
    parser.add_argument("--spawn", default="", help="where it enters; default: any free place")
    parser.add_argument(
        "--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT", help="Zenoh router (%(default)s)"
    )
    credentials_argument(parser)
    parser.add_argument("--city", default="city", help="name of the city on the bus (%(default)s)")
    parser.add_argument(
        "--seed", type=int, default=0, help="of the attack's randomness (%(default)s)"
    )


def _run(arguments: argparse.Namespace) -> int:
    import threading
    from functools import partial

    from scm.clock import WallClock
    from scm.command import credentials_of
    from scm.maps.load import load_map
    from scm.runtime.live import run, stop_on_signal
    from scm.traffic.misbehaviour.attacker import Attacker
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.key import check_name
    from vehicle_agent.agent import AgentPart
    from vehicle_agent.leaving import Leaving

    name, attacks = check_name(arguments.car, "--car"), {arguments.car: arguments.attack}
    credentials = credentials_of(arguments, name)
    report = partial(print, flush=True)
    report(f"{name} joins the city {arguments.city!r} at {arguments.connect}; Ctrl-C to leave")
    stop, done, clock = stop_on_signal(), threading.Event(), WallClock()
    with ZenohBus(arguments.city, name, arguments.connect, credentials=credentials) as bus:
        agent = AgentPart(name, "nigel", arguments.spawn, bus.session, arguments.seed)
        city_map = load_map(arguments.map)
        part = Attacker(agent, attacks, city_map, arguments.seed, print_line=report)
        run(Leaving(part, stop, done), bus, clock, done)
    gc.freeze()  # as in `scm.command.run_part`
    return 0


COMMAND = Command(
    help="Join as a car that drives correctly and sends false messages.",
    example="scm attack zero_speed --car n7 --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
