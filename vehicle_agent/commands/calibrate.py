"""`vehicle-agent calibrate`: drive a pattern under the Eye, and fit the car's own numbers."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command, credentials_argument, credentials_of

if TYPE_CHECKING:
    from vehicle_agent.body import Body
    from vehicle_agent.calibrate.fit import Fit
    from vehicle_agent.calibrate.part import CalibrationPart
    from vehicle_agent.guard import GuardLimits


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--name", required=True,
        help="of the vehicle, as the Eye calls it: tag-ID where it has not joined the city",
    )  # fmt: skip
    parser.add_argument("--connect", required=True, metavar="ENDPOINT", help="the city's router")
    credentials_argument(parser)
    parser.add_argument("--city", default="city", help="whose keys to use (%(default)s)")
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
        "--speed-limit", type=float, default=1.0, metavar="THROTTLE", help="most throttle, 0 to 1"
    )
    parser.add_argument(
        "--top-speed", type=float, default=0.3, metavar="MPS",
        help="of this car at full throttle, at most [m/s] (%(default)g)",
    )  # fmt: skip
    parser.add_argument(
        "--eye-delay-ms", type=float, default=0.0, metavar="MS",
        help="so much of the delays found is the Eye's [ms] (%(default)g)",
    )  # fmt: skip
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="for drive and car file; default: runs/calibrate-NAME",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.key import check_name
    from scm.vehicles.car import load_car
    from vehicle_agent.calibrate.part import CalibrationPart

    check_name(arguments.name, "--name")
    check_name(arguments.city, "--city")
    out = arguments.out or Path("runs") / f"calibrate-{arguments.name}"
    car = load_car(arguments.car)
    limits = _limits(arguments)
    credentials = credentials_of(arguments, arguments.name)
    wish, clock = stop_on_signal(), WallClock()
    with ZenohBus(
        arguments.city, arguments.name, arguments.connect, clock=clock, credentials=credentials
    ) as bus:
        part = CalibrationPart(arguments.name, _body(arguments), limits, wish)
        try:
            print(f"waits for the Eye to see {arguments.name}; Ctrl-C ends the drive", flush=True)
            run(part, bus, clock, wish)
        finally:
            part.close()
    drive = out / "drive"
    part.recorded.write(drive, car.name)
    print(_said(part, drive))
    return _fit(arguments, part, out)


def _body(arguments: argparse.Namespace) -> "Body":
    from scm import registry
    from scm.errors import RunError
    from vehicle_agent.agent import BODIES
    from vehicle_agent.body import BodyKind, Wiring

    name = arguments.body or ("nigel" if arguments.serial else "simulated")
    kind = registry.load(BODIES, name, "BODY", BodyKind, RunError)
    wiring = Wiring(port=arguments.serial, baud=arguments.baud, raw=True)
    return kind.open(arguments.car, 0, wiring)


def _limits(arguments: argparse.Namespace) -> "GuardLimits":
    from scm.vehicles.car import load_car
    from scm.vehicles.drivers.limits import limits_of
    from vehicle_agent.guard import GuardLimits, rectangle

    own = limits_of(load_car(arguments.car))
    of_nobody = arguments.name.startswith("tag-")
    return GuardLimits(
        rectangle(*arguments.floor),
        throttle=arguments.speed_limit,
        top_speed_mps=arguments.top_speed,
        curvature_per_m=math.tan(own.steer_limit) / own.wheelbase,
        front_m=own.front,
        rear_m=own.rear,
        width_m=own.width,
        harmless=frozenset({"unknown"} if of_nobody else ()),
    )


def _said(part: "CalibrationPart", drive: Path) -> str:
    held = part.guard.told or "never"
    seen, told = len(part.recorded.pose), len(part.recorded.command)
    return f"{drive}: {told} commands, {seen} poses; the guard held the car up: {held}"


def _fit(arguments: argparse.Namespace, part: "CalibrationPart", out: Path) -> int:
    from scm.vehicles.car import load_car
    from vehicle_agent.calibrate.car_file import write_car
    from vehicle_agent.calibrate.fit import fit

    car = load_car(arguments.car)
    found = fit(car, *part.recorded.arrays(), arguments.eye_delay_ms / 1000.0)
    path = out / "car.toml"
    write_car(car, found, path, f"{arguments.name}, {found.windows} windows")
    print(_table(found))
    print(f"{path}: `scm replay {out / 'drive'} --car {path}` shows how well it drives again")
    return 0


def _table(found: "Fit") -> str:
    rows = [
        f"  {key:<22}{one.value:>9.4f}   90 % {one.low:.4f} .. {one.high:.4f}"
        for key, one in found.numbers.items()
    ]
    left = f"left over: {1e3 * found.position_rms_m:.1f} mm, {1e3 * found.yaw_rms_rad:.1f} mrad"
    return "\n".join([*rows, f"  {left} (rms, the Eye's noise included)"])


COMMAND = Command(
    help="drive a pattern on a free floor under the Eye, and fit the car's own numbers",
    example="vehicle-agent calibrate --name n1 --connect tcp/127.0.0.1:7447 --floor 0 0 2 1.5",
    arguments=_arguments,
    run=_run,
)
