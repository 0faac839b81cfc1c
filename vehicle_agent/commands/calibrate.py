"""`vehicle-agent calibrate`: drive a pattern under the Eye, and identify the car's parameters."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command, credentials_argument, credentials_of

if TYPE_CHECKING:
    from scm.vehicles.car import Car
    from vehicle_agent.body import Body
    from vehicle_agent.calibrate.fit import Fit
    from vehicle_agent.calibrate.part import CalibrationPart
    from vehicle_agent.guard import GuardLimits

TAG = "tag-"
"""Prefix of the Eye's name for a tag without a known vehicle."""
ADVICE = {
    "pose": "the Eye reports no pose of that name; a car that has not joined is called tag-ID",
    "doubt": "the Eye sees it but its pose is uncertain: is the tag flat, intact and lit?",
    "stop": "the city is stopped",
    "outside the floor": "put it inside the rectangle of --floor, bumpers and all",
}
REPEAT_DRIVE = "drive again"
"""Printed after a drive that leaves too much uncertain."""
MIN_LONG_SIDE, MIN_SHORT_SIDE = 4.0, 3.3


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--name", required=True,
        help="of the vehicle in the Eye: tag-ID if it has not joined the city",
    )  # fmt: skip
    parser.add_argument("--connect", required=True, metavar="ENDPOINT", help="the city's router")
    credentials_argument(parser)
    parser.add_argument("--city", default="city", help="name of the city on the bus (%(default)s)")
    parser.add_argument("--car", default="nigel", help="car file to begin with (%(default)s)")
    parser.add_argument("--serial", default="", metavar="PORT", help="drive a real Nigel over it")
    parser.add_argument(
        "--baud", type=int, default=57600, help="of the port; a 4WD Nigel's Mega: 115200"
    )
    parser.add_argument(
        "--body", default="", help="kind of body; default: nigel with --serial, else simulated"
    )
    parser.add_argument(
        "--floor", nargs=4, type=float, required=True, metavar=("X0", "Y0", "X1", "Y1"),
        help="two corners of a free rectangle, map frame [m]: the car's outline stays inside",
    )  # fmt: skip
    parser.add_argument(
        "--short", action="store_true",
        help="drive 20 legs of 1 s instead of 40 of 1.8 s: half a minute, wider intervals",
    )  # fmt: skip
    parser.add_argument(
        "--speed-limit", type=float, default=1.0, metavar="THROTTLE", help="maximum throttle"
    )
    parser.add_argument(
        "--top-speed", type=float, default=0.3, metavar="MPS",
        help="maximum speed of this car at full throttle [m/s] (%(default)g)",
    )  # fmt: skip
    parser.add_argument(
        "--eye-delay-ms", type=float, default=0.0, metavar="MS",
        help="the Eye's part of the delays found [ms] (%(default)g)",
    )  # fmt: skip
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="for drive and car file; default: runs/calibrate-NAME",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.runtime.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.key import check_name
    from scm.vehicles.car import load_car
    from vehicle_agent.calibrate.part import CalibrationPart
    from vehicle_agent.calibrate.pattern import FULL, SHORT

    check_name(arguments.name, "--name")
    check_name(arguments.city, "--city")
    out = arguments.out or Path("runs") / f"calibrate-{arguments.name}"
    car = load_car(arguments.car)
    limits = _limits(arguments)
    _check_floor(arguments, limits)
    credentials = credentials_of(arguments, arguments.name)
    stop_requested, clock = stop_on_signal(), WallClock()
    with ZenohBus(
        arguments.city, arguments.name, arguments.connect, clock=clock, credentials=credentials
    ) as bus:
        plan = SHORT if arguments.short else FULL
        part = CalibrationPart(
            arguments.name, _body(arguments), limits, stop_requested, plan, _Console()
        )
        try:
            print(f"waits for the Eye to see {arguments.name}; Ctrl-C ends the drive", flush=True)
            run(part, bus, clock, stop_requested)
        finally:
            part.close()
            if part.recorded.command:
                part.recorded.write(out / "drive", car.name)
                print(_drive_summary(part, out / "drive"), flush=True)
    return _fit(arguments, part, out)


class _Console:
    """Prints the progress: each reason to wait once, and every tenth of the drive."""

    def __init__(self) -> None:
        self._logged = ""

    def __call__(self, doing: str) -> None:
        percent, is_driven, _ = doing.partition(" % driven")
        line = f"{int(percent) // 10 * 10}{is_driven}" if is_driven else doing
        if line == self._logged:
            return
        self._logged = line
        why = doing.removeprefix("waits (").removesuffix(")")
        advice = [words for reason, words in ADVICE.items() if reason in why.split(", ")]
        print(": ".join([line, *advice]), flush=True)


