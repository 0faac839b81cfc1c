"""`scm ros2`: the city as ROS 2 nodes see it."""

import argparse

from scm.command import Command, part_arguments, run_part
from scm.ros2.wire import DEFAULT_LISTEN

MAX_DOMAIN = 232  # what leaves DDS a port: ROS 2 knows no more


def _domain(text: str) -> int:
    if not text.isdecimal() or int(text) > MAX_DOMAIN:
        msg = f"got {text!r}, expected 0 to {MAX_DOMAIN}"
        raise argparse.ArgumentTypeError(msg)
    return int(text)


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    parser.add_argument(
        "--domain", type=_domain, default=0, metavar="N", help="ROS_DOMAIN_ID (%(default)s)"
    )
    side = parser.add_mutually_exclusive_group()
    side.add_argument(
        "--ros-listen",
        default=DEFAULT_LISTEN,
        metavar="ENDPOINT",
        help="address of the router that ROS nodes connect to (%(default)s)",
    )
    side.add_argument(
        "--ros-connect",
        metavar="ENDPOINT",
        help="connect to the rmw_zenohd that runs there instead",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.load import load_map
    from scm.ros2.part import RosPart
    from scm.ros2.wire import Wire

    city_map = load_map(arguments.map)
    listen = arguments.ros_connect is None
    endpoint = arguments.ros_listen if listen else arguments.ros_connect
    with Wire(endpoint, arguments.domain, listen=listen) as wire:
        return run_part(RosPart(city_map, wire), arguments)


COMMAND = Command(
    help="Show the city to ROS 2 (Jazzy, rmw_zenoh) and let its nodes drive.",
    example="scm ros2 driving_school --domain 0",
    arguments=_arguments,
    run=_run,
)
