"""Misbehaviour: how many liars are found, how soon, how many honest cars are blamed, and the cost.

Run with `python -m bench misbehaviour`, or `python -m bench.misbehaviour [school | grid | cost]
[--seeds 11 12 13] [--attacks NAME ...] [--healthy] [--own-eye] [--keep FOLDER]`. A city is run in
lockstep with honest cars; what they said, made noisy, is told again with some lying, and judged.
Thresholds were set on healthy runs of the seeds 1..5; the seeds judged are others.
"""

import argparse
import math
import pickle
import random
import time
from collections import defaultdict, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from scm.lockstep import Lockstep
from scm.maps.load import load_map
from scm.part import Hears
from scm.traffic.part import TrafficPart
from scm.v2x.etsi import CamBody
from scm.v2x.etsi_convert import read_cam
from scm.v2x.message import Refused
from scm.v2x.messages.cam_tx import CamTx
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.v2x.misbehaviour.attack import Frame, Scene, Sent, attack_names, load_attack
from scm.v2x.misbehaviour.detector import Detector
from scm.v2x.misbehaviour.forge import driven, moved
from scm.v2x.misbehaviour.ground import Ground
from scm.world.part import WorldPart

START_NS = 1_795_000_000_000_000_000
OWN_M, OWN_MPS, OWN_RAD, OWN_MPS2 = 0.005, 0.005, math.radians(0.5), 0.03
EYE_M, EYE_MPS, EYE_RAD, EYE_MISSES = 0.003, 0.015, math.radians(0.7), 0.02
LOSS = 0.3
POSITION_AND_SPEED = (
    "constant_position_offset", "random_position_offset", "position_mirroring",
    "constant_speed_offset", "random_speed_offset", "zero_speed", "frozen_speed",
)  # fmt: skip


@dataclass(frozen=True)
class Town:
    """A city to judge in: its map, cars, time, and how many lie at once."""

    title: str
    map: str
    cars: int
    span_s: float
    liars: int
    groups: int


TOWNS = {
    "school": Town("driving school, 6 cars", "driving_school", 6, 120.0, 1, 6),
    "grid": Town("grid 3 x 3, 30 cars", "grid:3x3:4", 30, 90.0, 6, 2),
}


@dataclass
class Story:
    """What an honest city said and what was seen of it, in order of time."""

    town: Town
    frames: list[Frame] = field(default_factory=list)
    tracks: list[EyeTrack] = field(default_factory=list)


def tell(town: Town, seed: int, *, own_eye: bool = False) -> Story:
    """Run a city and note what its cars said; they come one after the other."""
    city_map = load_map(town.map)
    parts = [WorldPart(city_map, seed, room=town.cars), TrafficPart(city_map)]
    if own_eye:
        from scm.eye.part import EyePart

        parts.append(EyePart(city_map, seed=seed))
    story, rng = Story(town), random.Random(seed)
    with Lockstep(parts, start_ns=START_NS) as city:
        frames, truths = city.hear(Hears(CamTx)), city.hear(Hears(WorldSnapshot))
        tracks = city.hear(Hears(EyeTrack))
        spawns = [spawn.name for spawn in city_map.spawns]
        rng.shuffle(spawns)
        for number in range(town.cars):
            name = f"n{number + 1}"
            while isinstance(city.call(SpawnRequest(vehicle=name, spawn=spawns[0])), Refused):
                spawns.append(spawns.pop(0))
            spawns.append(spawns.pop(0))
            city.call(RouteRequest(request_id=name, vehicle=name))
            if number >= town.cars // 2:
                city.run_for(20.0 / town.cars)
        city.run_for(town.span_s)
        story.frames = [noisy(Frame(m.station, m.t_ns, m.body), rng) for m in drained(frames)]
        if own_eye:
            story.tracks = list(drained(tracks))
        else:
            story.tracks = [one for m in drained(truths) for one in stand_in(m, rng)]
    return story


def kept(town: Town, seed: int, folder: Path | None, *, own_eye: bool) -> Story:
    """Return a story, from a folder where it was told before."""
    if folder is None:
        return tell(town, seed, own_eye=own_eye)
    path = folder / f"{town.map.replace(':', '_')}-{seed}-{own_eye}.story"
    if not path.exists():
        path.write_bytes(pickle.dumps(tell(town, seed, own_eye=own_eye)))
    story: Story = pickle.loads(path.read_bytes())
    return story


def drained(mailbox) -> Iterator:
    """Yield the messages of a mailbox."""
    for item in mailbox.drain():
        yield item.message


def noisy(frame: Frame, rng: random.Random) -> Frame:
    """Return a frame of a car that knows itself only so well."""
    told = read_cam(frame.body)
    body = moved(frame.body, rng.gauss(told.x_m, OWN_M), rng.gauss(told.y_m, OWN_M))
    accel = frame.body.motion.longitudinal_acceleration.value * 0.1 / 14.0
    body = driven(
        body,
        speed_mps=rng.gauss(told.speed_mps or 0.0, OWN_MPS),
        yaw_rad=rng.gauss(told.yaw_rad or 0.0, OWN_RAD),
        accel_mps2=rng.gauss(accel, OWN_MPS2),
    )
    return frame._replace(body=body)


