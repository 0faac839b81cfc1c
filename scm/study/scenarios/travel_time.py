"""Cars cross a junction with signals from all four sides: how long their trips take.

They come from four streets at random times, as many an hour from each, and drive straight on or
turn. A car that finds no room on its street waits outside the city; that wait is part of its trip.
The junctions around have the same policy.
"""

import math

from scm.study.case import Case
from scm.traffic.demand.part import DemandPart
from scm.traffic.demand.table import Flow
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart

MAP = "grid:3x3"
STREETS = {"e": "j0_1_e", "w": "j2_1_w", "n": "j1_0_n", "s": "j1_2_s"}
TURNS = {"e": "ens", "w": "wns", "n": "new", "s": "sew"}
STRAIGHT_ON = 0.6  # share of cars
ROOM = 80


def run(
    case: Case,
    policy: str = "fixed",
    plan: str = "calm",
    cars_per_hour: float = 120.0,
    duration_s: float = 300.0,
) -> dict[str, float]:
    """Return the mean travel time, and how many of the cars that wanted to come arrived.

    Args:
        case: The case.
        policy: Of the signals: `fixed`, `actuated`, `max_pressure`, ...
        plan: Of the policy `fixed`.
        cars_per_hour: From each street.
        duration_s: How long the city runs.
    """
    signals = TrafficPart(case.map, plan, policy=policy)
    demand = DemandPart(case.map, _flows(case.seed, cars_per_hour, duration_s))
    parts = (case.world(room=ROOM), signals, MonitorPart(case.map), demand)
    with case.lockstep(parts) as city:
        city.run_for(duration_s)
    counts = demand.status
    return {
        "travel_time_s": counts.waited_s + counts.travel_s if counts.arrived else math.nan,
        "waited_s": counts.waited_s,
        "arrived_share": counts.arrived / max(1, counts.wanted),
    }


def _flows(seed: int, cars_per_hour: float, duration_s: float) -> list[Flow]:
    flows = []
    for side, street in STREETS.items():
        for way in TURNS[side]:
            share = STRAIGHT_ON if way == side else 0.5 * (1.0 - STRAIGHT_ON)
            flows.append(
                Flow(
                    street, f"j1_1_{way}", share * cars_per_hour, 0.0, duration_s,
                    seed=seed, name=f"{side} to {way}",
                )
            )  # fmt: skip
    return flows
