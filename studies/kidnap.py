"""A car that parks by its own sensors is lifted and put down elsewhere: does it find its place?

It drives as in `parking.py`, under the same perturbations, and is put at a random free place of the
room, with any heading. Nothing says so: its wheels do not turn meanwhile, its gyro feels nothing,
and scans go on. Needs a clone of the repository as the working directory.
"""

import math
from collections.abc import Sequence

import numpy as np

from scm.clock import NS_PER_S
from scm.errors import PathError
from scm.geometry import Pose2
from scm.maps.route import roads_of
from scm.records.city_map import CityMap
from scm.runtime.part import Subscription
from scm.study.case import Case
from scm.v2x.messages.contact import Contact
from scm.vehicles.car import load_car, varied_cars
from scm.world.hosted import HostedCar
from scm.world.part import WorldPart
from studies.parking import (
    CAR,
    GOAL_M,
    GOAL_RAD,
    KNOWN_STD,
    RANGE_STD_M,
    START_ROOM_M,
    STEP_S,
    TRIES,
    VEHICLE,
    Noisy,
    as_text,
    perturbed,
)
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.hybrid_astar import plan
from vehicle_agent.autonomy.outline import outline_clearance, scene_of
from vehicle_agent.autonomy.part import ParkPart, Wanted
from vehicle_agent.autonomy.plan import CarLimits, limits_of
from vehicle_agent.autonomy.response import response_of

MAP = "parking_school_obstacles"
DRIVES_S = (0.5, 5.0)  # until the car is lifted
STAYS_S, SOON_S = 5.0, 5.0  # a pose must stay right; to be found again
LASTS_S = 90.0  # after that
APART_M = 0.3  # at least, of a new place from the old one; of a start from the goal
Step = tuple[bool, bool, float]
"""Whether the agent drives by a pose, whether that is right, and how far the car moved [m]."""


def run(case: Case, perturbation: float = 1.0, goal: str = "goal") -> dict[str, float]:
    """Return how soon the agent knows again where the car is, and whether it parks.

    Args:
        case: The case.
        perturbation: By how much the paper's perturbations are scaled.
        goal: Place to park at.
    """
    rng, model = case.generator("kidnap"), load_car(CAR)
    limits = response_of(model).limited(limits_of(model))
    target = roads_of(case.map).spawn_pose(goal)
    room = perturbed(case.map, perturbation, rng)
    start = _free_place(room, limits, target, target, rng)
    known = Pose2(*(np.array(start) + KNOWN_STD * rng.standard_normal(3)).tolist())
    wanted = Wanted(VEHICLE, goal=as_text(target), start=as_text(known), seed=case.seed)
    agent = ParkPart("park", wanted, city_map=case.map)
    with varied_cars({CAR: model.with_values({"lidar.noise_m": perturbation * RANGE_STD_M})}):
        world = WorldPart(room, case.seed)
        with case.lockstep([world, Noisy(agent, perturbation, rng)]) as city:
            car = world.world.host(VEHICLE, CAR, start, 0)
            until_ns = rng.uniform(*DRIVES_S) * NS_PER_S
            while city.now_ns < until_ns and math.dist(car.pose[:2], target[:2]) > APART_M:
                city.run_for(STEP_S)
            contacts = city.subscribe(Subscription(Contact, {"vehicle": VEHICLE}))
            put(car, _free_place(room, limits, target, car.pose, rng))
            steps, touched = list[Step](), False
            while len(steps) * STEP_S < LASTS_S and not agent.is_over and not touched:
                before = car.pose
                city.run_for(STEP_S)
                touched = bool(contacts.drain())
                way_m = math.dist(before[:2], car.pose[:2])
                steps.append((*_belief(agent, car.pose), way_m))
    state = agent.parking.report.state if agent.parking is not None else "none"
    return {
        **measures(steps),
        "touched": float(touched),
        "parked": float(state == "parked" and _is_at(target, car.pose) and not touched),
        "parked_elsewhere": float(state == "parked" and not _is_at(target, car.pose)),
        "gave_up": float(state == "failed"),
        "time_s": len(steps) * STEP_S,
    }


def _free_place(
    room: CityMap, limits: CarLimits, goal: Pose2, other: Pose2, rng: np.random.Generator
) -> Pose2:
    """Return a place, not near another one, from which the goal can be reached.

    Raises:
        PathError: when none is found.
    """
    grid, floor = grid_of_city(room), room.floor
    for _ in range(TRIES):
        pose = Pose2(
            float(rng.uniform(*floor.x_m)), float(rng.uniform(*floor.y_m)),
            float(rng.uniform(-math.pi, math.pi)),
        )  # fmt: skip
        is_far = math.dist(pose[:2], other[:2]) > APART_M
        if not is_far or outline_clearance(scene_of(grid, limits), pose) < START_ROOM_M:
            continue
        try:
            plan(grid, limits, pose, goal, margin_m=0.01)
        except PathError:
            continue
        return pose
    raise PathError(f"no place from which the goal can be reached in {TRIES} draws")


def put(car: HostedCar, pose: Pose2) -> None:
    """Put a car somewhere else, at rest; its wheels are turned as far as before."""
    turned = car.fleet.wheel_angle[car.row].copy()
    car.fleet.place(car.row, pose, keep_actuators=True)
    car.fleet.wheel_angle[car.row] = turned


def _belief(agent: ParkPart, pose: Pose2) -> tuple[bool, bool]:
    """Return whether the agent drives by a pose, and whether that is right."""
    here = None if agent.parking is None else agent.parking.perception.now()
    return here is not None and here.is_known, here is not None and _is_at(pose, here.pose)


def _is_at(pose: Pose2, other: Pose2) -> bool:
    off = pose.inverse() @ other
    return math.hypot(off.x, off.y) < GOAL_M and abs(off.yaw) < GOAL_RAD


def measures(steps: Sequence[Step]) -> dict[str, float]:
    """Return what an agent believed after its car was lifted, as measures."""
    known, right = (np.array([step[k] for step in steps], bool) for k in (0, 1))
    moved_m = np.array([step[2] for step in steps], float)
    found, stays = known & right, round(STAYS_S / STEP_S)
    first = next((k for k in np.flatnonzero(found) if found[k : k + stays].all()), None)
    recovered_s = math.nan if first is None else (first + 1) * STEP_S
    return {
        "recovered": float(recovered_s <= SOON_S),
        "recovered_s": recovered_s,
        "stood_s": float((~known).sum() * STEP_S),
        "wrong_s": float((known & ~right).sum() * STEP_S),
        "wrong_m": float(moved_m[known & ~right].sum()),
        "unknown_m": float(moved_m[~known].sum()),
    }
