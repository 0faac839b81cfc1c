"""`scm replay`: simulate a recorded drive from its commands, and print the errors."""

import argparse
import csv
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scm.recording.read import Recording
    from scm.replay.free_run import FreeRun
    from scm.vehicles.car import Car

HORIZONS_S = (0.5, 1.0, 3.0)
DOUBTFUL = ("other_car", "without_effect", "unrelated", "standing")  # is simulated nevertheless


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recording",
        nargs="+",
        type=Path,
        help="description files, their folders, or the .mcap of a run",
    )
    parser.add_argument("--car", metavar="FILE", help="car file or name; default: the recording's")
    parser.add_argument("--vehicle", metavar="NAME", help="only this car of several")
    parser.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help="folder of the tables; default: beside the description",
    )
    parser.add_argument(
        "--horizon-s", type=float, default=3.0, help="length of a window [s] (%(default)g)"
    )
    parser.add_argument(
        "--strict",
        action="store_true",
        help="refuse a recording in which rows must be left out or repaired",
    )
    parser.add_argument("--from-s", type=float, metavar="S", help="leave out everything before [s]")
    parser.add_argument("--to-s", type=float, metavar="S", help="leave out everything after [s]")
    parser.add_argument(
        "--report", type=Path, metavar="DIR", help="recompute the figures of this report"
    )
    parser.add_argument("--save", type=Path, metavar="CSV", help="write every window's poses here")


def _run(arguments: argparse.Namespace) -> int:
    from scm.errors import ScmError
    from scm.recorder.drives import recordings_of
    from scm.recording.span import part_of
    from scm.vehicles.car import load_car

    if arguments.report is not None:
        return _of_report(arguments)
    if arguments.save:
        _refuse_unwritable(arguments.save)
    given = load_car(arguments.car, trusted=True) if arguments.car else None
    runs, failures = [], list[str]()
    for path in arguments.recording:
        try:
            recordings = recordings_of(path, arguments.data, arguments.vehicle, failures.append)
        except ScmError as error:
            failures.append(str(error))
            continue
        for recording in recordings:
            try:
                part = part_of(recording, arguments.from_s, arguments.to_s)
                runs.append(_replayed(path, part, given, arguments))
            except ScmError as error:
                who = f"{recording.name}: " if len(recordings) > 1 else ""
                failures.append(f"{who}{error}")
    if arguments.save and runs:
        _save(arguments.save, runs)
        print(f"windows written to {arguments.save}")
    for failure in dict.fromkeys(failures):
        print(f"scm replay: {failure}", file=sys.stderr)
    return 0 if runs else 2


def _of_report(arguments: argparse.Namespace) -> int:
    """Print a report's figures beside the same ones worked out again."""
    from scm.mismatch.validate.check_report import check_report
    from scm.recorder.drives import recordings_of
    from scm.recording.span import part_of

    recordings = [
        part_of(recording, arguments.from_s, arguments.to_s)
        for path in arguments.recording
        for recording in recordings_of(path, arguments.data, arguments.vehicle)
    ]
    figures = check_report(arguments.report, recordings)
    if not figures:
        print(f"{arguments.report}: the report states no errors of free runs")
    for one in figures:
        same = "" if one.agrees else "   DIFFERS"
        print(
            f"{one.part:<8}{one.windows:>5} windows  {one.car:<11}{one.name:<11}"
            f"report {one.reported:.5g}, again {one.again:.5g}{same}"
        )
    return 0 if all(one.agrees for one in figures) else 2