def _body(arguments: argparse.Namespace) -> "Body":
    from scm import registry
    from scm.errors import RunError
    from vehicle_agent.agent import BODIES
    from vehicle_agent.body import BodyKind, Wiring

    name = arguments.body or ("nigel" if arguments.serial else "simulated")
    kind = registry.load(BODIES, name, "BODY", BodyKind, RunError)
    wiring = Wiring(port=arguments.serial, baud=arguments.baud, raw=True)
    return kind.open(arguments.car, 0, wiring)


def _is_tag_name(name: str) -> bool:
    """Return whether a name is the Eye's name for a tag without a vehicle."""
    return name.startswith(TAG) and name[len(TAG) :].isdecimal()


def _limits(arguments: argparse.Namespace) -> "GuardLimits":
    from scm.vehicles.car import load_car
    from scm.vehicles.drivers.limits import limits_of
    from vehicle_agent.guard import GuardLimits, rectangle

    own = limits_of(load_car(arguments.car))
    return GuardLimits(
        rectangle(*arguments.floor),
        throttle=arguments.speed_limit,
        top_speed_mps=arguments.top_speed,
        curvature_per_m=math.tan(own.steer_limit) / own.wheelbase,
        front_m=own.front,
        rear_m=own.rear,
        width_m=own.width,
        harmless=frozenset({"unknown"} if _is_tag_name(arguments.name) else ()),
    )


def _check_floor(arguments: argparse.Namespace, limits: "GuardLimits") -> None:
    """Refuse a floor that is too small for the legs.

    Raises:
        RunError: naming both sizes.
    """
    from scm.errors import RunError

    x0, y0, x1, y1 = arguments.floor
    short, long = sorted((abs(x1 - x0), abs(y1 - y0)))
    length = limits.front_m + limits.rear_m
    if short < MIN_SHORT_SIDE * length or long < MIN_LONG_SIDE * length:
        msg = (
            f"--floor: got {long:.2f} m by {short:.2f} m, expected at least "
            f"{MIN_LONG_SIDE * length:.2f} m by {MIN_SHORT_SIDE * length:.2f} m: "
            "room for this car to turn"
        )
        raise RunError(msg)


def _drive_summary(part: "CalibrationPart", drive: Path) -> str:
    held = part.guard.summary or "never"
    seen, commands = len(part.recorded.pose), len(part.recorded.command)
    return f"{drive}: {commands} commands, {seen} poses; the guard limited the car: {held}"


def _fit(arguments: argparse.Namespace, part: "CalibrationPart", out: Path) -> int:
    from scm.vehicles.car import load_car
    from vehicle_agent.calibrate.car_file import write_car
    from vehicle_agent.calibrate.fit import fit, unsure
    from vehicle_agent.calibrate.picture import write_picture

    car = load_car(arguments.car)
    found = fit(car, *part.recorded.arrays(), arguments.eye_delay_ms / 1000.0)
    path = out / "car.toml"
    tag_id = int(arguments.name[len(TAG) :]) if _is_tag_name(arguments.name) else None
    write_car(car, found, path, f"{arguments.name}, {found.windows} windows", tag_id)
    deadband = car.value("drive.deadband") if car.has("drive.deadband") else 0.0
    write_picture(found, deadband, out / "fit.svg")
    print(_table(car, found))
    for line in unsure(found):
        print(f"{REPEAT_DRIVE}: {line}")
    print(f"{path}: for `vehicle-agent join --calibration`; {out / 'fit.svg'} shows the fit")
    print(f"`scm replay {out / 'drive'} --car {path}` shows how well it reproduces the drive")
    return 0


def _table(car: "Car", found: "Fit") -> str:
    rows = [f"  {'number':<22}{'file':>9}{'found':>9}   90 %"]
    for key, one in found.numbers.items():
        given = f"{car.value(key):.4f}" if car.has(key) else "-"
        rows.append(f"  {key:<22}{given:>9}{one.value:>9.4f}   {one.low:.4f} .. {one.high:.4f}")
    before, after = (1e3 * missed for missed in found.resimulated.missed_m)
    left = f"residual: {1e3 * found.position_rms_m:.1f} mm, {1e3 * found.yaw_rms_rad:.1f} mrad"
    rows += [
        f"  each leg simulated again deviates from the measured poses by {before:.1f} mm with"
        f" the file's numbers, by {after:.1f} mm with those found (rms)",
        f"  {left} (rms, the Eye's noise included)",
    ]
    return "\n".join(rows)


COMMAND = Command(
    help="drive a pattern on a free floor under the Eye, and fit the car's own numbers",
    example="vehicle-agent calibrate --name n1 --connect tcp/127.0.0.1:7447 --floor 0 0 2 1.5",
    arguments=_arguments,
    run=_run,
)
