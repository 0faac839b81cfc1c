"""Signals: exhaustive proofs, 10^8 random steps, and what a step of a controller costs.

Run with `python -m bench signals`, or `python -m bench.signals STEPS` for another number of steps.
"""

import sys
import time

from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.city_map import CityMap
from scm.traffic.signals import kernel, rings
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.kernel import Program
from scm.traffic.signals.policy import policy_names
from scm.traffic.signals.program import STEP_NS, program_of
from scm.traffic.signals.proof.kernel_proof import in_steps, prove
from scm.traffic.signals.proof.random_requests import run_random_requests
from scm.traffic.signals.proof.ring_proof import prove_service, small_times

STEPS, JUNCTIONS = 100_000_000, 4_000
LIVE_STEPS = 3000


def shapes(city_map: CityMap) -> dict[str, Program]:
    """Return one program of each number of groups that a map's junctions have."""
    roads = Roads(city_map)
    found: dict[int, tuple[str, Program]] = {}
    for junction in city_map.junctions:
        program = program_of(junction, roads)
        found.setdefault(len(program.groups), (f"{city_map.name} {junction.name}", program))
    return dict(found.values())


def main() -> None:
    """Print a table of proofs, of floods, and of policies."""
    steps = int(sys.argv[-1]) if sys.argv[-1].isdigit() else STEPS
    programs = shapes(load_map("driving_school")) | shapes(load_map("grid:3x3"))
    print("| junction | kernel: states | transitions | s | rings: states | worst wait | s |")
    print("|---|---|---|---|---|---|---|")
    for name, program in programs.items():
        began = time.perf_counter()
        walked = prove(kernel, in_steps(program, STEP_NS))
        middle = time.perf_counter()
        served = prove_service(rings, *small_times(program))
        end = time.perf_counter()
        print(
            f"| {name} | {len(walked.states)} | {walked.transitions} | {middle - began:.2f} "
            f"| {served.states} | {max(served.worst_wait)} steps | {end - middle:.2f} |"
        )
    print("\n| junction | random steps | greens | conflicts | short clearances | s |")
    print("|---|---|---|---|---|---|")
    each = max(1, steps // JUNCTIONS // len(programs) + 1)
    for seed, (name, program) in enumerate(programs.items()):
        began = time.perf_counter()
        judged = run_random_requests(in_steps(program, STEP_NS), JUNCTIONS, each, seed)
        spent = time.perf_counter() - began
        numbers = f"{judged.steps:.3g} | {judged.greens} | {judged.conflicts}"
        print(f"| {name} | {numbers} | {judged.short_clearances} | {spent:.1f} |", flush=True)
    print("\n| policy | a controller's step, us |\n|---|---|")
    program = next(reversed(programs.values()))
    for policy in policy_names():
        controller = Controller("x", program, "calm", policy=policy)
        began = time.perf_counter()
        for k in range(LIVE_STEPS):
            controller.step(k * STEP_NS)
        print(f"| {policy} | {(time.perf_counter() - began) / LIVE_STEPS * 1e6:.0f} |")


if __name__ == "__main__":
    main()