def stand_in(truth: WorldSnapshot, rng: random.Random) -> Iterator[EyeTrack]:
    """Yield what an Eye would tell of all cars: the truth with its noise, and some not at all."""
    variances = (EYE_M, EYE_M, EYE_RAD, EYE_MPS, EYE_MPS, 0.1)
    covariance = tuple(
        tuple(v * v if i == j else 0.0 for j in range(6)) for i, v in enumerate(variances)
    )
    for car in truth.vehicles:
        if rng.random() < EYE_MISSES:
            continue
        yield EyeTrack(
            vehicle=car.vehicle,
            tag_id=car.tag_id,
            t_ns=truth.t_ns,
            x_m=rng.gauss(car.x_m, EYE_M),
            y_m=rng.gauss(car.y_m, EYE_M),
            yaw_rad=rng.gauss(car.yaw_rad, EYE_RAD),
            speed_mps=rng.gauss(car.speed_mps, EYE_MPS),
            lateral_speed_mps=0.0,
            yaw_rate_radps=0.0,
            covariance=covariance,
            age_s=0.02,
            stale=False,
        )


def lied(story: Story, attack: str, liars: set[str], ground: Ground, seed: int) -> list[Sent]:
    """Return what is on the air when some cars lie, in order of time."""
    chosen, scene = load_attack(attack), Scene(ground)
    sends = {name: chosen.start(random.Random(f"{seed} {name} {attack}"), scene) for name in liars}
    air: list[Sent] = []
    for frame in story.frames:
        air += sends[frame.station](frame) if frame.station in sends else [Sent(frame, lies=False)]
        scene.heard.append(frame)
    return sorted(air, key=lambda sent: sent.frame.t_ns)


class Outcome(NamedTuple):
    """What came of one telling: who lied since when, who was reported when."""

    lied_ns: dict[str, int]
    reported_ns: dict[str, int]
    why: dict[str, str]
    highest: float


def judge(
    story: Story, air: list[Sent], ground: Ground, *, eye: bool, loss: float, seed: int
) -> Outcome:
    """Let a detector hear it all."""
    detector, rng = Detector(ground), random.Random(f"loss {seed}")
    lied_ns: dict[str, int] = {}
    reported_ns: dict[str, int] = {}
    why: dict[str, str] = {}
    highest = 0.0
    receiver = next(iter(ground.receivers))
    tracks = deque(story.tracks if eye else ())
    for (station, t_ns, body), lies in air:
        while tracks and tracks[0].t_ns <= t_ns:
            detector.see(tracks.popleft())
        if lies:
            lied_ns.setdefault(station, t_ns)
        if loss and rng.random() < loss:
            continue
        found = detector.hear(station, receiver, t_ns, body)
        if found is not None:
            highest = max(highest, found.memory.score)
        if found is not None and found.is_reported and station not in reported_ns:
            reported_ns[station] = t_ns
            why[station] = found.memory.worst
    return Outcome(lied_ns, reported_ns, why, highest)


@dataclass
class Tally:
    """Sums over several tellings."""

    liars: int = 0
    found: int = 0
    blamed: int = 0
    hours: float = 0.0
    delays_s: list[float] = field(default_factory=list)
    why: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    blamed_why: dict[str, int] = field(default_factory=lambda: defaultdict(int))

    def add(self, outcome: Outcome, honest: int, attackers: set[str], span_s: float) -> None:
        """Count one telling."""
        self.liars += len(outcome.lied_ns)
        self.hours += honest * span_s / 3600.0
        for station, t_ns in outcome.reported_ns.items():
            if station in outcome.lied_ns:
                self.found += 1
                self.delays_s.append(max(0, t_ns - outcome.lied_ns[station]) * 1e-9)
                self.why[outcome.why[station]] += 1
            elif station not in attackers:
                self.blamed += 1
                self.blamed_why[outcome.why[station]] += 1

    def row(self) -> str:
        """Return recall, precision, median time, false alarms an hour."""
        recall = self.found / self.liars if self.liars else float("nan")
        told = self.found + self.blamed
        precision = self.found / told if told else float("nan")
        delays = sorted(self.delays_s)
        median = f"{delays[len(delays) // 2]:.1f}" if delays else "-"
        return f"{recall:.2f} | {precision:.2f} | {median} | {self.blamed / self.hours:.2f}"


VARIANTS = {"Eye": (True, 0.0), "Eye, loss": (True, LOSS), "CAM": (False, 0.0),
            "CAM, loss": (False, LOSS)}  # fmt: skip


