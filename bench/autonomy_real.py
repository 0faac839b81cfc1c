"""The parking agent drives the published Nigel, emulated: firmware, serial line, Eye and LIDAR.

    python -m bench autonomy_real [RUNS] [--deadband parking|car|nobody]

Everything is a process of its own on the real bus and clock, as with a real car: world, Eye,
the emulated car behind two pseudo-terminals, its agent at them, and `vehicle-agent park`. The car
has no encoders and no gyro, and needs 0.2 of throttle to move. Starts are drawn at random; the
agent knows them within 0.05 m and 0.1 rad. Each row is from the true pose: where the car stands,
and the least distance of its outline from walls and boxes. `--deadband`: whose car file has the
car's dead-band, the parking agent's (default), that of the car's own agent, or nobody's.
"""

import argparse
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.runtime.parent_watch import with_parent
from scm.study.statistics import wilson
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.mailbox import Mailbox
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.router import Router, free_endpoint
from scm.vehicles.car import TYPES_DIR, load_car
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.outline import outline_clearance, scene_of
from vehicle_agent.autonomy.plan import limits_of

MAP, VEHICLE, GOAL = "parking_school_obstacles", "n7", "goal"
GOAL_M, GOAL_RAD, LASTS_S = 0.05, 0.0873, 90.0
KNOWN_STD = (0.05, 0.05, 0.1)  # of the start [m, m, rad]
READY_S, START_ROOM_M = 90.0, 0.08


@contextmanager
def process(*command: str, log: Path) -> Iterator[subprocess.Popen[str]]:
    """Run a module as a child that ends with us."""
    with log.open("w", encoding="utf-8") as out:
        call = with_parent([sys.executable, "-m", *command])
        child = subprocess.Popen(call, stdout=out, stderr=subprocess.STDOUT, text=True)
        try:
            yield child
        finally:
            child.send_signal(signal.SIGINT)
            try:
                child.wait(5.0)
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()


def with_deadband(folder: Path) -> Path:
    """Return a car file that has the emulated car's dead-band."""
    plain = (TYPES_DIR / "nigel.toml").read_text(encoding="utf-8")
    found = '[drive]\ndeadband = { value = 0.2, std = 0.02, source = "the emulated car" }'
    text = re.sub(r"^\[drive\].*$", found, plain, flags=re.MULTILINE)
    path = folder / "nigel_with_deadband.toml"
    path.write_text(text.replace('"motor_dc",', '"motor_dc", "drive_deadband",'), encoding="utf-8")
    return path


class Truth:
    """Where the car truly is, and how near to walls and boxes it came."""

    def __init__(self, endpoint: str) -> None:
        self._bus, self._box = ZenohBus("city", "bench", endpoint), Mailbox(50_000)
        self._bus.subscribe(EmulatedPose, {}, self._box)
        self._scene = scene_of(grid_of_city(load_map(MAP)), limits_of(load_car("nigel")))
        self.pose: Pose2 | None = None
        self.least_m = np.inf

    def follow(self) -> Pose2 | None:
        """Take what came; return the newest pose."""
        for item in self._box.drain():
            before, self.pose = self.pose, Pose2(
                item.message.x_m, item.message.y_m, item.message.yaw_rad
            )  # fmt: skip
            if self.pose != before:
                self.least_m = min(self.least_m, outline_clearance(self._scene, self.pose))
        return self.pose

    def close(self) -> None:
        """Leave the bus."""
        self._bus.close()


def start_of(rng: np.random.Generator) -> tuple[Pose2, Pose2]:
    """Return a place where the car has room, and what the agent knows of it."""
    city_map = load_map(MAP)
    scene = scene_of(grid_of_city(city_map), limits_of(load_car("nigel")))
    while True:
        floor = city_map.floor
        start = Pose2(
            rng.uniform(*floor.x_m), rng.uniform(*floor.y_m), rng.uniform(-np.pi, np.pi)
        )  # fmt: skip
        if outline_clearance(scene, start) > START_ROOM_M:
            return start, Pose2(*(np.array(start) + KNOWN_STD * rng.standard_normal(3)).tolist())


