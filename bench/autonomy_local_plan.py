"""Milliseconds a replan of the elastic band, beside Ipopt on the same problem in the same run.

Run with `python -m bench autonomy_local_plan`. A car drives along a path and replans ten times a
second from where its last trajectory said it would be; time is that of one core. "refused" counts
trajectories that were not free, or outside the car's limits.

Ipopt (with casadi, where installed) gets the first plan of each problem: the same states and
preferences, but limits and equations as constraints that hold exactly. It begins from the band's
result: so both pass obstacles on the same side, the difference in cost is what the band left, and
Ipopt's time is a lower bound. Problems with boxes are left out: the grid is not smooth enough for
it.

Then the band beside model predictive path integral control (MPPI): each car is where its last plan
has it, but it stands where the navigator would stop it. And what the rollouts cost: cars of
`nigel.toml` on random commands, by horizon and substep, and how far they are off those of 1 ms.
"""

import importlib.util
import math
import time
from dataclasses import dataclass

import numpy as np

from scm.geometry import Pose2
from scm.vehicles.car import load_car
from vehicle_agent.autonomy import band_solver as solver
from vehicle_agent.autonomy import elastic_band
from vehicle_agent.autonomy.elastic_band import ElasticBand
from vehicle_agent.autonomy.grid_map import FREE, OCCUPIED, grid_of_cells
from vehicle_agent.autonomy.moving import comes_near
from vehicle_agent.autonomy.mppi import STEP_S, ModelCars, PathIntegral
from vehicle_agent.autonomy.navigation import LOOK_AHEAD_S, STOP_M
from vehicle_agent.autonomy.outline import outline_clearance, room, scene_of
from vehicle_agent.autonomy.plan import Path, limits_of
from vehicle_agent.autonomy.response import response_of
from vehicle_agent.autonomy.trajectory_check import is_free

NIGEL = load_car("nigel")
CAR, RESPONSE = limits_of(NIGEL), response_of(NIGEL)
BEND = 1.0 / 0.26
REPLAN_S, LONGEST_S = 0.1, 30.0
RUNS = 3
NOTHING = np.empty((0, 5))


@dataclass(frozen=True)
class Problem:
    """A path of (length, curvature) from a start, boxes, and moving obstacles."""

    start: Pose2
    parts: tuple
    boxes: tuple = ()
    moving: tuple = ()


PROBLEMS = {
    "straight": Problem(Pose2(0.5, 1.5, 0.0), ((1.2, 0.0),)),
    "curves": Problem(Pose2(0.5, 1.5, 0.0), ((0.3, 0.0), (0.4, BEND), (0.3, 0.0), (0.4, -BEND))),
    "two cusps": Problem(
        Pose2(0.5, 1.5, 0.0), ((0.5, 0.0), (0.3, BEND), (-0.35, -BEND), (0.4, 0.0))
    ),
    "reverse into a gap": Problem(
        Pose2(2.2, 0.96, 0.0), ((-0.3, 0.0), (-0.22, -BEND), (-0.22, BEND), (-0.05, 0.0)),
        boxes=((0.5, 0.4, 3.0, 0.55), (0.9, 0.55, 1.2, 0.84), (2.0, 0.55, 2.3, 0.84)),
    ),
    "box on the path": Problem(
        Pose2(0.5, 1.5, 0.0), ((1.6, 0.0),), boxes=((1.3, 1.4, 1.45, 1.55),)
    ),
    "crossing obstacle": Problem(
        Pose2(0.5, 1.5, 0.0), ((1.6, 0.0),), moving=((1.2, 2.1, 0.0, -0.17, 0.1),)
    ),
    "oncoming, between walls": Problem(
        Pose2(0.5, 1.35, 0.0), ((1.8, 0.0),), moving=((2.6, 1.35, -0.15, 0.0, 0.1),),
        boxes=((0.3, 1.9, 3.5, 2.0), (0.3, 1.0, 3.5, 1.1)),
    ),
}  # fmt: skip


