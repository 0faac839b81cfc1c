"""Misbehaviour: how many liars are found, how soon, how many honest cars are blamed, and the cost.

Run with `python -m bench misbehaviour`, or `python -m bench.misbehaviour [school | grid | cost]
[--seeds 21 22 23] [--span SECONDS] [--attacks NAME ...] [--healthy] [--own-eye] [--why]
[--keep FOLDER]`. A city is run in lockstep with honest cars, once for each seed, and stored in the
folder; what they sent, made noisy, is replayed with some lying, each time judged in four ways:
with and without the Eye, with and without loss.
"""

import argparse
import math
import random
import sys
import time
from collections import defaultdict, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import msgspec

from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.misbehaviour.attack import Frame, Scene, Sent, attack_names, load_attack
from scm.traffic.misbehaviour.check import Sender
from scm.traffic.misbehaviour.detector import UNKNOWN, Detector
from scm.traffic.misbehaviour.forge import driven, moved
from scm.traffic.misbehaviour.ground import Ground
from scm.traffic.signals.part import TrafficPart
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.etsi.convert import read_cam
from scm.v2x.message import Refused
from scm.v2x.messages.cam import CamTx
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.world.part import WorldPart

START_NS = 1_795_000_000_000_000_000
OWN_M, OWN_MPS, OWN_RAD, OWN_MPS2 = 0.005, 0.005, math.radians(0.5), 0.03
EYE_M, EYE_MPS, EYE_RAD, EYE_MISSES = 0.003, 0.015, math.radians(0.7), 0.02
LOSS = 0.3
CAR = "nigel"
POSITION_AND_SPEED = (
    "constant_position_offset", "random_position_offset", "position_mirroring",
    "constant_speed_offset", "random_speed_offset", "zero_speed", "frozen_speed", "sudden_stop",
)  # fmt: skip


class Town(msgspec.Struct, frozen=True):
    """A city to judge in: its map, cars, time, and how many lie at once, in how many tellings."""

    title: str
    map: str
    cars: int
    span_s: float
    liars: int
    groups: int


TOWNS = {
    "school": Town("driving school, 6 cars", "driving_school", 6, 120.0, 1, 6),
    "grid": Town("grid 3 x 3, 30 cars", "grid:3x3:4", 30, 90.0, 6, 5),
}


class Story(msgspec.Struct):
    """What an honest city sent and what was seen of it, in order of time."""

    town: Town
    frames: list[Frame]
    tracks: list[EyeTrack]


def run_honest_city(town: Town, seed: int, *, own_eye: bool = False) -> Story:
    """Run a city and note what its cars sent; they come one after the other."""
    city_map = load_map(town.map)
    parts = [WorldPart(city_map, seed, room=town.cars), TrafficPart(city_map)]
    if own_eye:
        from scm.eye.part import EyePart

        parts.append(EyePart(city_map, seed=seed))
    rng = random.Random(seed)
    with Lockstep(parts, start_ns=START_NS) as city:
        frames, truths = (
            city.subscribe(Subscription(CamTx)),
            city.subscribe(Subscription(WorldSnapshot)),
        )
        tracks = city.subscribe(Subscription(EyeTrack))
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
        sent = [noisy(Frame(m.station, m.t_ns, m.body), rng) for m in drained(frames)]
        if own_eye:
            return Story(town, sent, list(drained(tracks)))
        return Story(town, sent, [one for m in drained(truths) for one in stand_in(m, rng)])


def stored_story(town: Town, seed: int, folder: Path | None, *, own_eye: bool) -> Story:
    """Return a story, from a folder where it was stored before."""
    if folder is None:
        return run_honest_city(town, seed, own_eye=own_eye)
    eye = "eye" if own_eye else "stand-in"
    path = folder / f"{town.map.replace(':', '_')}-{town.span_s:.0f}s-{seed}-{eye}.story"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        began = time.monotonic()
        story = run_honest_city(town, seed, own_eye=own_eye)
        path.write_bytes(msgspec.msgpack.encode(story))
        report(
            f"simulated {path.name} in {time.monotonic() - began:.0f} s: {len(story.frames)} CAMs"
        )
    return msgspec.msgpack.decode(path.read_bytes(), type=Story)