def _replayed(
    path: Path, recording: "Recording", car: "Car | None", arguments: argparse.Namespace
) -> "FreeRun":
    """Drive one car's recording again, print the errors, and return the windows."""
    from scm.data_quality.prepare import prepare
    from scm.recorder.drives import SUFFIX
    from scm.replay.free_run import joined
    from scm.vehicles.car import load_car
    from scm.vehicles.sensor_correction import POSES

    car = car or load_car(recording.vehicle, trusted=False)
    who = f"{recording.name}, " if path.suffix == SUFFIX else ""
    prepared = prepare(recording, car, strict=arguments.strict)
    doubtful = [f"{p.channel}: {p.text}" for p in prepared.problems if p.name in DOUBTFUL]
    for line in (*prepared.account, *doubtful):
        print(f"{path}  {who}{line}")
    run = joined(_runs(path, prepared.recordings, car, arguments.horizon_s))
    windows = f"{len(run.start_s)} windows of {arguments.horizon_s:g} s"
    left_out = "".join(f", {count} left out: {why}" for why, count in run.left_out.items())
    print(f"{path}  {who}car {car.name}: {windows}{left_out},")
    print("free run from the measured state, median and 90th percentile of the error")
    corrected = [f.kind.name for f in car.faults if any(map(f.function_for, POSES))]
    if corrected:
        print(f"measured poses are corrected for {', '.join(corrected)} of the car file")
    print(_table(run, arguments.horizon_s) + "\n")
    return run


def _runs(
    path: Path, stretches: "Sequence[Recording]", car: "Car", horizon_s: float
) -> "list[FreeRun]":
    """Drive each stretch of a recording again; those without a whole window are printed.

    Raises:
        RecordingError: when no stretch has one.
    """
    import numpy as np

    from scm.errors import RecordingError
    from scm.replay.free_run import free_run

    runs: list[FreeRun] = []
    failures: list[RecordingError] = []
    for stretch in stretches:
        try:
            runs.append(free_run(stretch, car, horizon_s))
        except RecordingError as error:
            failures.append(error)
    if not stretches:
        msg = f"{path}: poses and commands never overlap for long enough to be simulated"
        raise RecordingError(msg)
    if not runs and len(stretches) > 1:
        longest_s = max(float(np.ptp(stretch.channel("pose.x").t)) for stretch in stretches)
        msg = f"{path}: no window of {horizon_s:g} s in {len(stretches)} stretches; the longest "
        msg += f"lasts {longest_s:.1f} s: give a shorter --horizon-s"
        raise RecordingError(msg)
    if not runs:
        raise failures[0]
    for failure in failures:
        print(f"a stretch left out: {failure}")
    return runs


def _table(run: "FreeRun", horizon_s: float) -> str:
    """Return the error table as aligned text."""
    from scm.replay.free_run import error_table

    horizons = (*(h for h in HORIZONS_S if h < horizon_s), horizon_s)
    lines = [" " * 14 + "".join(f"{f'{h:g} s':>20}" for h in horizons)]
    for label, values in error_table(run, horizons):
        cells = "".join(f"{median:>11.4f}{p90:>9.4f}" for median, p90 in values)
        lines.append(f"{label:<14}{cells}")
    return "\n".join(lines)


def _refuse_unwritable(path: Path) -> None:
    """Find out before the work that its result could not be saved."""
    from scm.errors import RecordingError

    if path.is_dir() or not path.absolute().parent.is_dir():
        msg = f"--save {path}: expected a file in a folder that exists"
        raise RecordingError(msg)


def _save(path: Path, runs: "list[FreeRun]") -> None:
    """Write simulated and measured poses of every window."""
    window = 0
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(["window", "t", "x", "y", "yaw", "x_meas", "y_meas", "yaw_meas"])
        for run in runs:
            columns = (run.x, run.y, run.yaw, run.x_measured, run.y_measured, run.yaw_measured)
            for row, start in enumerate(run.start_s):
                for k, t in enumerate(run.t_s):
                    cells = [f"{start + t:.3f}", *(f"{column[row, k]:.6f}" for column in columns)]
                    writer.writerow([window, *cells])
                window += 1


COMMAND = Command(
    help="Simulate a recording's drive from its measured state, and print the errors.",
    example="scm replay recordings/dart/free_driving_10_02_28.yaml --data ../recordings/dart",
    arguments=_arguments,
    run=_run,
)