def path_of(problem: Problem) -> Path:
    poses, rows = [problem.start], []
    for length, bend in problem.parts:
        count = round(abs(length) / 0.02)
        step, arc = length / count, np.sinc(length / count * bend / math.tau)
        for _ in range(count):
            x, y, yaw = poses[-1]
            middle = yaw + 0.5 * step * bend
            x, y = x + step * arc * math.cos(middle), y + step * arc * math.sin(middle)
            poses.append(Pose2(x, y, yaw + step * bend))
            rows.append((math.copysign(1.0, length), bend))
    gears, curvatures = np.array([rows[0], *rows]).T
    return Path(np.array(poses), gears.copy(), curvatures.copy())


def grid_of(problem: Problem):
    cells = np.full((300, 400), FREE, np.int8)
    for left, low, right, high in problem.boxes:
        cells[round(100 * low) : round(100 * high), round(100 * left) : round(100 * right)] = (
            OCCUPIED
        )
    return grid_of_cells(cells, 0.01, 0.0, 0.0)


def at(trajectory, t: float):
    """Return pose, speed and steering at a time, between states linearly."""
    columns = (*trajectory.poses.T, trajectory.speeds_mps, trajectory.steering_rad)
    x, y, yaw, speed, steering = (float(np.interp(t, trajectory.times_s, one)) for one in columns)
    return Pose2(x, y, yaw), speed, steering


def drive(problem: Problem):
    """Return times of the first plan and of the later ones [s], when it arrived, and refusals."""
    grid, path, band = grid_of(problem), path_of(problem), ElasticBand(CAR)
    moving = np.array(problem.moving).reshape(-1, 5)
    state, t, spent, refused = (problem.start, 0.0, 0.0), 0.0, [], 0
    while t < LONGEST_S:
        now = moving.copy()
        now[:, :2] += t * now[:, 2:4]
        begin = time.process_time()
        trajectory = band.plan(grid, path, *state, now, t)
        spent.append(time.process_time() - begin)
        refused += not is_free(grid, CAR, trajectory, now)
        if trajectory.times_s[-1] < REPLAN_S and math.dist(state[0][:2], path.poses[-1, :2]) < 0.02:
            break
        state, t = at(trajectory, REPLAN_S), t + REPLAN_S
    return spent[0], spent[1:], t, refused


def first_plan(problem: Problem):
    """Return the states of the first plan, and the arguments that the optimiser got with them."""
    calls, optimise = [], elastic_band.optimise

    def recorded(*given):
        calls.append((optimise(*given), given))
        return calls[-1][0]

    elastic_band.optimise = recorded
    try:
        trajectory = ElasticBand(CAR).plan(
            grid_of(problem), path_of(problem), problem.start, 0.0, 0.0,
            np.array(problem.moving).reshape(-1, 5), 0.0,
        )  # fmt: skip
    finally:
        elastic_band.optimise = optimise
    for (states, _), given in calls:
        if np.array_equal(states[:, :3], trajectory.poses):
            return states, given
    raise AssertionError("no call gave the trajectory")