def report(text: str) -> None:
    """Tell how far it is, beside the tables."""
    print(text, file=sys.stderr, flush=True)


def drained(mailbox) -> Iterator:
    """Yield the messages of a mailbox."""
    for item in mailbox.drain():
        yield item.message


def noisy(frame: Frame, rng: random.Random) -> Frame:
    """Return a frame of a car that knows itself only so well."""
    reported = read_cam(frame.body)
    x_m, y_m = reported.place or (math.nan, math.nan)  # cars of the city know where they are
    body = moved(frame.body, rng.gauss(x_m, OWN_M), rng.gauss(y_m, OWN_M))
    accel = frame.body.motion.longitudinal_acceleration.value * 0.1 / SCALE
    body = driven(
        body,
        speed_mps=rng.gauss(reported.speed_mps or 0.0, OWN_MPS),
        yaw_rad=rng.gauss(reported.yaw_rad or 0.0, OWN_RAD),
        accel_mps2=rng.gauss(accel, OWN_MPS2),
    )
    return frame._replace(body=body)


def stand_in(truth: WorldSnapshot, rng: random.Random) -> Iterator[EyeTrack]:
    """Yield what an Eye would report of all cars: the truth with its noise, and some missing."""
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
        scene.claims_checked.append(frame)
    return sorted(air, key=lambda sent: sent.frame.t_ns)


class Outcome(NamedTuple):
    """The outcome of one replay: who lied since when, who was reported when, and what was held."""

    lied_ns: dict[str, int]
    reported_ns: dict[str, int]
    why: dict[str, str]
    highest: dict[str, float]


def judge(
    story: Story, air: list[Sent], ground: Ground, *, eye: bool, loss: float, seed: int
) -> Outcome:
    """Let a detector hear it all."""
    detector, rng = Detector(ground), random.Random(f"loss {seed}")
    outcome = Outcome({}, {}, {}, defaultdict(float))
    receiver = next(iter(ground.receivers))
    tracks = deque(story.tracks if eye else ())
    story_cars = {frame.station for frame in story.frames}
    for (station, t_ns, body), lies in air:
        while tracks and tracks[0].t_ns <= t_ns:
            detector.see(tracks.popleft())
        if lies:
            outcome.lied_ns.setdefault(station, t_ns)
        if loss and rng.random() < loss:
            continue
        sender = Sender(CAR) if station in story_cars else UNKNOWN  # a ghost is no car of the city
        found = detector.receive(station, receiver, t_ns, body, sender=sender)
        if found is None:
            continue
        outcome.highest[station] = max(outcome.highest[station], found.history.score)
        if found.is_reported and station not in outcome.reported_ns:
            outcome.reported_ns[station] = t_ns
            outcome.why[station] = found.history.worst
    return outcome


@dataclass
class Tally:
    """Sums over several tellings."""

    liars: int = 0
    found: int = 0
    blamed: int = 0
    hours: float = 0.0
    highest: float = 0.0
    delays_s: list[float] = field(default_factory=list)
    why: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    blamed_why: dict[str, int] = field(default_factory=lambda: defaultdict(int))

    def add(self, outcome: Outcome, honest: int, attackers: set[str], span_s: float) -> None:
        """Count one telling."""
        self.liars += len(outcome.lied_ns)
        self.hours += honest * span_s / 3600.0
        others = (score for name, score in outcome.highest.items() if name not in outcome.lied_ns)
        self.highest = max(self.highest, *others, 0.0)
        for station, t_ns in outcome.reported_ns.items():
            if station in outcome.lied_ns:
                self.found += 1
                self.delays_s.append(max(0, t_ns - outcome.lied_ns[station]) * 1e-9)
                self.why[outcome.why[station]] += 1
            elif station not in attackers:
                self.blamed += 1
                self.blamed_why[outcome.why[station]] += 1

    def merge(self, other: "Tally") -> None:
        """Add another tally's counts."""
        self.liars, self.found = self.liars + other.liars, self.found + other.found
        self.blamed, self.hours = self.blamed + other.blamed, self.hours + other.hours
        self.delays_s += other.delays_s

    def cell(self, *, why: bool = False) -> str:
        """Return recall, precision, median time, false alarms an hour."""
        recall = self.found / self.liars if self.liars else float("nan")
        suspected = self.found + self.blamed
        precision = self.found / suspected if suspected else float("nan")
        delays = sorted(self.delays_s)
        median = f"{delays[len(delays) // 2]:.1f}" if delays else "-"
        text = f"{recall:.2f}, {precision:.2f}, {median}, {self.blamed / self.hours:.2f}"
        return f"{text} {dict(self.why)} {dict(self.blamed_why)}" if why else text


