"""`scm api`: REST, event stream and dashboard."""

import argparse
import threading
from pathlib import Path

from scm.command import Command, credentials_of, part_arguments


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
    parser.add_argument(
        "--data",
        metavar="FOLDER",
        type=Path,
        help="folder of recordings; reports, scenarios, calibrations and plans lie below it",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.api.app import create_app
    from scm.api.city import Link
    from scm.api.gate import check_bind
    from scm.api.keys import KeyRing
    from scm.api.server import serve
    from scm.api.shelves import shelves_in
    from scm.api.view import CityView
    from scm.clock import WallClock
    from scm.live import run, stop_on_signal
    from scm.maps.load import load_map
    from scm.registry import names
    from scm.store.open import open_store
    from scm.v2x.ask import ask
    from scm.v2x.bus_zenoh import ZenohBus

    keys = KeyRing(open_store(arguments.keys)) if arguments.keys else None
    check_bind(arguments.host, keys)
    stop = stop_on_signal()
    view, city_map = CityView(), load_map(arguments.map)
    credentials = credentials_of(arguments, view.name)
    with ZenohBus(arguments.city, view.name, arguments.connect, credentials=credentials) as bus:
        app = create_app(
            view,
            lambda request, timeout_s: ask(bus, request, timeout_s),
            city_map,
            keys=keys,
            map_file=arguments.map,
            shelves=shelves_in(arguments.data) if arguments.data else None,
            link=Link(
                city=arguments.city,
                is_connected=lambda: bus.connected,
                rejected=lambda: bus.rejected,
                clock=WallClock(),
            ),
            plans={junction.name: names("scm.traffic.plans") for junction in city_map.junctions},
        )

        def hear() -> None:
            try:
                run(view, bus, WallClock(), stop)
            except Exception as failure:  # noqa: BLE001  the edge of a thread; `run` has logged it
                failures.append(failure)
            finally:
                stop.set()  # a server that hears nothing any more would show an old city for ever

        failures: list[Exception] = []
        hearing = threading.Thread(target=hear, name="view")
        hearing.start()
        try:
            serve(app, arguments.host, arguments.port, stop)
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