def by_ipopt(states, gears, held, reference, terms):
    """Return Ipopt's states for a band's problem, and the seconds that it took, from its states."""
    import casadi

    optimiser = casadi.Opti()
    z = optimiser.variable(len(states), solver.STATES)
    x, y, yaw, speed, steering, t = (z[:, p] for p in range(solver.STATES))
    cost = 0.0
    for i, gear in enumerate(gears):
        j, dt = i + 1, t[i + 1] - t[i]
        way, turn = 0.5 * (speed[i] + speed[j]) * dt, yaw[j] - yaw[i]
        mean, chord = 0.5 * (yaw[i] + yaw[j]), way * (1.0 - turn**2 / 24.0)
        bend = casadi.tan(0.5 * (steering[i] + steering[j])) / terms.wheelbase_m
        optimiser.subject_to(x[j] - x[i] == chord * casadi.cos(mean))
        optimiser.subject_to(y[j] - y[i] == chord * casadi.sin(mean))
        optimiser.subject_to(turn == way * bend)
        optimiser.subject_to(dt >= solver.LEAST_S)
        for value, most in ((speed, terms.accel_mps2), (steering, terms.rate_radps)):
            optimiser.subject_to(optimiser.bounded(-most * dt, value[j] - value[i], most * dt))
        if not held[j, solver.SPEED]:
            most = terms.reverse_mps if gear < 0 else terms.speed_mps
            optimiser.subject_to(optimiser.bounded(0.0, int(gear) * speed[j], most))
        optimiser.subject_to(
            optimiser.bounded(-terms.steering_rad, steering[j], terms.steering_rad)
        )
        cost += (solver.REVERSE if gear < 0 else 1.0) * dt
        if gear != 0:
            cost += ((steering[j] - steering[i]) / solver.SERVO_RAD) ** 2
        if gear != 0 and j < len(gears) and gears[j] != 0:
            cost += ((t[i] - 2.0 * t[j] + t[j + 1]) / solver.SPACING_S) ** 2
        cos, sin = math.cos(reference[j, 2]), math.sin(reference[j, 2])
        cost += (
            (cos * (y[j] - reference[j, 1]) - sin * (x[j] - reference[j, 0])) / solver.PATH_M
        ) ** 2
        for (ahead, beside), (px, py, vx, vy, radius) in (
            (disc, one) for disc in terms.discs_m for one in terms.moving
        ):
            dx = x[j] + ahead * casadi.cos(yaw[j]) - beside * casadi.sin(yaw[j]) - px - vx * t[j]
            dy = y[j] + ahead * casadi.sin(yaw[j]) + beside * casadi.cos(yaw[j]) - py - vy * t[j]
            lack = terms.room_m + radius - casadi.sqrt(dx**2 + dy**2 + 1e-9)
            cost += (casadi.fmax(lack, 0.0) / solver.CLEARANCE_M) ** 2
    for p in range(3):
        cost += ((z[-1, p] - terms.end[p]) / terms.end[3 + p // 2]) ** 2
    for i, p in zip(*np.nonzero(held), strict=True):
        optimiser.subject_to(z[int(i), int(p)] == float(states[i, p]))
    optimiser.minimize(cost)
    optimiser.set_initial(z, states)
    optimiser.solver(
        "ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes", "max_iter": 500}
    )
    start = time.process_time()
    solved = optimiser.solve()
    return solved.value(z), time.process_time() - start


def compared(problem: Problem) -> str:
    """Return cost, duration and time of the band's first plan, and of Ipopt's, in words."""
    if not importlib.util.find_spec("casadi"):
        return "casadi is not installed"
    if problem.boxes:
        return "-"
    own, (_, *given, _) = first_plan(problem)
    others, seconds = by_ipopt(own, *given)
    costs = [solver.optimise(states, *given, 0)[1] for states in (own, others)]
    durations = own[-1, solver.TIME], others[-1, solver.TIME]
    return (f"{costs[0]:6.2f} {durations[0]:6.2f} s   {costs[1]:6.2f} {durations[1]:6.2f} s"
            f" {1e3 * seconds:6.0f} ms")  # fmt: skip


def followed(problem: Problem, local) -> tuple:
    """Return times of plans [s], arrival [s], plans that stopped the car, least clearance [m]."""
    grid, path, scene = grid_of(problem), path_of(problem), scene_of(grid_of(problem), CAR)
    moving = np.array(problem.moving).reshape(-1, 5)
    state, t, spent, stops, least = (problem.start, 0.0, 0.0), 0.0, [], 0, math.inf
    while t < LONGEST_S:
        now = moving.copy()
        now[:, :2] += t * now[:, 2:4]
        begin = time.process_time()
        way = local.plan(grid, path, *state, now, t)
        spent.append(time.process_time() - begin)
        least = min(least, outline_clearance(scene, state[0]), *(gap(state[0], one) for one in now))
        is_over = way.times_s[-1] < REPLAN_S or abs(state[1]) < 0.02
        if is_over and math.dist(state[0][:2], path.poses[-1, :2]) < 0.02:
            break
        soon = way.times_s <= LOOK_AHEAD_S
        poses, when = way.poses[soon], way.times_s[soon]
        stops_now = comes_near(poses, when, now, CAR) or np.isinf(room(scene, poses, STOP_M)).any()
        stops += bool(stops_now)
        state = (state[0], 0.0, state[2]) if stops_now else at(way, REPLAN_S)
        t += REPLAN_S
    return spent, t, stops, least


def gap(pose: Pose2, disc) -> float:
    """Return how far the outline is from a moving disc [m]."""
    ahead, beside = pose.inverse().apply(disc[0], disc[1])
    beyond = max(CAR.rear_m - ahead, 0.0, ahead - CAR.front_m)
    return math.hypot(beyond, max(CAR.right_m - beside, 0.0, beside - CAR.left_m)) - disc[4]


def compare_planners() -> None:
    """Print the band beside MPPI."""
    print(f"\n{'problem':24} {'planner':7} median   p99 ms   arrived s   stops   clearance mm")
    planners = {
        "band": lambda: ElasticBand(CAR, margin_m=0.04),
        "MPPI": lambda: PathIntegral(NIGEL, CAR, RESPONSE),
    }
    for name, problem in PROBLEMS.items():
        for kind, made in planners.items():
            spent, t, stops, least = followed(problem, made())
            middle, high = np.percentile(1e3 * np.array(spent[1:]), (50, 99))
            arrived = f"{t:9.1f}" if t < LONGEST_S else "    never"
            print(f"{name:24} {kind:7} {middle:6.1f} {high:7.1f} {arrived} {stops:9d}"
                  f" {1e3 * least:12.0f}", flush=True)  # fmt: skip


def time_rollouts() -> None:
    """Print what rollouts cost."""
    rng, exact = np.random.default_rng(0), {}
    print("\ncars   horizon s   substep ms   ms    rollouts a second   off 1 ms: median, most mm")
    for cars, horizon, substep in ((127, 4.0, 0.001), (127, 4.0, 0.005), (127, 4.0, 0.01),
                                   (127, 4.0, 0.02), (511, 1.5, 0.01), (1023, 1.5, 0.01),
                                   (511, 4.0, 0.01)):  # fmt: skip
        shape = (round(horizon / STEP_S), cars)
        steady = rng.uniform(-0.7, 0.7, (1, cars)) + 0.1 * rng.standard_normal(shape)
        commands = np.stack((steady, 0.5 * rng.standard_normal(shape)), axis=2)
        model, spent = ModelCars(NIGEL, cars, substep), []
        for _ in range(5):
            model.begin(Pose2(0.0, 0.0, 0.0), 0.1, 0.0, 0.0)
            begin = time.process_time()
            states, _ = model.drive(commands)
            spent.append(time.process_time() - begin)
        error = ""
        if (cars, horizon) == (127, 4.0):
            exact.setdefault("commands", commands), exact.setdefault("states", states)
            states, _ = model.drive(exact["commands"])
            off = 1e3 * np.hypot(*(states - exact["states"])[:, :2].swapaxes(0, 1))
            error = f"{np.median(off):10.2f} {off.max():6.2f}"
        took = float(np.median(spent))
        print(f"{cars:4d} {horizon:10.1f} {1e3 * substep:12.0f} {1e3 * took:7.1f}"
              f" {cars / took:12.0f} {error}", flush=True)  # fmt: skip


def main() -> None:
    """Print the tables."""
    drive(PROBLEMS["crossing obstacle"])  # compiles
    print(f"{'':24} first   replan ms      arrived         band: cost       Ipopt: cost")
    print(
        f"{'problem':24}    ms median   p99       s refused      duration          duration   time"
    )
    for name, problem in PROBLEMS.items():
        runs = [drive(problem) for _ in range(RUNS)]
        first = 1e3 * np.median([run[0] for run in runs])
        later = 1e3 * np.concatenate([run[1] for run in runs])
        print(f"{name:24} {first:5.1f} {np.median(later):6.2f} {np.percentile(later, 99):5.1f}"
              f" {runs[0][2]:7.1f} {runs[0][3]:7d} {compared(problem)}", flush=True)  # fmt: skip
    compare_planners()
    time_rollouts()


if __name__ == "__main__":
    main()
