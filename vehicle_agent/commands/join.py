"""`vehicle-agent join`: be one car of a city, simulated or real."""

import argparse
import gc
import threading
from typing import TYPE_CHECKING

from scm.command import Command, credentials_argument, credentials_of, spawn_argument
from vehicle_agent.becoming import becomes_arguments, change_of, not_below_0

if TYPE_CHECKING:
    from vehicle_agent.body import BodyKind

TAG_KEY = "ips.tag_id"


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--name", required=True, help="of the vehicle: a-z 0-9 _ -")
    parser.add_argument("--connect", required=True, metavar="ENDPOINT", help="the city's router")
    credentials_argument(parser)
    parser.add_argument("--city", default="city", help="name of the city on the bus (%(default)s)")
    parser.add_argument("--car", default="nigel", help="car file (%(default)s)")
    spawn_argument(parser)
    parser.add_argument(
        "--tag", type=int, metavar="ID",
        help="glued onto its roof; default: as its --calibration says, else as the city gives it",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, help="of the sensors' noise (%(default)s)")
    becomes_arguments(parser)
    _reality_arguments(parser)
    _real_arguments(parser)


def _reality_arguments(parser: argparse.ArgumentParser) -> None:
    reality = parser.add_argument_group(
        "a car of the independent reality", "in a clone of the repository; see docs/trials.md"
    )
    reality.add_argument(
        "--body", choices=("simulated", "reality"), default="simulated",
        help="what simulates the car (%(default)s)",
    )  # fmt: skip
    reality.add_argument("--engine", default="own", help="that moves it (%(default)s)")
    reality.add_argument(
        "--conceal", default="", metavar="EFFECT",
        help="that it gets after --after-s, unreported; drawn: any",
    )  # fmt: skip
    reality.add_argument(
        "--course", choices=("step", "ramp", "intermittent"), default="step",
        help="how it comes (%(default)s)",
    )  # fmt: skip
    reality.add_argument(
        "--lasts-s", type=float, default=120.0, metavar="S",
        help="until a ramp is complete, or what came is gone (%(default)g)",
    )  # fmt: skip
    reality.add_argument(
        "--strength", type=float, default=2.0,
        help="in multiples of the smallest size that 90 s of driving can show (%(default)g)",
    )  # fmt: skip


def _body_of(arguments: argparse.Namespace) -> "str | BodyKind":
    """Return what moves the car."""
    from scm.errors import RunError
    from vehicle_agent.body import BodyKind

    is_other = arguments.body == "reality"
    if arguments.becomes is None and not is_other:
        if arguments.conceal:
            raise RunError("--conceal: only a car of --body reality conceals something")
        return "nigel" if arguments.serial else "simulated"
    option = "--body" if is_other else "--becomes"
    if arguments.serial:
        raise RunError(f"{option}: a car that is simulated changes so, no real one (--serial)")
    if is_other and arguments.becomes is not None:
        raise RunError("--becomes: not with --body reality, whose cars change by --conceal")
    if is_other:
        return _of_reality(arguments)
    change = change_of(arguments)
    from vehicle_agent.bodies.simulated import SimulatedBody

    return BodyKind("remote", lambda car, seed, _: SimulatedBody(car, seed, change))


def _of_reality(arguments: argparse.Namespace) -> "BodyKind":
    """Return a car of the reality; what is not possible is refused before it joins."""
    from vehicle_agent.bodies.reality import changing
    from vehicle_agent.body import BodyKind

    not_below_0(arguments, "after_s", "lasts_s", "strength")
    body = changing(
        arguments.car, arguments.seed, arguments.engine, arguments.conceal, arguments.course,
        arguments.strength, arguments.after_s, arguments.lasts_s,
    )  # fmt: skip
    return BodyKind("remote", lambda *_: body)


def _real_arguments(parser: argparse.ArgumentParser) -> None:
    real = parser.add_argument_group("a real car", "see docs/real_nigel.md")
    real.add_argument("--serial", default="", metavar="PORT", help="drive a real Nigel over it")
    real.add_argument(
        "--baud", type=int, default=57600, help="of the port; a 4WD Nigel's Mega: 115200"
    )
    real.add_argument(
        "--calibration",
        default="",
        metavar="FILE",
        help="this very car's file: dead-band, gains, trim",
    )
    real.add_argument("--lidar", default="", metavar="PORT", help="its scanner's port")
    real.add_argument(
        "--lidar-kind", default="rplidar_a1", help="a file of vehicle_agent/lidars (%(default)s)"
    )
    real.add_argument(
        "--throttle-limit",
        type=float,
        default=1.0,
        metavar="SHARE",
        help="maximum throttle beyond the dead-band, 0 to 1 (%(default)s)",
    )
    real.add_argument(
        "--fence",
        type=float,
        nargs=4,
        metavar=("X0", "Y0", "X1", "Y1"),
        help="rectangle it stays within [m]; default: the city's floor",
    )


def _tag_of(arguments: argparse.Namespace) -> int | None:
    """Return the tag on the car's roof as given, else as in this car's calibration file."""
    if arguments.tag is not None or not arguments.calibration:
        tag_id: int | None = arguments.tag
        return tag_id
    from scm.vehicles.car import load_car

    car = load_car(arguments.calibration)
    return round(car.value(TAG_KEY)) if car.has(TAG_KEY) else None


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.runtime.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.key import check_name
    from vehicle_agent.agent import AgentPart
    from vehicle_agent.body import Wiring
    from vehicle_agent.guard import rectangle
    from vehicle_agent.leaving import Leaving

    check_name(arguments.name, "--name")
    check_name(arguments.city, "--city")
    body = _body_of(arguments)
    credentials = credentials_of(arguments, arguments.name)
    stop_requested, done, clock = stop_on_signal(), threading.Event(), WallClock()
    with ZenohBus(
        arguments.city, arguments.name, arguments.connect, clock=clock, credentials=credentials
    ) as bus:
        part = AgentPart(
            arguments.name,
            arguments.car,
            arguments.spawn,
            bus.session,
            arguments.seed,
            body,
            Wiring(
                port=arguments.serial,
                baud=arguments.baud,
                calibration=arguments.calibration,
                lidar=arguments.lidar,
                lidar_kind=arguments.lidar_kind,
                throttle=arguments.throttle_limit,
                fence=rectangle(*arguments.fence) if arguments.fence else (),
            ),
            _tag_of(arguments),
        )
        try:
            run(Leaving(part, stop_requested, done), bus, clock, done, on_tick=True)
        finally:
            part.close()
    gc.freeze()  # freeing the compiler's objects one by one would take a quarter of a second
    return 0


COMMAND = Command(
    help="join a city as a car with its own dynamics, and drive until Ctrl-C",
    example="vehicle-agent join --name n7 --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
