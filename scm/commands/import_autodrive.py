"""`scm import autodrive`: logs of AutoDRIVE's data recorder as a recording."""

import argparse
import math
from pathlib import Path

from scm.command import Command

MAX_PRINTED_LINES = 10
RADIUS, COUNTS = "wheel.radius_m", "encoder.counts_per_revolution"


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "folder", type=Path, metavar="FOLDER", help="folder that holds 'V1 Log.csv'"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="NAME", help="folder to write")
    parser.add_argument(
        "--car", default="nigel", metavar="FILE", help="car file or name (%(default)s)"
    )
    parser.add_argument(
        "--steering-positive",
        choices=("left", "right"),
        default="left",
        help="direction of positive steering in the logs (%(default)s)",
    )
    parser.add_argument(
        "--axes",
        choices=("ros", "unity"),
        default="ros",
        help="axes of the logs: ros, z up as the recorder writes; unity, y up (%(default)s)",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.recording.autodrive_import import LEFT_OUT, import_logs
    from scm.vehicles.car import load_car

    car = load_car(arguments.car)
    radius_m = car.value(RADIUS) if car.has(RADIUS) else 0.0
    m_per_count = math.tau * radius_m / car.value(COUNTS) if car.has(COUNTS) else None
    is_file = Path(arguments.car).suffix == ".toml"
    made = import_logs(
        arguments.folder,
        arguments.out,
        car=str(car.path.resolve()) if is_file else arguments.car,
        car_file=car.path,
        steering_sign=1 if arguments.steering_positive == "left" else -1,
        unity_axes=arguments.axes == "unity",
        m_per_count=m_per_count,
        axle_m=radius_m,
    )
    print("\n".join(made.remarks))
    for one in made.left_out[:MAX_PRINTED_LINES]:
        print(one)
    if made.left_out:
        shown = (
            f", the first {MAX_PRINTED_LINES} above"
            if len(made.left_out) > MAX_PRINTED_LINES
            else ""
        )
        print(f"{len(made.left_out)} lines are left out{shown}: see {arguments.out / LEFT_OUT}")
    print(f"scm replay {arguments.out}")
    return 0


COMMAND = Command(
    help="Import logs of AutoDRIVE's data recorder for scm replay and scm mismatch.",
    example="scm import autodrive data/eight_30_hz --out runs/eight",
    arguments=_arguments,
    run=_run,
)
