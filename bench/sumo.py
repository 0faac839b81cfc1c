"""Whether cities imported from SUMO's generated networks flow: grids, spiders and random ones.

Run with `python -m bench sumo [--seeds 0:50] [--seconds 600] [--scale 10]`; needs `netgenerate`
(`pip install eclipse-sumo`). Each seed is another network: kind, size, junction types, lanes, side
of the road and signal layout are drawn from it. Demand is added between edges
until the lines on its ways are at a share of their capacity, half by default.

    capacity of a line with a signal     3600 / headway x its share of green
    of a crossing without signals        one car at a time: 3600 / (way + car) x slowest speed

Printed per seed: what became of it. `flowed`: no car stood for 180 s, no two touched.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

import numpy as np

from bench.flow import STANDS_MPS, counted
from scm.errors import DemandError, ScmError
from scm.maps.route import Roads
from scm.maps.sumo import import_sumo
from scm.records.city_map import CityMap
from scm.runtime.lockstep import Lockstep
from scm.traffic.demand.part import DemandPart, Ways
from scm.traffic.demand.table import Flow
from scm.traffic.signals.custom_plans import OWN, adopted, map_timetable
from scm.traffic.signals.part import TrafficPart
from scm.traffic.signals.plan import load_timetable
from scm.traffic.signals.program import program_of
from scm.traffic.signals.timing import NIGEL, headway_s
from scm.world.part import WorldPart

STOOD_S = 180.0
PAIRS = 60
LEAST_PER_HOUR = 6.0
MOST_CARS = 150
TYPES = ("priority", "priority_stop", "right_before_left", "allway_stop", "traffic_light")
LAYOUTS = ("opposites", "incoming", "alternateOneWay")


def options(seed: int) -> tuple[str, list[str]]:
    """Return the kind of a seed's network and the options of `netgenerate` that make it."""
    dice = Random(seed)
    kind = ("grid", "spider", "rand")[seed % 3]
    length = dice.choice((40, 56, 70))
    given = [f"--{kind}", "--seed", str(seed)]
    if kind == "grid":
        given += [
            "--grid.x-number",
            str(dice.randint(2, 4)),
            "--grid.y-number",
            str(dice.randint(2, 4)),
            "--grid.length",
            str(length),
        ]
        given += ["--grid.attach-length", str(length)] if dice.random() < 0.5 else []
    elif kind == "spider":
        given += [
            "--spider.arm-number",
            str(dice.randint(3, 6)),
            "--spider.circle-number",
            str(dice.randint(1, 3)),
            "--spider.space-radius",
            str(length),
        ]
        given += ["--spider.omit-center"] if dice.random() < 0.5 else []
    else:
        given += [
            "--rand.iterations",
            str(dice.randint(8, 25)),
            "--rand.min-distance",
            str(length),
            "--rand.max-distance",
            str(2 * length),
        ]
    given += ["--default-junction-type", dice.choice(TYPES)]
    given += ["--tls.layout", dice.choice(LAYOUTS)]
    given += ["--default.lanenumber", "2"] if dice.random() < 0.25 else []
    given += ["--lefthand"] if dice.random() < 0.2 else []
    return kind, given


def network(seed: int, folder: Path) -> Path:
    """Return the network of a seed, made by `netgenerate`."""
    out = folder / f"seed{seed}.net.xml"
    program = Path(sys.executable).parent / "netgenerate"
    call = [str(program), *options(seed)[1], "--output-file", str(out)]
    subprocess.run(call, check=True, capture_output=True, text=True)
    return out


def flows_of(city_map: CityMap, seed: int) -> list[tuple[Flow, tuple[str, ...]]]:
    """Return flows between edges far apart, each with its way, all equally strong."""
    dice, ways = Random(seed), Ways(city_map)
    edges = sorted({lane.name.rpartition("_")[0] for lane in city_map.lanes
                    if ".." not in lane.name})  # fmt: skip
    found: dict[tuple[str, str], tuple[str, ...]] = {}
    for _ in range(40 * PAIRS):
        start, end = dice.choice(edges), dice.choice(edges)
        if len(found) == PAIRS or start == end:
            continue
        try:
            _, route = ways.of(Flow(start, end, 1.0), "")
        except DemandError:
            continue
        if len(route) >= 5:
            found[start, end] = route
    return [(Flow(a, b, 1.0, seed=seed), route) for (a, b), route in found.items()]


