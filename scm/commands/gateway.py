"""`scm gateway`: the link to one neighbouring city, on its own."""

import argparse
from pathlib import Path

from scm.command import Command, part_arguments, run_part


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    parser.add_argument("--neighbour", required=True, metavar="CITY", help="the other city")
    parser.add_argument(
        "--inner", required=True, metavar="ENDPOINT",
        help="socket of this city's router for its gateways, unixsock-stream/PATH",
    )  # fmt: skip
    side = parser.add_mutually_exclusive_group(required=True)
    side.add_argument("--join", metavar="ENDPOINT", help="gateway of the neighbour")
    side.add_argument("--admit", metavar="ENDPOINT", help="where to wait for the neighbour")
    parser.add_argument(
        "--fleet", type=Path, metavar="FILE",
        help="fleet file with certificates; default: a link on this machine without them",
    )  # fmt: skip


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.command import credentials_of
    from scm.maps.load import load_map
    from scm.runtime.gateway_part import GatewayPart
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.crossing import gateway_station
    from scm.v2x.fleet_file import load_fleet
    from scm.v2x.gateway import Border, Gateway
    from scm.v2x.link_log import LinkLog
    from scm.v2x.mailbox import Mailbox
    from scm.v2x.messages.neighbour_status import NeighbourStatus

    neighbour, received = arguments.neighbour, Mailbox(100)
    chosen = [one for one in load_map(arguments.map).neighbours if one.city == neighbour]
    credentials = credentials_of(arguments, gateway_station(neighbour))
    fleet = None if arguments.fleet is None else load_fleet(arguments.fleet)
    border = Border(
        city=arguments.city,
        neighbour=neighbour,
        inner=arguments.inner,
        endpoint=arguments.admit or arguments.join,
        listens=arguments.admit is not None,
        shows=chosen[0].messages if chosen else (),
        secrets=None if fleet is None else fleet.folder,
    )
    with (
        LinkLog(neighbour, WallClock()) as log,
        Gateway(border) as gateway,
        ZenohBus(
            neighbour, gateway_station(neighbour), arguments.connect, credentials=credentials
        ) as abroad,
    ):
        abroad.subscribe(NeighbourStatus, {"neighbour": arguments.city}, received)
        part = GatewayPart(border, received, gateway.far_names, log.why, gateway.reopen)
        return run_part(part, arguments)


COMMAND = Command(
    help="Link a city to one neighbour; `scm up --join` starts it.",
    example="scm gateway map.toml --neighbour lab_b --join tls/192.168.2.7:7448 --fleet fleet.toml "
    "--inner unixsock-stream//run/user/1000/city.sock",
    arguments=_arguments,
    run=_run,
)
