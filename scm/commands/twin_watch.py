"""`scm twin watch`: since when is a recorded car no longer what its car file says?"""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

LEAST_SHOWN = 0.05  # of probabilities

if TYPE_CHECKING:
    from scm.twin.places import PlaceWatch
    from scm.twin.watch import CarWatch, Noticed
    from scm.twin.windows import WatchedNumber


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recording", type=Path, help="description file, its folder, or the .mcap of a run"
    )
    parser.add_argument("--car", metavar="FILE", help="car file or name; default: the recording's")
    parser.add_argument("--vehicle", metavar="NAME", help="only this car of several")
    parser.add_argument(
        "--data", type=Path, metavar="DIR",
        help="folder of the tables; default: beside the description",
    )  # fmt: skip
    parser.add_argument(
        "--false-alarm-h", type=float, default=200.0, metavar="HOURS",
        help="of driving, in which a car that does not change may be reported once (%(default)g)",
    )  # fmt: skip


def _run(arguments: argparse.Namespace) -> int:
    from scm.recorder.drives import recordings_of
    from scm.twin.detector import threshold_of
    from scm.twin.places import PlaceWatch
    from scm.twin.watch import CarWatch, watch_all
    from scm.twin.windows import WatchedCar
    from scm.vehicles.car import load_car

    threshold, failures = threshold_of(arguments.false_alarm_h), list[str]()
    found = recordings_of(arguments.recording, arguments.data, arguments.vehicle, failures.append)
    places, cars, watches = PlaceWatch(threshold), dict[str, WatchedCar](), dict[str, CarWatch]()
    for recording in found:
        name = arguments.car or recording.vehicle
        if name not in cars:
            cars[name] = WatchedCar(load_car(name, trusted=arguments.car is not None))
        one = watches[recording.name] = CarWatch(cars[name], threshold)
        one.evidence.most = sys.maxsize
    changes = watch_all({one.name: (one, watches[one.name]) for one in found}, places)
    watched = {name: (one, changes[name]) for name, one in watches.items()}
    for vehicle, (one, noticed) in watched.items():
        who = vehicle if len(found) > 1 else arguments.recording
        print(f"{who}: {_summary(one, len(noticed))}")
        for change in noticed:
            print("\n".join([*_lines(change), *_whose(change, vehicle, watched, places)]))
    for place in places.found:
        print(f"at {place.noticed_s:.0f} s: {place.in_words()}")
    for failure in failures:
        print(f"scm twin watch: {failure}", file=sys.stderr)
    return 0


def _summary(watched: "CarWatch", changes: int) -> str:
    from scm.twin.detector import LEARN, LEARN_WELL
    from scm.twin.windows import EVERY_S

    driven = f"car {watched.car.name}, driven for {watched.driven_s:.0f} s"
    if watched.driven_s < LEARN * EVERY_S:
        return f"{driven}: too short, it takes {LEARN * EVERY_S:.0f} s to learn how it strays"
    times = {0: "it did not change", 1: "it changed once"}
    text = f"{driven}: {times.get(changes, f'it changed {changes} times')}"
    if watched.driven_s < LEARN_WELL * EVERY_S:
        text += f" (in the first {LEARN_WELL * EVERY_S:.0f} s only plain changes are noticed)"
    return text


def _lines(noticed: "Noticed") -> list[str]:
    """Return what a change is, in words."""
    change = noticed.change
    at, first, last = change.onset_s
    like = (_amount(noticed.number, change.size), *(_amount(*one) for one in noticed.alike))
    return [
        f"  changed at {at:.1f} s ({first:.1f} to {last:.1f} s), noticed at"
        f" {change.noticed_s:.0f} s, score {abs(change.score):.1f}",
        f"    as by {', or '.join(like)}",
    ]


def _whose(
    noticed: "Noticed",
    vehicle: str,
    watched: "dict[str, tuple[CarWatch, list[Noticed]]]",
    places: "PlaceWatch",
) -> list[str]:
    """Return whose a change is by all cars of the run, in words; nothing of a car alone."""
    from scm.clock import seconds
    from scm.twin.causes import cause_in_words, located
    from scm.twin.evidence import witness

    change = noticed.as_change()
    cars = {
        name: witness(
            one.evidence, 0.0, [other.as_change() for other in changes], seconds(change.since_ns),
            is_own=name == vehicle,
        )
        for name, (one, changes) in watched.items()
    }  # fmt: skip
    found = located(change, vehicle, cars, places) if len(watched) > 1 else None
    if found is None:
        return []
    shares = ", ".join(
        f"{one.kind} {100.0 * one.probability:.0f} %"
        for one in found.causes
        if one.probability >= LEAST_SHOWN
    )
    if found.cause == "undecided":
        return [f"    whose it is, is undecided: {shares}. {found.decide_by}"]
    return [f"    {cause_in_words(found, vehicle)} ({shares})"]


def _amount(number: "WatchedNumber", size: float) -> str:
    unit = "" if number.unit in ("1", "") else f" {number.unit}"
    return f"{number.effect} ({number.name} {size:+.3g}{unit})"


COMMAND = Command(
    help="Find out since when a recorded car is not what its car file says.",
    example="scm twin watch runs/city.mcap --vehicle n3",
    arguments=_arguments,
    run=_run,
)