VARIANTS = {"Eye": (True, 0.0), "Eye, loss": (True, LOSS), "CAM": (False, 0.0),
            "CAM, loss": (False, LOSS)}  # fmt: skip


def groups_of(town: Town, seed: int) -> Iterator[set[str]]:
    """Yield who lies together, group after group; nobody lies twice."""
    names = [f"n{number + 1}" for number in range(town.cars)]
    random.Random(seed).shuffle(names)
    for k in range(town.groups):
        yield set(names[k * town.liars : (k + 1) * town.liars])


def rate_below(count: int, hours: float) -> float:
    """Return the rate an hour that so few events rule out beyond with 95 % (Poisson)."""
    low, high = 0.0, 3.0 * count + 10.0
    for _ in range(60):
        mean = (low + high) / 2.0
        fewer = sum(math.exp(-mean) * mean**k / math.factorial(k) for k in range(count + 1))
        low, high = (mean, high) if fewer > 0.05 else (low, mean)
    return high / hours


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
    stories = {seed: stored_story(town, seed, folder, own_eye=own_eye) for seed in seeds}
    print(f"\n### {town.title}, seeds {seeds}{', the real Eye' if own_eye else ''}\n")
    healthy(stories, ground)
    if not attacks:
        return
    print("\nEach cell: recall, precision, median seconds to the report, false alarms a car-hour.")
    print(f"\n| attack | liars | {' | '.join(VARIANTS)} |\n|---|---:|{'---|' * len(VARIANTS)}")
    sums = {title: Tally() for title in VARIANTS}
    for attack in attacks:
        tallies = attacked(stories, ground, attack, why=why)
        liars = max(tally.liars for tally in tallies.values())
        cells = [tally.cell(why=why) for tally in tallies.values()]
        print(f"| {attack} | {liars} | {' | '.join(cells)} |", flush=True)
        if attack in POSITION_AND_SPEED:
            for title, tally in tallies.items():
                sums[title].merge(tally)
    if all(tally.liars for tally in sums.values()):
        liars = sums["Eye"].liars
        cells = [tally.cell() for tally in sums.values()]
        print(f"| all on position and speed | {liars} | {' | '.join(cells)} |", flush=True)


def attacked(
    stories: dict[int, Story], ground: Ground, attack: str, *, why: bool
) -> dict[str, Tally]:
    """Return by variant what comes of an attack in all stories, by all groups."""
    tallies = {title: Tally() for title in VARIANTS}
    for seed, story in stories.items():
        for liars in groups_of(story.town, seed):
            air = lied(story, attack, liars, ground, seed)
            for title, (eye, loss) in VARIANTS.items():
                outcome = judge(story, air, ground, eye=eye, loss=loss, seed=seed)
                honest = story.town.cars - len(liars)
                tallies[title].add(outcome, honest, liars, story.town.span_s)
                if why:
                    report_missed(f"{attack}, {title}, seed {seed}", outcome, story, air)
    return tallies


