"""`vehicle-agent drive`: let a trained network or a policy drive a car."""

import argparse
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command, agent_arguments, credentials_of, place

if TYPE_CHECKING:
    from vehicle_agent.trained_driver import TrainedDriver


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "model", type=Path, metavar="FILE", help="the network, by train; or a policy, by scm.gym"
    )
    parser.add_argument("--vehicle", required=True, metavar="NAME", help="the car to drive")
    parser.add_argument(
        "--throttle", type=float, metavar="SHARE",
        help="0 to 1; default: the network's, or the demonstration's",
    )  # fmt: skip
    parser.add_argument(
        "--spawn", nargs="?", const="", type=place, metavar="PLACE",
        help="put the car onto the map first, there or at any free place",
    )  # fmt: skip
    parser.add_argument(
        "--goal", type=place, default="", metavar="PLACE",
        help="where a policy is to park: a spawn place or bay of the map, or X,Y,DEG "
        "(--goal=-0.7,0,90 if X is below 0)",
    )  # fmt: skip
    parser.add_argument(
        "--pursue", default="", metavar="CAR", help="the car that a policy is to follow"
    )
    parser.add_argument(
        "--ignore-signals", action="store_true", help="drive on whatever the signals show"
    )
    agent_arguments(parser, "of this agent, which holds the lease (drive-VEHICLE)")


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.errors import LearningError, RunError
    from scm.runtime.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.key import check_name
    from vehicle_agent.leaving import Leaving

    try:
        from vehicle_agent.policy.model import is_policy
    except ModuleNotFoundError as cause:
        msg = f"{cause.name} is not installed: pip install onnxruntime, or 'scm[learn]'"
        raise RunError(msg) from cause
    vehicle = check_name(arguments.vehicle, "--vehicle")
    check_name(arguments.city, "--city")
    throttle = arguments.throttle
    if throttle is not None and not 0.0 <= throttle <= 1.0:
        raise LearningError(f"--throttle: expected 0 to 1, got {throttle:g}")
    credentials = credentials_of(arguments)
    name = arguments.name or f"drive-{vehicle}"
    name = check_name(name if credentials is None else credentials.station, "--name")
    stop_requested, done, clock = stop_on_signal(), threading.Event(), WallClock()
    driver = _policy if is_policy(arguments.model) else _network
    part, trained_on = driver(name, vehicle, arguments)
    print(f"{vehicle} is driven by {trained_on}, until Ctrl-C", flush=True)
    with ZenohBus(
        arguments.city, name, arguments.connect, clock=clock, credentials=credentials
    ) as bus:
        run(Leaving(part, stop_requested, done), bus, clock, done, on_tick=True)
    if part.problem:
        raise LearningError(part.problem)
    print(part.detail())
    return 0


def _network(name: str, vehicle: str, arguments: argparse.Namespace) -> "tuple[TrainedDriver, str]":
    from scm.errors import LearningError
    from vehicle_agent.cloning.driving import NetworkPart

    if arguments.goal or arguments.pursue:
        raise LearningError("--goal and --pursue are for policies: a network drives by its camera")
    part = NetworkPart(
        name, vehicle, arguments.model, arguments.throttle, spawn=arguments.spawn,
        ignore_signals=arguments.ignore_signals,
    )  # fmt: skip
    metadata = part.model.metadata
    return part, f"{metadata.network}, learned on {metadata.map}"


def _policy(name: str, vehicle: str, arguments: argparse.Namespace) -> "tuple[TrainedDriver, str]":
    from scm.errors import LearningError
    from scm.v2x.key import check_name
    from vehicle_agent.policy.driving import PolicyPart
    from vehicle_agent.policy.senses import Aim

    if arguments.throttle is not None:
        raise LearningError("--throttle: a policy has its own")
    pursued = check_name(arguments.pursue, "--pursue") if arguments.pursue else ""
    part = PolicyPart(
        name, vehicle, arguments.model, spawn=arguments.spawn,
        ignore_signals=arguments.ignore_signals, aim=Aim(arguments.goal, pursued),
    )  # fmt: skip
    return part, f"a policy for {part.policy.metadata.task}"


COMMAND = Command(
    help="let a trained network or a policy drive a car",
    example="vehicle-agent drive model.onnx --vehicle n1",
    arguments=_arguments,
    run=_run,
)
