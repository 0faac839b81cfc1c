"""`vehicle-agent emulate`: the published Nigel firmware behind a pseudo-terminal."""

import argparse
import gc
from pathlib import Path
from typing import TYPE_CHECKING

from scm.clock import NS_PER_MS
from scm.command import Command, credentials_argument, credentials_of, spawn_argument
from vehicle_agent.becoming import becomes_arguments, change_of
from vehicle_agent.emulate.sketches import DEADBAND, SKETCHES, Sketch

if TYPE_CHECKING:
    from threading import Event

    from scm.clock import Clock
    from vehicle_agent.bodies.simulated import Change
    from vehicle_agent.emulate.device import Device

POLL_NS = 2 * NS_PER_MS
"""Without a city: poll period, which bounds the delay of a printed pin change."""


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--link", type=Path, default=Path("/tmp/nigel"), metavar="PATH",
        help="path for hosts, as /dev/ttyUSB0 would be (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--lidar-link", type=Path, metavar="PATH",
        help="path of its RPLIDAR A1 for hosts, in a city; default: it has none",
    )  # fmt: skip
    parser.add_argument(
        "--baud-of", choices=sorted(SKETCHES), default="2wd",
        help="whose firmware: 2wd at 57600 baud, 4wd at 115200 (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--connect", metavar="ENDPOINT", help="a city's router: its emulated camera sees the car"
    )
    parser.add_argument("--name", help="of the vehicle in the city: a-z 0-9 _ -")
    credentials_argument(parser)
    parser.add_argument("--city", default="city", help="name of the city on the bus (%(default)s)")
    parser.add_argument("--car", default="nigel", help="car file (%(default)s)")
    spawn_argument(parser)
    parser.add_argument(
        "--tag", type=int, metavar="ID", help="on its roof; default: as the city gives it"
    )
    parser.add_argument(
        "--deadband", type=float, default=DEADBAND,
        help="share of the throttle that does not turn the motor (%(default)s)",
    )  # fmt: skip
    becomes_arguments(parser)
    parser.add_argument(
        "--faults", nargs="+", default=[], metavar="FAULT",
        help="what goes wrong: noise=HZ flip=P lose=P cut=P, reset=HZ or reset@T, brownout, unplug",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, help="of faults and LIDAR (%(default)s)")


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.errors import RunError
    from scm.runtime.live import stop_on_signal

    if (arguments.connect is None) != (arguments.name is None):
        raise RunError("--connect and --name: expected both or none of them")
    if arguments.lidar_link is not None and arguments.connect is None:
        raise RunError("--lidar-link: expected --connect as well: it sees a city's map")
    if not 0.0 <= arguments.deadband < 1.0:
        raise RunError(f"--deadband: got {arguments.deadband}, expected 0 to 1")
    if arguments.becomes is not None and arguments.connect is None:
        raise RunError("--becomes: expected --connect as well: without a city no car moves")
    change = change_of(arguments)
    clock, sketch, stop = WallClock(), SKETCHES[arguments.baud_of], stop_on_signal()
    device = _device(arguments, sketch, clock)
    print(
        f"an emulated Nigel ({arguments.baud_of}, {sketch.baud} baud) at {arguments.link}",
        flush=True,
    )
    try:
        if arguments.connect is None:
            _serve(device, clock, stop)
        else:
            _join(arguments, device, sketch, clock, stop, change)
    finally:
        device.close()
    return 0


def _device(arguments: argparse.Namespace, sketch: Sketch, clock: "Clock") -> "Device":
    from vehicle_agent.emulate.device import Device
    from vehicle_agent.emulate.faults import FaultInjector, read_faults
    from vehicle_agent.emulate.firmware import Firmware
    from vehicle_agent.emulate.pty import Cable

    now_ns = clock.now_ns()
    injector = FaultInjector(read_faults(arguments.faults), arguments.seed, now_ns)
    return Device(Firmware(sketch, now_ns), Cable(arguments.link), injector)


def _serve(device: "Device", clock: "Clock", stop: "Event") -> None:
    """Run without a city, and print each change of the pins."""
    shown = None
    while not clock.wait_until(clock.now_ns() + POLL_NS, stop):
        device.step(clock.now_ns())
        pins = device.firmware.outputs
        if pins != shown:
            shown = pins
            angles = " ".join(f"{angle:.1f}" for angle in pins.servos_deg) or "none"
            print(f"servo {angles}  DIR {pins.reverse}  BRK {pins.brake}  PWM {pins.pwm}",
                  flush=True)  # fmt: skip


def _join(
    arguments: argparse.Namespace, device: "Device", sketch: Sketch, clock: "Clock", stop: "Event",
    change: "Change | None",
) -> None:  # fmt: skip
    from scm.runtime.live import run
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.key import check_name
    from scm.vehicles.car import load_car
    from vehicle_agent.emulate.part import EmulatorPart, station_of
    from vehicle_agent.emulate.pty import Cable
    from vehicle_agent.emulate.scanner import Scanner
    from vehicle_agent.emulate.wheels import Wheels

    station = check_name(station_of(check_name(arguments.name, "--name")), "--name")
    check_name(arguments.city, "--city")
    credentials = credentials_of(arguments, station)
    wheels = Wheels(sketch.at_setup, arguments.car, arguments.deadband, change)
    scanner = None
    if arguments.lidar_link is not None:
        scanner = Scanner(Cable(arguments.lidar_link), load_car(arguments.car), arguments.seed)
    part = EmulatorPart(
        arguments.name, device, wheels, arguments.spawn, arguments.car, arguments.tag, scanner
    )
    with ZenohBus(
        arguments.city, station, arguments.connect, clock=clock, credentials=credentials
    ) as bus:
        run(part, bus, clock, stop)
    gc.freeze()  # freeing the compiler's objects one by one would take a quarter of a second


COMMAND = Command(
    help="emulate a Nigel's Arduino on a pseudo-terminal, and the car that it drives",
    example="vehicle-agent emulate --link /tmp/nigel --connect tcp/127.0.0.1:7447 --name n7",
    arguments=_arguments,
    run=_run,
)