def report_missed(where: str, outcome: Outcome, story: Story, air: list[Sent]) -> None:
    """Say of each liar that was missed how great its lies were, and of the honest who was blamed.

    Sizes are those of single lies, middle and greatest; the time is that of the frames that lie.
    """
    true = {(frame.station, frame.t_ns): frame for frame in story.frames}
    for name in sorted(set(outcome.lied_ns) - set(outcome.reported_ns)):
        sizes = sorted(
            size_of(sent.frame, true[name, sent.frame.t_ns])
            for sent in air
            if sent.lies and sent.frame.station == name and (name, sent.frame.t_ns) in true
        )
        middle = sizes[len(sizes) // 2] if sizes else "other times"
        count = sum(sent.lies and sent.frame.station == name for sent in air)
        report(f"missed: {where}, {name}: {count} lies, middle {middle}, greatest {sizes[-1:]}, "
            f"score {outcome.highest[name]:.1f}")  # fmt: skip
    for name in sorted(set(outcome.reported_ns) - set(outcome.lied_ns)):
        report(f"blamed: {where}, {name}: {outcome.why[name]}")


def size_of(claimed: Frame, true: Frame) -> tuple[float, float, float]:
    """Return how far a frame lies off in speed [m/s], place [m] and acceleration [m/s^2]."""
    one, other = read_cam(claimed.body), read_cam(true.body)
    accels = (f.body.motion.longitudinal_acceleration.value * 0.1 / SCALE for f in (claimed, true))
    return (
        round(abs((one.speed_mps or 0.0) - (other.speed_mps or 0.0)), 3),
        round(math.hypot(one.x_m - other.x_m, one.y_m - other.y_m), 3),
        round(abs(next(accels) - next(accels)), 2),
    )


def healthy(stories: dict[int, Story], ground: Ground) -> None:
    """Print false alarms where nobody lies."""
    for title, (eye, loss) in VARIANTS.items():
        tally = Tally()
        for seed, story in stories.items():
            air = [Sent(frame, lies=False) for frame in story.frames]
            outcome = judge(story, air, ground, eye=eye, loss=loss, seed=seed)
            tally.add(outcome, story.town.cars, set(), story.town.span_s)
        most = rate_below(tally.blamed, tally.hours)
        print(f"nobody lies, {title}: {tally.blamed} false alarms in {tally.hours:.2f} car-hours "
              f"(95 %: below {most:.2f} a car-hour), highest score {tally.highest:.1f} "
              f"{dict(tally.blamed_why)}", flush=True)  # fmt: skip


def cost(folder: Path | None, cars: int = 200, rate_hz: float = 10.0) -> None:
    """Print the share of a core that so many cars cost, by what a smaller city costs a CAM."""
    town = TOWNS["grid"]
    story = stored_story(town, 1, folder, own_eye=False)
    ground = Ground(load_map(town.map), lambda _x, _y: True)
    air = [Sent(frame, lies=False) for frame in story.frames]
    for title, eye in (("with Eye and its tracks", True), ("CAMs alone", False)):
        judge(story, air, ground, eye=eye, loss=0.0, seed=1)
        began = time.process_time()
        judge(story, air, ground, eye=eye, loss=0.0, seed=1)
        each_s = (time.process_time() - began) / len(air)
        print(f"{cars} cars x {rate_hz:g} CAMs/s, {title}: {each_s * 1e6:.1f} us a CAM, "
              f"{each_s * cars * rate_hz:.1%} of a core")  # fmt: skip


def main() -> None:
    """Print tables."""
    parser = argparse.ArgumentParser(prog="python -m bench.misbehaviour", description=__doc__)
    parser.add_argument("what", nargs="*", help="school, grid, cost; without: all")
    parser.add_argument("--seeds", type=int, nargs="+", default=[21, 22, 23])
    parser.add_argument("--span", type=float, help="seconds of a city; without: those of the town")
    parser.add_argument("--attacks", nargs="*", default=attack_names())
    parser.add_argument("--healthy", action="store_true", help="only the honest city")
    parser.add_argument("--own-eye", action="store_true", help="render and find tags, slowly")
    parser.add_argument("--keep", type=Path, help="folder of the honest runs, simulated once")
    parser.add_argument("--why", action="store_true", help="name the checks, and whom they missed")
    given = parser.parse_args()
    for what in given.what or ("school", "grid", "cost"):
        if what == "cost":
            cost(given.keep)
            continue
        attacks = [] if given.healthy else given.attacks
        town = TOWNS[what]
        if given.span is not None:
            town = msgspec.structs.replace(town, span_s=given.span)
        table(town, given.seeds, attacks, given.keep, own_eye=given.own_eye, why=given.why)


if __name__ == "__main__":
    main()
