"""LIDAR rays a second of one core, beside every beam against every face in the same run.

Run with `python -m bench lidar`. A town of blocks: a building of 1.2 m every 2 m, with cars in the
streets between, each with a scanner of 360 beams. Both see exactly the same (checked). "core" is
the share of one core that all cars scanning 7 times a second take.
"""

import math
import time

import numba
import numpy as np

from scm.arrays import Floats
from scm.vehicles.rays.cast import cast
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene

PITCH, BUILDING, CARS_A_BLOCK = 2.0, 1.2, 2.77
BEARINGS = (0.0, 2.0 * math.pi / 360, 360)
LENGTH, HALF_WIDTH = (-0.07, 0.23), 0.0875
RATE_HZ = 7.0
SIZES = (10, 100, 1000, 2000, 10000)
LONGEST_BRUTE_RAYS = 20_000


def town(cars: int, seed: int = 0) -> tuple[Scene, Floats]:
    """Return a scene with that many cars, and their scanners (cars, 3)."""
    rng = np.random.default_rng(seed)
    side = math.ceil(math.sqrt(cars / CARS_A_BLOCK))
    corner = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2) * PITCH
    walls = faces(corner + 0.5 * BUILDING, 0.0, (-0.5 * BUILDING, 0.5 * BUILDING), 0.5 * BUILDING)
    along = rng.uniform(0.0, side * PITCH, cars)
    across = rng.integers(0, side, cars) * PITCH + rng.uniform(1.35, 1.85, cars)
    upwards = rng.random(cars) < 0.5
    place = np.where(upwards[:, None], np.column_stack((across, along)),
                     np.column_stack((along, across)))  # fmt: skip
    yaw = np.where(upwards, 0.5 * math.pi, 0.0) + rng.normal(0.0, 0.1, cars)
    scanners = np.column_stack((place[:, 0] + 0.1445 * np.cos(yaw),
                                place[:, 1] + 0.1445 * np.sin(yaw), yaw))  # fmt: skip
    outlines = faces(place, yaw, LENGTH, HALF_WIDTH)
    return Scene(WallGrid(walls), outlines, np.arange(cars)), scanners


def faces(places: Floats, yaw: Floats | float, along: tuple[float, float], half: float) -> Floats:
    """Return the four faces of each box, counter-clockwise, (4 n, 4)."""
    u, v = np.array([along[0], along[1], along[1], along[0]]), np.array([-half, -half, half, half])
    c, s = np.broadcast_arrays(np.cos(yaw), np.sin(yaw), places[:, 0])[:2]
    x = places[:, :1] + c[:, None] * u - s[:, None] * v
    y = places[:, 1:] + s[:, None] * u + c[:, None] * v
    corners = np.stack((x, y), axis=2)
    return np.concatenate((corners, np.roll(corners, -1, axis=1)), axis=2).reshape(-1, 4)


@numba.njit(error_model="numpy")
def brute_force(ranges, scanners, own, bearings, edges, owners, farthest):
    first, step, beams = bearings
    for k in range(len(scanners)):
        x, y, yaw = scanners[k]
        for b in range(beams):
            ux, uy = math.cos(yaw + first + b * step), math.sin(yaw + first + b * step)
            nearest = np.inf
            for m in range(len(edges)):
                ax, ay = edges[m, 0] - x, edges[m, 1] - y
                dx, dy = edges[m, 2] - edges[m, 0], edges[m, 3] - edges[m, 1]
                across = ux * dy - uy * dx
                share = (ax * uy - ay * ux) / across
                distance = (ax * dy - ay * dx) / across
                met = (share >= 0.0) & (share <= 1.0) & (distance > 0.0) & (owners[m] != own[k])
                nearest = min(nearest, distance) if met else nearest
            ranges[k, b] = nearest if nearest <= farthest else np.inf


def measure(cars: int, farthest: float) -> tuple[float, float]:
    """Return rays a second by the kernel and by brute force."""
    scene, scanners = town(cars)
    own = np.arange(cars)
    cast(scene, scanners[:1], own[:1], BEARINGS, farthest)
    batch = min(cars, 200)  # as a tick sees them: a share of all cars, the whole scene
    spent, rays, begin = [], 0, 0
    while sum(spent) < 0.6 or begin < cars:
        some = np.arange(begin, begin + batch) % cars
        start = time.process_time()
        seen = cast(scene, scanners[some], some, BEARINGS, farthest)
        spent.append(time.process_time() - start)
        rays, begin = rays + seen.size, begin + batch
    few = np.arange(max(1, min(cars, LONGEST_BRUTE_RAYS // (BEARINGS[2] * max(1, cars // 100)))))
    edges = np.concatenate((scene.walls.edges, scene.outlines))
    owners = np.concatenate((np.full(len(scene.walls.edges), -1), np.repeat(scene.owners, 4)))
    expected = np.empty((len(few), BEARINGS[2]))
    how = (expected, scanners[few], few, BEARINGS, edges, owners, farthest)
    brute_force(*how)
    start = time.process_time()
    brute_force(*how)
    slow = expected.size / (time.process_time() - start)
    np.testing.assert_allclose(
        cast(scene, scanners[few], few, BEARINGS, farthest), expected, atol=1e-9, rtol=0.0
    )
    return rays / sum(spent), slow


def main() -> None:
    """Print the table."""
    print("reach   cars   rays/s   brute force   ratio   core")
    for farthest in (4.0, 12.0):
        for cars in SIZES:
            fast, slow = measure(cars, farthest)
            core = cars * RATE_HZ * BEARINGS[2] / fast
            print(f"{farthest:4.0f} m {cars:6d} {fast / 1e6:6.1f} M {slow / 1e6:9.2f} M"
                  f" {fast / slow:9.1f} {100 * core:6.1f} %", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
