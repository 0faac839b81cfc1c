"""Times of the stages of parking on one core, each beside its limit, and rays beside range_libc's.

Run with `python -m bench autonomy_times`. All in Parking School: a sweep of 360 beams is matched
to faces, `PARTICLES` are weighed by 60 beams, paths lead from anywhere to the goal, the elastic
band is replanned ten times a second on the way, and a whole agent parks in lockstep. Times are
those that the process spent, so other load changes them little.
"""

import math
import time
from collections.abc import Callable

import numpy as np

from bench import autonomy_local_plan, autonomy_plan
from bench.autonomy_mapping import BEARINGS, MOUNT, REACH_M, Lap, drive
from scm.arrays import Floats
from scm.geometry import TAU, Pose2
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.maps.segments import wall_segments
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.vehicles.car import load_car
from scm.vehicles.rays.cast import cast
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from scm.world.part import WorldPart
from vehicle_agent.autonomy import hybrid_astar
from vehicle_agent.autonomy.faces import field_of
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.outline import scene_of
from vehicle_agent.autonomy.parking import prepare
from vehicle_agent.autonomy.part import ParkPart, Wanted
from vehicle_agent.autonomy.particle_filter import MOST, ParticleFilter
from vehicle_agent.autonomy.plan import limits_of
from vehicle_agent.autonomy.scan_match import match
from vehicle_agent.autonomy.sweep import Twist, deskewed

MAP, CAR, NOISE_M = "parking_school", "nigel", 0.025
REPEATS, PARTICLES = 200, 1000
SCANNERS = 500  # rays from so many places
LONGEST_S = 60.0
RAYS_PUBLISHED = {
    "numba, F1TENTH Gym": 17.4e6,
    "Bresenham": 3.9e6,
    "ray marching": 25.4e6,
    "CDDT": 56.2e6,
    "giant lookup table": 159.5e6,
}
"""Rays a second of one core of a Ryzen 7950X, 1 080 beams a scan, by a user of range_libc in 2026;
its authors state 6.1 M for CDDT on a Jetson TX1 (Walsh, Karaman, ICRA 2018)."""


def spent_ms(work: Callable[[], object]) -> float:
    """Return the time that a piece of work took this process [ms]."""
    begin = time.process_time()
    work()
    return 1e3 * (time.process_time() - begin)


def sweeps(count: int) -> list[tuple[Pose2, Floats]]:
    """Return true poses and echoes (m, 2), car frame, along a drive; a sweep each."""
    walls = wall_segments(load_map(MAP))
    found = drive(walls, Lap(), NOISE_M, count / 7.0)
    return [(pose, deskewed(sweep, MOUNT, Twist())) for pose, sweep in found]


def matches() -> Floats:
    """Return times of matching a sweep to faces, from 3 cm and 0.05 rad beside [ms]."""
    field, off = field_of(wall_segments(load_map(MAP))), Pose2(0.03, -0.02, 0.05)
    return np.array([
        spent_ms(lambda at=pose @ off, echoes=echoes: match(echoes, field, at))
        for pose, echoes in sweeps(REPEATS)
    ])  # fmt: skip


def filters() -> Floats:
    """Return times of one update of the particle filter, a `PARTICLES` [ms]."""
    particles, still = ParticleFilter(grid_of_city(load_map(MAP)), NOISE_M), Pose2(0.0, 0.0, 0.0)
    times = []
    for pose, echoes in sweeps(REPEATS):
        particles.begin(pose)  # with MOST of them
        times.append(spent_ms(lambda seen=echoes: particles.update(still, seen)))
    return np.array(times) * PARTICLES / MOST


def paths() -> Floats:
    """Return times of Hybrid A* from anywhere to the goal [ms]."""
    city_map, limits = load_map(MAP), limits_of(load_car(CAR))
    grid = grid_of_city(city_map)
    goal = roads_of(city_map).spawn_pose("goal")
    pairs = autonomy_plan.problems(grid, scene_of(grid, limits), REPEATS)
    return np.array([
        spent_ms(lambda at=start: hybrid_astar.plan(grid, limits, at, goal, margin_m=0.02))
        for start, _ in pairs
    ])  # fmt: skip


def bands() -> Floats:
    """Return times of replanning the elastic band on all problems of its own bench [ms]."""
    problems = autonomy_local_plan.PROBLEMS.values()
    return 1e3 * np.concatenate([autonomy_local_plan.drive(one)[1] for one in problems])


def agents() -> float:
    """Return the share of a core that a whole agent takes while it parks."""
    world = WorldPart(load_map(MAP), 0)
    agent = ParkPart("park", Wanted("n1", goal="goal", start="start"))
    with Lockstep([world, agent]) as city:
        reports = city.subscribe(Subscription(AutonomyStatus, {"vehicle": "n1"}))
        world.world.host("n1", CAR, roads_of(load_map(MAP)).spawn_pose("start"), 0)
        shares = []
        while city.now_ns < LONGEST_S * 1e9 and not agent.is_over:
            city.run_for(0.2)
            shares += [one.message.compute_share for one in reports.drain()]
    return float(np.mean([share for share in shares if share > 0.0]))


def rays() -> float:
    """Return rays a second: 360 beams from each of many places."""
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-0.7, 0.7, (2, SCANNERS))
    scanners = np.column_stack((x, 0.5 * y, rng.uniform(-math.pi, math.pi, SCANNERS)))
    scene = Scene(WallGrid(wall_segments(load_map(MAP))), np.zeros((0, 4)), np.zeros(0, np.int64))
    nobody = np.full(SCANNERS, -1)

    def look() -> None:
        cast(scene, scanners, nobody, (0.0, TAU / len(BEARINGS), len(BEARINGS)), REACH_M)

    look()
    spent = min(spent_ms(look) for _ in range(10))
    return 1e3 * SCANNERS * len(BEARINGS) / spent


def main() -> None:
    """Print the tables."""
    prepare(load_car(CAR))
    match(sweeps(1)[0][1], field_of(wall_segments(load_map(MAP))), Pose2(0.0, 0.0, 0.0))
    print(f"{'':52} median     p99   limit")
    rows = (
        ("match of 360 points to faces", matches(), "5 ms"),
        (f"filter, {PARTICLES} particles x 60 beams", filters(), "4 ms"),
        ("Hybrid A* to the goal", paths(), "50 ms median, 200 ms p99"),
        ("elastic band, replanned", bands(), "25 ms"),
    )
    for name, times_ms, limit in rows:
        print(f"{name:48} {np.median(times_ms):7.2f} ms {np.percentile(times_ms, 99):5.1f} ms"
              f"   {limit}", flush=True)  # fmt: skip
    print(f"{'whole agent while it parks':48} {100 * agents():7.1f} % of a core   35 %")
    ours = rays()
    print(f"\nrays a second: {ours / 1e6:.1f} M, by exact faces instead of cells")
    for name, published in RAYS_PUBLISHED.items():
        print(f"  {name:24} {published / 1e6:6.1f} M published: ours {ours / published:5.1f} x")


if __name__ == "__main__":
    main()
