"""A network drives the published Nigel, emulated: firmware, serial line, Eye and front camera.

    python -m bench cloning_real MODEL [RUNS] [--laps 2]

Everything is a process of its own on the real bus and clock, as with a real car: world, Eye, the
cars' cameras, the emulated car behind a pseudo-terminal, its agent at that, and
`vehicle-agent drive --ignore-signals`. The camera looks from where the car truly is. The motor
does not turn below 0.2 of throttle. Starts are anywhere on the lane of Driving School. Each row is
from the true pose: laps until a wheel leaves the lane or the car stands, and how far beside its
middle.
"""

import argparse
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from bench.autonomy_real import READY_S, VEHICLE, process, text_of, wait_until
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Path as LanePath
from scm.maps.route import roads_of
from scm.study.statistics import wilson
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.mailbox import Mailbox
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.router import Router, free_endpoint
from scm.vehicles.car import load_car

MAP = "driving_school"
STANDS_S = 5.0  # without 1 cm of way


def drive(number: int, folder: Path, model: Path, laps: float) -> dict[str, float]:
    """Drive once, from a place drawn by a number."""
    city_map = load_map(MAP)
    lane = LanePath.circulation(roads_of(city_map), city_map.lanes[0].name)
    room_m = 0.5 * (city_map.lanes[0].width_m - load_car("nigel").value("body.track_m"))
    start_m = float(np.random.default_rng(number).uniform(0.0, lane.length_m))
    endpoint, link = free_endpoint(), folder / "nigel"
    at = ("--connect", endpoint)
    with ExitStack() as stack:
        stack.enter_context(Router(endpoint))

        def begin(*command: str) -> None:
            stack.enter_context(process(*command, log=folder / f"{number}_{command[1]}.txt"))

        bus = stack.enter_context(ZenohBus("city", "bench", endpoint))
        truth = Mailbox(50_000)
        bus.subscribe(EmulatedPose, {}, truth)
        for part in ("world", "eye", "camera"):
            begin("scm", part, MAP, *at)
        placed = ("--name", VEHICLE, f"--spawn={text_of(lane.at(start_m))}")
        begin("vehicle_agent", "emulate", "--link", str(link), *placed, *at)
        begin("vehicle_agent", "join", "--serial", str(link), *placed, *at)
        wait_until(lambda: bool(truth.drain()))
        begin("vehicle_agent", "drive", str(model), "--vehicle", VEHICLE, "--ignore-signals", *at)
        return follow(truth, lane, start_m, laps, room_m)


def follow(
    truth: Mailbox, lane: LanePath, start_m: float, laps: float, room_m: float
) -> dict[str, float]:
    """Return how a car drove along a lane; ends when it leaves that, stands or is done."""
    s = farthest_s = start_m
    began = moved = time.monotonic()
    beside = list[float]()
    has_moved = False
    while s - start_m < laps * lane.length_m:
        for item in truth.drain():
            pose = Pose2(item.message.x_m, item.message.y_m, item.message.yaw_rad)
            s, off = lane.project(pose.x, pose.y, s)
            beside.append(abs(off))
        now = time.monotonic()
        if s > farthest_s + 0.01:
            if not has_moved:
                began, has_moved = now, True
            farthest_s, moved = s, now
        patience_s = STANDS_S if has_moved else READY_S
        if now - moved > patience_s or (beside and beside[-1] > room_m):
            break
        time.sleep(0.02)
    return {
        "stayed": float(s - start_m >= laps * lane.length_m),
        "laps": (s - start_m) / lane.length_m,
        "beside_mm": 1e3 * float(np.mean(beside)),
        "farthest_mm": 1e3 * float(np.max(beside)),
        "speed_mps": (s - start_m) / (time.monotonic() - began),
    }


def main() -> None:
    """Print a row a run, and the share that stayed in the lane."""
    parser = argparse.ArgumentParser(prog="python -m bench cloning_real", description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("runs", type=int, nargs="?", default=5)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--laps", type=float, default=2.0)
    parser.add_argument("--logs", type=Path, help="folder for what the programs print")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as made:
        folder = arguments.logs or Path(made)
        folder.mkdir(exist_ok=True)
        for number in range(arguments.first, arguments.first + arguments.runs):
            rows.append(drive(number, folder, arguments.model, arguments.laps))
            print(number, "  ".join(f"{k} {v:.3f}" for k, v in rows[-1].items()), flush=True)
    stayed = round(sum(row["stayed"] for row in rows))
    share = wilson(stayed, len(rows))
    low, high = 100 * share.low, 100 * share.high
    print(f"stayed in {stayed} of {len(rows)}, 95 %: {low:.0f} to {high:.0f} %")


if __name__ == "__main__":
    main()