def capacities(city_map: CityMap) -> tuple[dict[str, float], dict[str, tuple[str, float]]]:
    """Return cars an hour: by lane with a signal; by other lanes, their crossing and its cars."""
    roads, lit, unlit = Roads(city_map), {}, {}
    hour = 3600.0
    for junction in city_map.junctions:
        program = program_of(junction, roads)
        table = (map_timetable(junction.stages, program) if junction.plan == OWN
                 else load_timetable(junction.plan, program))  # fmt: skip
        for group in junction.groups:
            green = sum(g.end_ns - g.start_ns for g in table.greens_of(group.name))
            for line in roads.stop_lines_of(junction.name, group.name):
                limit = roads.definition(line.lane).speed_limit_mps
                lit[line.lane] = hour / headway_s(NIGEL, limit) * green / table.length_ns
    for crossing in city_map.crossings:
        ways = [way.to_m for approach in crossing.approaches for way in approach.ways]
        limit = min(roads.definition(a.lane).speed_limit_mps for a in crossing.approaches)
        passing_s = (sum(ways) / len(ways) + NIGEL.length_m) / min(NIGEL.slow_mps, limit)
        for approach in crossing.approaches:
            unlit[approach.lane] = crossing.name, hour / passing_s
    return lit, unlit


def loaded(city_map: CityMap, seed: int, share: float) -> list[Flow]:
    """Return a demand under which no lane or crossing has more than a share of its capacity.

    Each flow in turn gets what the ones before it left along its way.
    """
    lit, unlit = capacities(city_map)
    plain = 3600.0 / headway_s(NIGEL)
    left: dict[str, float] = {}
    found = []
    for flow, route in flows_of(city_map, seed):
        places = {lane: lit.get(lane, plain) for lane in route}
        places |= dict(unlit[lane] for lane in route if lane in unlit)
        per_hour = min(left.get(name, share * most) for name, most in places.items())
        if per_hour < LEAST_PER_HOUR:
            continue
        for name, most in places.items():
            left[name] = left.get(name, share * most) - per_hour
        found.append(Flow(flow.start, flow.end, per_hour, seed=seed))
    return found


@dataclass(frozen=True)
class Outcome:
    """What became of a seed: `flowed`, `jammed`, `touched`, `refused` or `failed`, and why."""

    what: str
    why: str


def drive(city_map: CityMap, flows: Sequence[Flow], span_s: float) -> Outcome:
    """Run a city with its demand; return what was seen."""
    world = WorldPart(city_map, room=MOST_CARS)
    world.attach(lambda _kind, _where: False)
    touched = counted(world.world)
    demand = DemandPart(city_map, flows)
    vehicles, stands, longest = world.world.cars.arrays, np.zeros(MOST_CARS), (0.0, "")
    parts = [world, TrafficPart(city_map), demand] if city_map.junctions else [world, demand]
    with Lockstep(parts) as city:
        for _ in range(round(span_s)):
            city.run_for(1.0)
            stands = np.where(
                vehicles.hosted & (np.abs(vehicles.speed) < STANDS_MPS), stands + 1.0, 0.0
            )
            worst = int(stands.argmax())
            if stands[worst] > longest[0]:
                at = f"({vehicles.x[worst]:.2f}, {vehicles.y[worst]:.2f})"
                longest = float(stands[worst]), f"{vehicles.names[worst]} at {at}"
    status = demand.status
    words = (
        f"{status.wanted} wanted, {status.entered} entered, {status.arrived} arrived, "
        f"longest stand {longest[0]:.0f} s ({longest[1]}), contacts {len(touched.began)}"
    )
    if touched.began:
        return Outcome("touched", words)
    jammed = longest[0] >= min(STOOD_S, span_s / 2.0)
    return Outcome("jammed" if jammed else "flowed", words)


def run(seed: int, folder: Path, scale: float, share: float, span_s: float) -> Outcome:
    """Make, import and drive a seed's network."""
    net = network(seed, folder)
    try:
        city_map, _ = adopted(import_sumo(net, scale=scale).city_map)
        flows = loaded(city_map, seed, share)
    except ScmError as refusal:
        return Outcome("refused", str(refusal).replace(f"{net}: ", ""))
    if not flows:
        return Outcome("refused", "no two edges with a way between them")
    return drive(city_map, flows, span_s)


def main() -> None:
    """Print a row a seed, then how many had which outcome."""
    parser = argparse.ArgumentParser(prog="python -m bench sumo", description=__doc__)
    parser.add_argument("--seeds", default="0:50", help="FROM:TO, or one seed")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--scale", type=float, default=10.0)
    parser.add_argument("--share", type=float, default=0.5, help="of capacity")
    given = parser.parse_args()
    first, _, last = given.seeds.partition(":")
    seeds = range(int(first), int(last or int(first) + 1))
    outcomes: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    print("| seed | network | outcome | took, s | |\n|---:|---|---|---:|---|")
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            began = time.process_time()
            found = run(seed, Path(folder), given.scale, given.share, given.seconds)
            took = time.process_time() - began
            outcomes[found.what] += 1
            if found.what == "refused":
                reasons[re.sub(r"'[^']*'|[\d.]+", "_", found.why)] += 1
            what = " ".join(options(seed)[1])
            print(f"| {seed} | {what} | {found.what} | {took:.0f} | {found.why} |", flush=True)
    print(f"\n{len(seeds)} networks: " + ", ".join(f"{n} {what}" for what, n in outcomes.items()))
    for why, count in reasons.most_common():
        print(f"  {count} refused: {why}")


if __name__ == "__main__":
    main()
