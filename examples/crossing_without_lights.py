"""Four cars meet where there are no lights, and only the radio tells them of each other.

Each approaches from another side at the same time; who goes first they work out from their CAMs:
all must stop, and who stood there first goes first. The radio gets worse from row to row.
    python examples/crossing_without_lights.py

With many starts and a page of results: scm study run studies/crossing_without_lights.toml
"""

import math

from msgspec.structs import replace

from scm.records.city_map import RadioChannel
from scm.runtime.lockstep import Lockstep
from scm.study.scenarios.crossing_without_lights import ARMS, MAP, Crossed, Start, cross
from scm.world.part import WorldPart

LONGEST_S = 90.0
RADIOS = {
    "perfect": RadioChannel(),
    "30 % lost": RadioChannel(loss=0.3),
    "60 % lost": RadioChannel(loss=0.6),
    "90 % lost": RadioChannel(loss=0.9),
    "all lost": RadioChannel(loss=1.0),
    "300 ms late": RadioChannel(delay_ms=250.0, jitter_ms=100.0),
    "both": RadioChannel(loss=0.5, delay_ms=150.0, jitter_ms=100.0),
}


def run(radio: RadioChannel, seed: int = 0, longest_s: float = LONGEST_S) -> Crossed:
    """Return when each car was over the junction, and how near they came to each other."""
    world = WorldPart(replace(MAP, radio=radio), seed, room=len(ARMS))
    with Lockstep([world]) as city:
        return cross(city, world, dict.fromkeys(ARMS, Start()), longest_s)


def main() -> None:
    """Print a table, a row a radio; inf: it still stood at its line after 90 s."""
    columns = [*(f"{arm}, s" for arm in ARMS), "over the junction", "least distance, m"]
    print(f"| radio | {' | '.join(columns)} |")
    print("|---|" + "---:|" * len(columns))
    for name, radio in RADIOS.items():
        crossed = run(radio)
        times = crossed.across_s.values()
        cells = [*(f"{t:.1f}" for t in times), str(sum(t < math.inf for t in times))]
        print(f"| {name} | {' | '.join(cells)} | {crossed.least_distance_m:.3f} |", flush=True)


if __name__ == "__main__":
    main()
