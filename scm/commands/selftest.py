"""`scm selftest`: inject faults into a city, and measure its reaction."""

import argparse
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command, credentials_argument, credentials_of

if TYPE_CHECKING:
    from scm.records.city_map import CityMap
    from scm.selftest.signals import SignalTrials
    from scm.v2x.credentials import Credentials


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "fault",
        nargs="*",
        metavar="FAULT",
        help="inject only these; default: all, one after the other",
    )
    parser.add_argument(
        "--faults",
        action="store_true",
        help="inject faults into processes, router, disk and bus of a private city instead",
    )
    parser.add_argument("--map", default="driving_school", help="map name or file (%(default)s)")
    parser.add_argument(
        "--connect",
        metavar="ENDPOINT",
        help="test the signals of a city that runs on this machine, not of a private one",
    )
    parser.add_argument("--city", default="city", help="its name (%(default)s)")
    credentials_argument(parser)
    parser.add_argument("--yes", action="store_true", help="start without confirmation")
    parser.add_argument("--list", action="store_true", help="list the faults, and exit")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the table as Markdown")


def _run(arguments: argparse.Namespace) -> int:
    from scm.selftest.city_faults import inject_city_faults
    from scm.selftest.signals import faults_of

    if arguments.list:
        print("\n".join(_known()))
        return 0
    if arguments.faults:
        return inject_city_faults(arguments.map, arguments.fault, print, arguments.out)
    faults_of(arguments.fault)
    if arguments.connect and not (arguments.yes or _agreed(arguments.connect)):
        print("no fault was injected")
        return 0
    return _test_signals(arguments)


def _known() -> Iterator[str]:
    """Yield every fault's name and what it is, by the call that injects it."""
    from scm.registry import names
    from scm.selftest.city_faults import CITY_FAULTS
    from scm.selftest.signals import FAULTS, faults_of

    yield "of signals, `scm selftest NAME ...`:"
    for name, fault in zip(names(FAULTS), faults_of(()), strict=True):
        yield f"  {name:<20} {fault.what}"
    yield "of a whole city of its own, `scm selftest --faults NAME ...`:"
    for name, inject in CITY_FAULTS.items():
        yield f"  {name:<20} {(inject.__doc__ or '').partition(chr(10))[0]}"


def _agreed(endpoint: str) -> bool:
    print(f"The signals of the city at {endpoint} will fail one way after the other, and flash.")
    print("Continue? [y/N] ", end="", flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _test_signals(arguments: argparse.Namespace) -> int:
    from scm.selftest.signals import HEAD
    from scm.selftest.table import markdown_table, text_table

    with _trials(arguments) as trials:
        outcomes = []
        for outcome in trials.run(arguments.fault):
            outcomes.append(outcome)
            print(f"  {outcome.what}: {outcome.reported or 'nothing'}", flush=True)
    rows = [outcome.row() for outcome in outcomes]
    print(text_table(HEAD, rows))
    if arguments.out:
        arguments.out.write_text(markdown_table(HEAD, rows) + "\n")
    return 0 if all(outcome.ok for outcome in outcomes) else 1


@contextmanager
def _trials(arguments: argparse.Namespace) -> "Iterator[SignalTrials]":
    from scm.maps.load import load_map
    from scm.selftest.city import CITY, SIGNALS_ONLY, City

    city_map = load_map(arguments.map)
    with ExitStack() as stack:
        if arguments.connect:
            from scm.selftest.part_process import send_to_part

            send = partial(send_to_part, "traffic", arguments.connect)
            facts = arguments.connect, arguments.city
        else:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            own = stack.enter_context(City(arguments.map, folder, SIGNALS_ONLY))
            send, facts = partial(own.send, "traffic"), (own.endpoint, CITY)
        credentials = credentials_of(arguments)
        yield stack.enter_context(_open(city_map, *facts, credentials, send))


@contextmanager
def _open(
    city_map: "CityMap",
    endpoint: str,
    city: str,
    credentials: "Credentials | None",
    send: Callable[[signal.Signals], None],
) -> "Iterator[SignalTrials]":
    from scm.selftest.observer import Observer
    from scm.selftest.signals import SignalTrials
    from scm.selftest.stand_in import StandIn

    junction = city_map.junctions[0].name if city_map.junctions else ""
    with Observer(city_map, endpoint, city, credentials) as observer:
        make = partial(StandIn, city_map, junction, endpoint, city, credentials)
        yield SignalTrials(city_map, observer, make, send)


COMMAND = Command(
    help="Inject every known fault into a city, and measure its reaction.",
    example="scm selftest frozen_controller short_yellow",
    arguments=_arguments,
    run=_run,
)
