"""Four cars meet where there are no lights, and only the radio tells them of each other.

Each approaches from another side at the same time; who goes first they work out from their CAMs:
all must stop, and who stood there first goes first. The radio gets worse from row to row.
    python examples/crossing_without_lights.py
"""

import itertools
import math

import numpy as np
from msgspec.structs import replace

from scm.maps.grid_city import grid_city
from scm.records.city_map import RadioChannel, Sign
from scm.runtime.lockstep import Lockstep
from scm.v2x.messages.route_request import RouteRequest
from scm.world.driving import send
from scm.world.part import WorldPart

ARMS = {"e": "j0_1_e", "n": "j1_0_n", "w": "j2_1_w", "s": "j1_2_s"}
LINE_M, BEFORE_M, LONGEST_S = 4.78, 0.9, 90.0
RADIOS = {
    "perfect": RadioChannel(),
    "30 % lost": RadioChannel(loss=0.3),
    "60 % lost": RadioChannel(loss=0.6),
    "90 % lost": RadioChannel(loss=0.9),
    "all lost": RadioChannel(loss=1.0),
    "300 ms late": RadioChannel(delay_ms=250.0, jitter_ms=100.0),
    "both": RadioChannel(loss=0.5, delay_ms=150.0, jitter_ms=100.0),
}


def crossing(radio: RadioChannel, seed: int = 0) -> WorldPart:
    """Return a world whose middle junction has four stop signs, and a car before each."""
    signs = [
        Sign(sign_id=n, kind="stop", x_m=0.0, y_m=0.0, yaw_rad=0.0, lane=lane, at_m=LINE_M)
        for n, lane in enumerate(ARMS.values(), start=1)
    ]
    city_map = grid_city(3, 3, block_m=6.0, signs=True)
    part = WorldPart(replace(city_map, signs=tuple(signs), radio=radio), seed, room=4)
    part.attach(lambda _kind, _where: False)
    for arm, lane in ARMS.items():
        at = part.world.roads.lane(lane).at(LINE_M - BEFORE_M)
        car = part.world.host(arm, "nigel", at, 0)
        lanes = (f"j1_1_{arm}{arm}", f"j1_1_{arm}")
        send(part.world, car, RouteRequest(vehicle=arm, via=lanes), 0)
    return part


def apart(x: float, y: float, yaw: float, corners: np.ndarray) -> float:
    """Return how far corners (4, 2) are from the outline of a car [m]; 0: inside."""
    dx, dy = corners[:, 0] - x, corners[:, 1] - y
    ahead, beside = dx * math.cos(yaw) + dy * math.sin(yaw), dy * math.cos(yaw) - dx * math.sin(yaw)
    away = np.maximum([np.abs(ahead - 0.08) - 0.15, np.abs(beside) - 0.0875], 0.0)
    return float(np.hypot(*away).min())


def corners_of(x: float, y: float, yaw: float) -> np.ndarray:
    """Return the corners (4, 2) of a car whose rear axle is there."""
    at = np.array([(a, b) for a in (-0.07, 0.23) for b in (-0.0875, 0.0875)])
    turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    return at @ turn + (x, y)


def run(
    radio: RadioChannel, seed: int = 0, longest_s: float = LONGEST_S
) -> tuple[list[float], float]:
    """Return when each car was over the junction [s], and the least distance between two [m]."""
    part = crossing(radio, seed)
    vehicles = part.world.cars.arrays
    through, least = [math.inf] * 4, math.inf
    with Lockstep([part]) as city:
        for step in range(round(longest_s / 0.1)):
            city.run_for(0.1)
            poses = [(vehicles.x[n], vehicles.y[n], vehicles.yaw[n]) for n in range(4)]
            for one, other in itertools.permutations(poses, 2):
                least = min(least, apart(*one, corners_of(*other)))
            for n in range(4):
                if part.world.drivers.passed[n] >= 2:
                    through[n] = min(through[n], 0.1 * step)
            if max(through) < math.inf:
                break
    return through, least


def main() -> None:
    """Print a table, a row a radio; inf: it still stood at its line after 90 s."""
    columns = [*(f"{arm}, s" for arm in ARMS), "over the junction", "least distance, m"]
    print(f"| radio | {' | '.join(columns)} |")
    print("|---|" + "---:|" * len(columns))
    for name, radio in RADIOS.items():
        times, least_m = run(radio)
        cells = [*(f"{t:.1f}" for t in times), str(sum(t < math.inf for t in times))]
        print(f"| {name} | {' | '.join(cells)} | {least_m:.3f} |", flush=True)


if __name__ == "__main__":
    main()
