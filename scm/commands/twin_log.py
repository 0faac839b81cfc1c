"""`scm twin log`: the changes of a car and the versions of its file, from the city's store."""

import argparse
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:
    from scm.records.twins import TwinCause, TwinChange, TwinVersion

LEAST_SHOWN = 0.05  # of probabilities


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("vehicle", metavar="VEHICLE", help="name of the car")
    parser.add_argument(
        "--state", metavar="URL", required=True,
        help="the city's store, sqlite:PATH or postgresql://..., as `scm up` has it",
    )  # fmt: skip
    parser.add_argument(
        "--between", nargs=2, type=int, metavar="N",
        help="only how these two versions differ",
    )  # fmt: skip


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import RunError
    from scm.records.twins import TwinChange, TwinVersion
    from scm.store.open import open_store
    from scm.store.records import records
    from scm.twin.car import CHANGES, NAME, VERSIONS

    file = Path(arguments.state.removeprefix("sqlite:"))
    if arguments.state.startswith("sqlite:") and not file.is_file():
        raise RunError(f"{file}: no such store")  # opening one would make it
    store, car = open_store(arguments.state), f"/{arguments.vehicle}"
    versions = records(store, "twins", f"{NAME}/{VERSIONS}{car}", TwinVersion)
    changes = records(store, "twins", f"{NAME}/{CHANGES}{car}", TwinChange)
    store.close()
    by_number = {one.number: one for one in versions.values()}
    if arguments.between is not None:
        print("\n".join(_between(by_number, arguments.vehicle, *arguments.between)))
        return 0
    if not by_number and not changes:
        raise RunError(f"{arguments.state}: nothing is stored of a change of {arguments.vehicle}")
    for change in sorted(changes.values(), key=lambda one: one.noticed_ns):
        print("\n".join(_of_change(change)))
    for number in sorted(by_number):
        print("\n".join(_of_version(by_number[number], by_number)))
    return 0


def _time(t_ns: int) -> str:
    return f"{datetime.fromtimestamp(t_ns / 1e9, UTC):%Y-%m-%d %H:%M:%S}"


def _of_change(change: "TwinChange") -> list[str]:
    low, high = (
        (t_ns - change.since_ns) / 1e9 for t_ns in (change.since_low_ns, change.since_high_ns)
    )
    since = f"{_time(change.since_ns)} ({low:+.1f} to {high:+.1f} s)"
    lines = [f"changed since {since}, noticed {_time(change.noticed_ns)}: {change.search}"]
    if change.causes:
        causes = [one for one in change.causes if one.probability >= LEAST_SHOWN]
        words = [f"{_cause(one)} {100 * one.probability:.0f} %" for one in causes]
        lines.append(f"  of {change.cause}: {', '.join(words)}")
    if change.text:
        lines.append(f"  {change.text}")
    for effect in change.effects:
        for one in effect.parameters:
            interval = f"{one.low:.4g} to {one.high:.4g}"
            share = f"{100 * effect.probability:.0f} %"
            lines.append(f"  {effect.name}, {share}: {one.name} {one.value:.4g} ({interval})")
    if change.drive_this:
        lines.append(f"  to tell {' and '.join(change.between)} apart: {change.drive_this}")
    return [*lines, *([f"  report: {change.report}"] if change.report else [])]


def _cause(cause: "TwinCause") -> str:
    if cause.x_m is not None:
        return f"{cause.kind} ({cause.x_m:.2f}, {cause.y_m:.2f}), {cause.radius_m:.1f} m"
    return f"{cause.kind} {cause.camera}".rstrip()


def _of_version(version: "TwinVersion", by_number: dict[int, "TwinVersion"]) -> list[str]:
    who = f", by {version.by}: {version.reason}" if version.by else ""
    made = f", found {_time(version.made_ns)}" if version.made_ns else ""
    lines = [f"version {version.number}: {version.state}{made}{who}", f"  {version.file}"]
    if version.number:
        lines += [f"  {line}" for line in _differences(version, by_number.get(version.after))]
    return lines


def _between(by_number: dict[int, "TwinVersion"], vehicle: str, first: int, then: int) -> list[str]:
    from scm.errors import RunError

    known = {0, *by_number}
    for number in (first, then):
        if number not in known:
            has = ", ".join(map(str, sorted(known)))
            raise RunError(f"{vehicle} has no version {number}; it has {has}")
    if then == 0:
        raise RunError("the second of two versions: expected more than 0, got 0")
    return _differences(by_number[then], by_number.get(first))


def _differences(version: "TwinVersion", before: "TwinVersion | None") -> list[str]:
    """Return how a version differs from another; None: from the file that the car came with."""
    from scm.errors import CarError
    from scm.twin.versions import differences
    from scm.vehicles.car import load_car

    try:
        cars = [load_car(version.car if before is None else before.file), load_car(version.file)]
    except CarError as error:
        return [str(error)]
    return differences(*cars)


COMMAND = Command(
    help="Print what changed of a car, and how the versions of its file differ.",
    example="scm twin log n3 --state sqlite:runs/city.db",
    arguments=_arguments,
    run=_run,
)