def text_of(pose: Pose2) -> str:
    """Return a pose as the programs take it."""
    return f"{pose.x:.4f},{pose.y:.4f},{np.degrees(pose.yaw):.3f}"


def drive(number: int, folder: Path, known_by: str) -> dict[str, float]:
    """Park once."""
    start, known = start_of(np.random.default_rng(number))
    endpoint = free_endpoint()
    link, lidar = folder / "nigel", folder / "lidar"
    car = str(with_deadband(folder))
    joined = ("--calibration", car) if known_by == "car" else ()
    at = ("--connect", endpoint)
    with ExitStack() as stack:
        stack.enter_context(Router(endpoint))

        def begin(*command: str) -> subprocess.Popen[str]:
            log = folder / f"{number}_{command[1]}.txt"
            return stack.enter_context(process(*command, log=log))

        truth = Truth(endpoint)
        stack.callback(truth.close)
        for part in ("world", "eye"):
            begin("scm", part, MAP, *at)
        placed = ("--name", VEHICLE, f"--spawn={text_of(start)}", "--seed", str(number))
        ports = ("--link", str(link), "--lidar-link", str(lidar))
        begin("vehicle_agent", "emulate", *ports, *placed, *at)
        begin("vehicle_agent", "join", "--serial", str(link), "--lidar", str(lidar), *placed,
              *joined, *at)  # fmt: skip
        wait_until(lambda: truth.follow() is not None)
        begin_at = ("--goal", GOAL, f"--start={text_of(known)}")
        of_car = ("--car", car) if known_by == "parking" else ()
        park = begin("vehicle_agent", "park", "--vehicle", VEHICLE, *begin_at, *of_car, *at)
        began = wait_until(lambda: (pose := truth.follow()) and moved_m(start, pose) > 0.005)
        while park.poll() is None and time.monotonic() - began < LASTS_S:
            truth.follow()
            time.sleep(0.02)
        took = time.monotonic() - began
        truth.follow()
        goal = roads_of(load_map(MAP)).spawn_pose(GOAL)
        left = goal.inverse() @ (truth.pose or start)
        off_m, off_rad = float(np.hypot(left.x, left.y)), abs(left.yaw)
        is_there = off_m < GOAL_M and off_rad < GOAL_RAD and park.poll() == 0
        return {
            "parked": float(is_there and truth.least_m > 0.0), "off_m": off_m, "off_rad": off_rad,
            "time_s": took, "clearance_m": float(truth.least_m),
        }  # fmt: skip


def moved_m(one: Pose2, other: Pose2) -> float:
    """Return how far apart two poses are."""
    return float(np.hypot(one.x - other.x, one.y - other.y))


def wait_until(condition: Callable[[], object]) -> float:
    """Wait for a condition, `READY_S` at most; return when it holds (monotonic) [s]."""
    end = time.monotonic() + READY_S
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return time.monotonic()


def main() -> None:
    """Print a row a run, and the medians."""
    parser = argparse.ArgumentParser(prog="python -m bench autonomy_real", description=__doc__)
    parser.add_argument("runs", type=int, nargs="?", default=5)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--deadband", choices=("parking", "car", "nobody"), default="parking")
    parser.add_argument("--logs", type=Path, help="folder for what the programs print")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as made:
        folder = arguments.logs or Path(made)
        folder.mkdir(exist_ok=True)
        for number in range(arguments.first, arguments.first + arguments.runs):
            rows.append(drive(number, folder, arguments.deadband))
            print(number, "  ".join(f"{k} {v:.3f}" for k, v in rows[-1].items()), flush=True)
    parked = round(sum(row["parked"] for row in rows))
    share = wilson(parked, len(rows))
    print(
        f"parked {parked} of {len(rows)}, 95 %: {100 * share.low:.0f} to {100 * share.high:.0f} %"
    )
    medians = (f"{k} {statistics.median(row[k] for row in rows):.3f}" for k in rows[0])
    print("medians:", "  ".join(medians))


if __name__ == "__main__":
    main()
