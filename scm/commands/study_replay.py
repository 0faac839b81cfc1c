"""`scm study replay`: one case again, in a live city with its dashboard."""

import argparse
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:
    from scm.api.lockstep_pages import WatchedLockstep
    from scm.runtime.lockstep import Lockstep
    from scm.runtime.part import Part
    from scm.study.loaded_study import LoadedStudy
    from scm.study.row import Row
    from scm.v2x.faults import Faults


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a study's results")
    parser.add_argument("case", type=int, metavar="CASE", help="its number")
    parser.add_argument(
        "--speed", type=float, default=1.0, metavar="X", help="times real time (%(default)s)"
    )
    parser.add_argument("--port", type=int, default=8000, help="of the dashboard (%(default)s)")
    parser.add_argument(
        "--exit", action="store_true", help="end with the case, and do not wait for Ctrl-C"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import StudyError
    from scm.runtime.live import stop_on_signal
    from scm.study.results import open_results

    if not arguments.speed > 0.0:
        raise StudyError(f"--speed: expected above 0, got {arguments.speed:g}")
    results = open_results(arguments.folder)
    known = results.rows.get(arguments.case)
    print(f"case {arguments.case} of {results.study.file.name}", flush=True)
    stop = stop_on_signal()
    with _watched(results.study, arguments.case, known, arguments) as row:
        print("\n".join(_compared(row, known)), flush=True)
        if not arguments.exit:
            print("the city stands still; Ctrl-C ends it", flush=True)
            stop.wait()
    return 0


@contextmanager
def _watched(
    study: "LoadedStudy", number: int, known: "Row | None", arguments: argparse.Namespace
) -> Iterator["Row"]:
    """Run a case while its pages are served, and go on serving them."""
    from scm.api.lockstep_pages import LockstepPages, WatchedLockstep
    from scm.api.view import CityView

    cities, pages = list["WatchedLockstep"](), list["LockstepPages"]()
    with tempfile.TemporaryDirectory() as folder:

        def make(parts: "Iterable[Part]", faults: "Faults | None") -> "Lockstep":
            """Make a city with pages; of several that a scenario makes, the newest has them."""
            for page in pages:
                page.close()
            view = CityView()
            city = WatchedLockstep([*parts, view], faults, arguments.speed)
            page = LockstepPages(
                city, view, study.base.city_map, Path(folder), city.lock, port=arguments.port
            )
            cities.append(city)
            pages[:] = [page]
            print(f"dashboard: {page.url}", flush=True)
            return city

        try:
            row = study.run(number, None if known is None else known.values, make)
            for city in cities:
                city.stand()
            yield row
        finally:
            for page in pages:
                page.close()
            for city in cities:
                city.end()


def _compared(row: "Row", known: "Row | None") -> Iterator[str]:
    """Yield how a case ended, and whether it did so before."""
    yield f"{row.outcome}{f': {row.detail}' if row.detail else ''}"
    measures: Mapping[str, float] = row.measures
    for name, value in measures.items():
        yield f"  {name} = {value:.9g}"
    if known is None:
        yield "it was not run before"
    elif (row.outcome, repr(row.measures)) == (known.outcome, repr(known.measures)):
        yield "as before, bit for bit"
    else:
        yield f"before it was {known.outcome}, {dict(known.measures)}: did you change its city?"


COMMAND = Command(
    help="Replay one case of a study in a live city with its dashboard.",
    example="scm study replay runs/studies/parking_noise 417",
    arguments=_arguments,
    run=_run,
)