def groups_of(town: Town, seed: int) -> Iterator[set[str]]:
    """Yield who lies together, group after group; nobody lies twice."""
    names = [f"n{number + 1}" for number in range(town.cars)]
    random.Random(seed).shuffle(names)
    for k in range(town.groups):
        yield set(names[k * town.liars : (k + 1) * town.liars])


def table(
    town: Town,
    seeds: list[int],
    attacks: list[str],
    folder: Path | None,
    *,
    own_eye: bool,
    why: bool,
) -> None:
    """Print a table, a row an attack."""
    ground = Ground(load_map(town.map), None if own_eye else lambda _x, _y: True)
    stories = {seed: kept(town, seed, folder, own_eye=own_eye) for seed in seeds}
    print(f"\n### {town.title}, seeds {seeds}{', the real Eye' if own_eye else ''}\n")
    healthy(stories, ground)
    print(
        "\nEach cell: recall, precision, median time to detection [s], false alarms a car-hour.\n"
    )
    print(f"| attack | liars | {' | '.join(VARIANTS)} |\n|---|---:|{'---|' * len(VARIANTS)}")
    for attack in attacks:
        cells, liars = [], 0
        for eye, loss in VARIANTS.values():
            tally = attacked(stories, ground, attack, eye=eye, loss=loss)
            liars = tally.liars
            cells.append(
                tally.row().replace(" |", ",")
                + (f" {dict(tally.why)} {dict(tally.blamed_why)}" if why else "")
            )
        print(f"| {attack} | {liars} | {' | '.join(cells)} |", flush=True)


def attacked(
    stories: dict[int, Story], ground: Ground, attack: str, *, eye: bool, loss: float
) -> Tally:
    """Return what comes of an attack in all stories, by all groups."""
    tally = Tally()
    for seed, story in stories.items():
        for liars in groups_of(story.town, seed):
            air = lied(story, attack, liars, ground, seed)
            outcome = judge(story, air, ground, eye=eye, loss=loss, seed=seed)
            tally.add(outcome, story.town.cars - len(liars), liars, story.town.span_s)
    return tally


def healthy(stories: dict[int, Story], ground: Ground) -> None:
    """Print false alarms where nobody lies."""
    for title, (eye, loss) in VARIANTS.items():
        tally, highest = Tally(), 0.0
        for seed, story in stories.items():
            air = [Sent(frame, lies=False) for frame in story.frames]
            outcome = judge(story, air, ground, eye=eye, loss=loss, seed=seed)
            tally.add(outcome, story.town.cars, set(), story.town.span_s)
            highest = max(highest, outcome.highest)
        print(f"nobody lies, {title}: {tally.blamed} false alarms in {tally.hours:.2f} car-hours, "
              f"highest score {highest:.1f} "
              f"{dict(tally.blamed_why)}")  # fmt: skip


def cost(cars: int = 200, rate_hz: float = 10.0, span_s: float = 10.0) -> None:
    """Print the share of a core that so many cars cost; their CAMs are those of a smaller city."""
    town = TOWNS["grid"]
    story, ground = tell(town, 1), Ground(load_map(town.map), lambda _x, _y: True)
    frames = story.frames[len(story.frames) // 4 :]
    bodies: list[CamBody] = [frame.body for frame in frames]
    for title, eye in (("with Eye", True), ("CAMs alone", False)):
        detector = Detector(ground)
        for track in story.tracks[-200:] if eye else ():
            detector.see(track)
        count = round(cars * rate_hz * span_s)
        receiver = next(iter(ground.receivers))
        began = time.process_time()
        for k in range(count):
            frame = frames[k % len(frames)]
            detector.hear(frame.station, receiver, frame.t_ns + k, bodies[k % len(frames)])
        took = time.process_time() - began
        share = took / span_s
        print(f"{cars} cars x {rate_hz:g} CAMs/s, {title}: {took / count * 1e6:.1f} us a CAM, "
              f"{share:.1%} of a core")  # fmt: skip


def main() -> None:
    """Print tables."""
    parser = argparse.ArgumentParser(prog="python -m bench.misbehaviour", description=__doc__)
    parser.add_argument("what", nargs="*", help="school, grid, cost; without: all")
    parser.add_argument("--seeds", type=int, nargs="+", default=[11, 12, 13])
    parser.add_argument("--attacks", nargs="*", default=attack_names())
    parser.add_argument("--healthy", action="store_true", help="only the honest city")
    parser.add_argument("--own-eye", action="store_true", help="render and find tags, slowly")
    parser.add_argument("--keep", type=Path, help="folder of the honest runs, told once")
    parser.add_argument("--why", action="store_true", help="name the checks that found them")
    given = parser.parse_args()
    for what in given.what or ("school", "grid", "cost"):
        if what == "cost":
            cost()
            continue
        attacks = [] if given.healthy else given.attacks
        table(TOWNS[what], given.seeds, attacks, given.keep, own_eye=given.own_eye, why=given.why)


if __name__ == "__main__":
    main()
