"""Cars with an effect that their file lacks are driven, recorded and diagnosed: `car.toml` of each.

    python -m studies.found_car                 # a drive and a diagnosis of each car; minutes
    scm study run studies/parking_found.toml    # parks with these files, and others

Each car is driven by hand on an empty floor while its throttle and steering are off as in
`parking.py` and an overhead camera measures its pose, both unknown to `scm mismatch`. The city
records it; the tool gets that recording and the nominal file. Needs a clone of the repository as
the working directory.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from msgspec import structs

from scm.clock import WallClock
from scm.fleet import LockstepLink
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.mismatch.budget import Budget
from scm.mismatch.pipeline import diagnose_car, write
from scm.recorder.driven import REPORTED_M, REPORTED_RAD
from scm.recorder.drives import recordings_of_one
from scm.recorder.part import RecorderPart
from scm.recorder.play import Row, play
from scm.records.floor import Floor
from scm.runtime.lockstep import Lockstep
from scm.vehicles.car import load_car, varied_cars
from scm.world.part import WorldPart
from scm.world.world import generator
from studies.parking import CAR, FOUND, VEHICLE, Disturbed, with_effect
from vehicle_agent.agent import AgentPart
from vehicle_agent.bodies.simulated import SimulatedBody
from vehicle_agent.body import BodyKind, Motion

FLOOR_M = (-6.0, 6.0)
LASTS_S, EVERY_S = 90.0, 0.05  # of a drive; of its commands
PIECE_S, REST_S, RISE_S = 3.0, 0.6, 0.8  # of constant throttle; before it; some begin gently
THROTTLE, STEERING, STEERED_S = (0.25, 0.95), 0.9, 1.6
NAMES = ("drive_delay", "drive_deadband", "steer_gain", "all")


class HandDriven(SimulatedBody):
    """A car whose commands are not quite obeyed, and whose pose a camera measures.

    Args:
        rng: Of both.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        super().__init__(CAR, 0)
        self._rng, self._disturbed = rng, Disturbed(1.0, rng)

    def command(self, throttle: float, steering: float) -> None:
        """Apply a command that is a little off."""
        super().command(*self._disturbed(throttle, steering))

    def motion(self) -> Motion:
        """Return how it moves, where the camera sees it."""
        motion = super().motion()
        off = (REPORTED_M, REPORTED_M, REPORTED_RAD) * self._rng.standard_normal(3)
        return replace(motion, pose=Pose2(*(np.array(motion.pose) + off).tolist()))


def commands(rng: np.random.Generator, lasts_s: float = LASTS_S) -> list[Row]:
    """Return time, throttle and steering of a drive: rests, launches, both ways, all speeds."""
    t = np.arange(0.0, lasts_s, EVERY_S)
    piece, since_s = (t / PIECE_S).astype(int), t % PIECE_S
    count = piece[-1] + 1
    throttle = rng.uniform(*THROTTLE, count) * rng.choice((-1.0, 1.0), count)
    rise_s = rng.choice((EVERY_S, RISE_S), count)
    risen = np.clip((since_s - REST_S) / rise_s[piece], 0.0, 1.0)
    steering = rng.uniform(-STEERING, STEERING, len(t))[(t / STEERED_S).astype(int)]
    rows = zip(t.tolist(), (throttle[piece] * risen).tolist(), steering.tolist(), strict=True)
    return [*rows, (lasts_s, 0.0, 0.0)]


def record(concealed: str, path: Path, seed: int) -> None:
    """Drive a car with an effect in a city, and record that."""
    rng = generator(seed, "found_car", concealed)
    floor = structs.replace(
        load_map("parking_school"), walls=(), floor=Floor(x_m=FLOOR_M, y_m=FLOOR_M)
    )
    with varied_cars({CAR: with_effect(load_car(CAR), concealed)}):
        body = HandDriven(rng)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    agent = AgentPart(VEHICLE, CAR, "0.0,0.0,0.0", body=BodyKind("remote", lambda *_: body))
    with Lockstep([WorldPart(floor, seed), agent, RecorderPart(path)]) as city:
        city.run_for(1.0)
        play(LockstepLink(city), VEHICLE, commands(rng))


def main() -> None:
    """Record and diagnose the cars that the command names."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("concealed", nargs="*", default=NAMES, help="of %(default)s")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--budget-s", type=float, default=600.0, help="of each diagnosis")
    arguments = parser.parse_args()
    for name in arguments.concealed:
        path = FOUND / name / "drive.mcap"
        record(name, path, arguments.seed)
        budget = Budget(arguments.budget_s, WallClock())
        found = diagnose_car(recordings_of_one(path), load_car(CAR), budget=budget)
        write(found, path.parent)
        lines = [name, *(effect.text for effect in found.diagnosis.effects)]
        sys.stdout.write("\n    ".join(lines) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
