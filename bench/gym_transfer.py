"""Which policy drives a car of which nobody knows what is wrong with it.

    python -m bench gym_transfer [EFFECT ...] [--seed 1] [--steps 6e6] [--out runs/gym_transfer]

Something is concealed in a car of `tests/reality`, an independent simulator. Three policies learn
to drive laps of Driving School, in simulators: of the nominal car; of cars that differ from it by
its file's standard deviations and by all of `RANGES`; and of the car file that `scm mismatch` found
from 90 s of the car's driving, as uncertain as it is. Then each drives the car, from places spread
over the lanes: until it has left its lane, or for a minute. `--out` keeps files: what lies there is
not trained again.
"""

import argparse
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scm.maps.load import load_map
from scm.records.city_map import CityMap
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.vehicles.drivers.course import BESIDE_M, DONE_M, Course
from tests.reality.cases import apply, draw_effects
from tests.reality.motion import Moving
from tests.reality.numbers import nominal, scattered
from tests.reality.recorded import record, write
from tests.reality.sensing import FAULTS
from vehicle_agent.autonomy.control import Command
from vehicle_agent.policy.model import Policy
from vehicle_agent.policy.senses import Senses

CAR, TASK, MAP = "nigel", "driving_school/lap-v1", "driving_school"
RECORDED_S, DRIVEN_S, STARTS = 90.0, 60.0, 20
EFFECTS = {
    "steer_delay": 6.0, "steer_lag": 4.0, "steer_trim": 6.0, "steer_gain": 5.0,
    "steer_backlash": 8.0, "drive_delay": 20.0, "drive_lag": 20.0, "drive_deadband": 10.0,
}  # fmt: skip
"""What is concealed, in multiples of the smallest that 90 s of driving can show."""
RANGES = {
    "steering.delay_s": (0.0, 0.2), "steering.lag_s": (0.0, 0.2), "steering.trim_rad": (-0.1, 0.1),
    "steering.gain": (0.6, 1.4), "steering.backlash_rad": (0.0, 0.12), "drive.delay_s": (0.0, 0.2),
    "drive.lag_s": (0.0, 0.3), "drive.deadband": (0.0, 0.2),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Driven:
    """How far a car came [m] and for how long it stayed in its lane [s], each (starts,)."""

    way_m: np.ndarray
    lasted_s: np.ndarray

    def __str__(self) -> str:
        """Return how often it stayed in its lane to the end, and the mean way."""
        whole = int((self.lasted_s >= DRIVEN_S).sum())
        return f"{whole:2d} of {len(self.way_m)}, {self.way_m.mean():5.2f} m"


def state_of(row: np.ndarray, car: Moving, t_s: float) -> VehicleState:
    """Return what a car would report; a row's lateral speed is its centre of gravity's."""
    _, x, y, yaw, along, across, rate = map(float, row[:7])
    return VehicleState(
        vehicle="n1", t_ns=round(1e9 * t_s), seq=0, x_m=x, y_m=y, yaw_rad=yaw, speed_mps=along,
        lateral_speed_mps=across - rate * float(car.numbers["cog"][0]), yaw_rate_radps=rate,
        steering_rad=float(car.state["angle"][0]), throttle=0.0, source="simulated",
    )  # fmt: skip


def drive(policy: Policy, numbers: dict[str, float], city_map: CityMap, seed: int) -> Driven:
    """Let a policy drive a car of the reality from places spread over the lanes."""
    course = Course(city_map, STARTS)
    rng, rows = np.random.default_rng(seed), np.arange(STARTS)
    draws = rng.random((STARTS, 4))
    draws[:, 0] = (rows + draws[0, 0]) / STARTS
    poses = course.begin(rows, draws, 0.0, 0.0)
    found = [drive_once(policy, numbers, city_map, poses[k], course, k) for k in rows]
    return Driven(*np.array(found).T)


def drive_once(
    policy: Policy, numbers: dict[str, float], city_map: CityMap, pose: np.ndarray,
    course: Course, k: int,
) -> tuple[float, float]:  # fmt: skip
    """Return how far a car came [m], and for how long it stayed in its lane [s]."""
    period_s, half_track = policy.metadata.period_s, 0.5 * load_car(CAR).value("body.track_m")
    steps, action = round(DRIVEN_S / period_s), Command(0.0, 0.0)
    car = Moving(numbers | {"command": period_s}, tuple(pose), steps)
    senses, row = Senses(policy.metadata, city_map, f"n{k}"), np.zeros(11)
    row[1:4] = pose
    for step in range(steps):
        course.follow(*(np.full(STARTS, row[at]) for at in (1, 2, 3)), rows=np.array([k]))
        known = course.known[k]
        is_out = abs(known[BESIDE_M]) + half_track > course.half_width[k]
        seen = None if is_out else senses.look(state_of(row, car, step * period_s), action, 0)
        if seen is None:
            return float(known[DONE_M]), step * period_s
        action = Command(*policy(seen).tolist())
        row = car.command(step, action.throttle, action.steering)[-1]
    return float(known[DONE_M]), DRIVEN_S


def run(*command: Any) -> None:
    """Run a program; its output goes to a file beside what it makes."""
    print("  " + " ".join(map(str, command)), flush=True)
    subprocess.run([sys.executable, *map(str, command)], check=True, stdout=subprocess.DEVNULL)


def trained(out: Path, steps: float, seed: int, *more: Any) -> Policy:
    """Return a policy, trained if it is not there."""
    if not out.is_file():
        run(
            "examples/train_ppo.py", TASK, "--minutes", 1e3, "--steps", steps, "--seed", seed,
            "--out", out, *more,
        )  # fmt: skip
    return Policy(out)


def main() -> None:
    """Print a row an effect: how often, and how far, each policy drives."""
    parser = argparse.ArgumentParser(prog="python -m bench gym_transfer", description=__doc__)
    parser.add_argument("effects", nargs="*", default=[*EFFECTS])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--steps", type=float, default=6e6)
    parser.add_argument("--out", type=Path, default=Path("runs/gym_transfer"))
    given = parser.parse_args()
    for name in given.effects:
        if name not in EFFECTS:
            parser.error(f"{name}: expected one of {', '.join(EFFECTS)}")
    given.out.mkdir(parents=True, exist_ok=True)
    city_map, steps = load_map(MAP), given.steps
    ranges = [word for key, ends in RANGES.items() for word in ("--range", key, *ends)]
    policies = {
        "nominal": trained(given.out / "nominal.onnx", steps, given.seed),
        "randomised": trained(
            given.out / "randomised.onnx", steps, given.seed, "--randomise", 1.0, *ranges
        ),
    }
    rows = list[str]()
    for name in ("nothing", *given.effects):
        rng = np.random.default_rng([given.seed, *name.encode()])
        usual = scattered(nominal(CAR), rng)
        strength = EFFECTS.get(name, 1.0)
        effects = draw_effects((name,) if name in EFFECTS else (), CAR, (strength,) * 2, rng)
        numbers, folder = apply(usual, effects), given.out / name
        if not (folder / "report").is_dir():
            drive_of = record(CAR, numbers, apply(FAULTS, effects), RECORDED_S, rng)
            write(drive_of, CAR, usual, folder)
            run("-m", "scm", "mismatch", folder, "--out", folder / "report")
        found = folder / "report" / "car.toml"
        twin = ("--car", found, "--randomise", 1.0) if found.is_file() else ()
        all_three = {
            **policies,
            "twin": trained(folder / "twin.onnx", steps, given.seed, *twin)
            if twin else policies["nominal"],
        }  # fmt: skip
        cells = [str(drive(one, numbers, city_map, given.seed)) for one in all_three.values()]
        rows.append(f"{name:<16}" + "".join(f"{cell:>22}" for cell in cells))
        print(rows[-1], flush=True)
    print(f"\n{'concealed':<16}" + "".join(f"{title:>22}" for title in all_three))
    print("\n".join(rows))


if __name__ == "__main__":
    main()
