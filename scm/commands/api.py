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
    """Add where people find the server behind a proxy, and which proxies are trusted."""
    parser.add_argument(
        "--base",
        default="",
        metavar="PATH",
        help="path under which a proxy serves the dashboard, such as /city; it may strip it or not",
    )
    parser.add_argument(
        "--origin",
        action="append",
        default=[],
        metavar="URL",
        help="address at which people open the dashboard, such as https://lab.example, if a proxy "
        "gives it another name; otherwise changes from there need an API key",
    )
    parser.add_argument(
        "--trust-proxy",
        action="append",
        default=[],
        metavar="ADDRESS",
        help="a proxy, or a network of them (10.0.0.0/8), whose X-Forwarded-For is trusted; "
        "otherwise the address of the connection is logged and rate-limited",
    )


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    parser.add_argument("--host", default="127.0.0.1", help="address to bind (%(default)s)")
    parser.add_argument("--port", type=int, default=8000, help="port to bind (%(default)s)")
    parser.add_argument(
        "--keys",
        metavar="STORE",
        help="store of API keys from `scm key add`, sqlite:PATH or postgresql://...; required to "
        "bind any address other than this machine's own",
    )
    proxy_arguments(parser)
    parser.add_argument(
        "--state",
        metavar="STORE",
        help="store of the city's state, sqlite:PATH or postgresql://...: the audit log and the "
        "acknowledged events",
    )
    parser.add_argument(
        "--data",
        metavar="FOLDER",
        type=Path,
        help="folder of recordings, with reports, scenarios, calibrations and plans below it",
    )
    parser.add_argument(
        "--expects",
        action="append",
        default=[],
        metavar="PART",
        help="a part that should be running; /readyz lists those that are not",
    )
    parser.add_argument(
        "--script-credentials",
        metavar="FILE",
        type=Path,
        help="credentials of an operator, for the scripts that it runs in a guarded city",
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
    from scm.api.folders import folders_in
    from scm.api.gate import check_bind
    from scm.api.keys import KeyRing
    from scm.api.server import serve
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
    view, city_map, shipped = (
        CityView(),
        load_map(arguments.map),
        names("scm.traffic.signals.plans"),
    )
    credentials = credentials_of(arguments, view.name)
    with ZenohBus(arguments.city, view.name, arguments.connect, credentials=credentials) as bus:
        wire = BusWire(bus)
        app = create_app(
            view,
            wire.request,
            city_map,
            keys=keys,
            state=open_store(arguments.state) if arguments.state else None,
            folders=folders_in(arguments.data) if arguments.data else None,
            link=_link(arguments, bus, wire),
            plans={one.name: shipped for one in city_map.junctions},
            site=Site(arguments.base, arguments.origin),
        )

        def follow() -> None:
            try:
                run(view, bus, WallClock(), stop)
            except Exception as failure:  # noqa: BLE001  the edge of a thread; `run` has logged it
                failures.append(failure)
            finally:
                stop.set()  # without messages the server would show an outdated city for ever

        follower = threading.Thread(target=follow, name="view")
        follower.start()
        try:
            serve(app, arguments.host, arguments.port, stop, proxies=arguments.trust_proxy)
        finally:
            stop.set()
            follower.join()
    return 1 if failures else 0


COMMAND = Command(
    help="Serve REST, the event stream and the dashboard.",
    example="scm api driving_school --port 8000",
    arguments=_arguments,
    run=_run,
)
