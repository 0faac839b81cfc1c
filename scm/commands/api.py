"""`scm api`: REST, event stream and dashboard."""

import argparse
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command, credentials_of, part_arguments

if TYPE_CHECKING:
    from scm.api.city import Link
    from scm.api.wire import BusWire
    from scm.v2x.bus_zenoh import ZenohBus


def proxy_arguments(parser: argparse.ArgumentParser) -> None:
    """Add where people find the server behind a proxy, and which proxies are believed."""
    parser.add_argument(
        "--base",
        default="",
        metavar="PATH",
        help="path below which a proxy shows the dashboard, /city; it may take it off or leave it",
    )
    parser.add_argument(
        "--origin",
        action="append",
        default=[],
        metavar="URL",
        help="https://lab.example: where people find the dashboard, if a proxy calls it by another "
        "name; without, changes from there are refused unless they carry an API key",
    )
    parser.add_argument(
        "--trust-proxy",
        action="append",
        default=[],
        metavar="ADDRESS",
        help="a proxy, or a network of them (10.0.0.0/8), whose X-Forwarded-For is believed; "
        "without, the address that calls is the address that is noted and braked",
    )


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    parser.add_argument("--host", default="127.0.0.1", help="address to bind (%(default)s)")
    parser.add_argument("--port", type=int, default=8000, help="port to bind (%(default)s)")
    parser.add_argument(
        "--keys",
        metavar="STORE",
        help="API keys of `scm key add`, sqlite:PATH or postgresql://...: needed to bind any "
        "address but this machine's own",
    )
    proxy_arguments(parser)
    parser.add_argument(
        "--state",
        metavar="STORE",
        help="the city's state, sqlite:PATH or postgresql://...: its audit log, and which events "
        "were acknowledged",
    )
    parser.add_argument(
        "--data",
        metavar="FOLDER",
        type=Path,
        help="folder of recordings; reports, scenarios, calibrations and plans lie below it",
    )
    parser.add_argument(
        "--expects",
        action="append",
        default=[],
        metavar="PART",
        help="a part that should be there: /readyz says which are not",
    )
    parser.add_argument(
        "--script-credentials",
        metavar="FILE",
        type=Path,
        help="who the scripts are that it runs, where the city lets in nobody else: an operator",
    )


def _at_bus(arguments: argparse.Namespace) -> list[str]:
    """Return how a program of ours finds the bus, and as whom."""
    words = ["--connect", arguments.connect, "--city", arguments.city]
    return words + (["--credentials", str(arguments.credentials)] if arguments.credentials else [])


def _link(arguments: argparse.Namespace, bus: "ZenohBus", wire: "BusWire") -> "Link":
    from scm.api.city import Link
    from scm.clock import WallClock

    return Link(
        city=arguments.city,
        is_connected=lambda: bus.connected,
        rejected=lambda: bus.rejected,
        clock=WallClock(),
        wire=wire,
        connect=arguments.connect,
        script_credentials=arguments.script_credentials,
        words=_at_bus(arguments),
        map_file=arguments.map,
        parts=arguments.expects,
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.api.app import create_app
    from scm.api.based import Site
    from scm.api.gate import check_bind
    from scm.api.keys import KeyRing
    from scm.api.server import serve
    from scm.api.shelves import shelves_in
    from scm.api.view import CityView
    from scm.api.wire import BusWire
    from scm.clock import WallClock
    from scm.maps.load import load_map
    from scm.registry import names
    from scm.runtime.live import run, stop_on_signal
    from scm.store.open import open_store
    from scm.v2x.bus_zenoh import ZenohBus

    keys = KeyRing(open_store(arguments.keys)) if arguments.keys else None
    check_bind(arguments.host, keys)
    stop, failures = stop_on_signal(), list[Exception]()
    view, city_map, shipped = CityView(), load_map(arguments.map), names("scm.traffic.plans")
    credentials = credentials_of(arguments, view.name)
    with ZenohBus(arguments.city, view.name, arguments.connect, credentials=credentials) as bus:
        wire = BusWire(bus)
        app = create_app(
            view,
            wire.ask,
            city_map,
            keys=keys,
            state=open_store(arguments.state) if arguments.state else None,
            shelves=shelves_in(arguments.data) if arguments.data else None,
            link=_link(arguments, bus, wire),
            plans={one.name: shipped for one in city_map.junctions},
            site=Site(arguments.base, arguments.origin),
        )

        def hear() -> None:
            try:
                run(view, bus, WallClock(), stop)
            except Exception as failure:  # noqa: BLE001  the edge of a thread; `run` has logged it
                failures.append(failure)
            finally:
                stop.set()  # a server that hears nothing any more would show an old city for ever

        hearing = threading.Thread(target=hear, name="view")
        hearing.start()
        try:
            serve(app, arguments.host, arguments.port, stop, proxies=arguments.trust_proxy)
        finally:
            stop.set()
            hearing.join()
    return 1 if failures else 0


COMMAND = Command(
    help="REST, event stream and dashboard.",
    example="scm api driving_school --port 8000",
    arguments=_arguments,
    run=_run,
)
