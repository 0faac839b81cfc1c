"""How fast worlds of a training environment step, beside the bare physics and beside peers.

    python -m bench gym [--worlds 1024] [--resets 1000000]

A step is 50 ms, 50 substeps of the car with 14 degrees of freedom. highway-env and MetaDrive step
their own cars, where they are installed (`scm[bench]`): one world each.
"""

import argparse
import resource
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import scm.gym
from scm.gym.names import all_tasks

LAP = "driving_school/lap-v1"
LEAST, LEAST_WITH_RANGES, MOST_OF_PHYSICS, MOST_GROWTH = 200_000.0, 40_000.0, 1.5, 0.01
STEPS, TIMES, PEER_S = 100, 5, 5.0

Clock = Callable[[], float]


def fastest_s(step: Callable[[], Any], clock: Clock) -> float:
    """Return the time of a step, in the fastest of some runs."""
    for _ in range(STEPS):
        step()
    found = []
    for _ in range(TIMES):
        begun_s = clock()
        for _ in range(STEPS):
            step()
        found.append((clock() - begun_s) / STEPS)
    return min(found)


def ours(
    worlds: int, *more: str, threads: int | None = None, clock: Clock = time.perf_counter
) -> tuple[float, float]:
    """Return the time of a step of many worlds, and of their physics alone."""
    observations = *all_tasks()["lap"].observations, *more
    envs = scm.gym.make_vec(LAP, worlds, copy=False, threads=threads, observations=observations)
    envs.reset(seed=1)
    action = np.tile([0.3, 0.1], (worlds, 1))
    fleet = envs.worlds.fleet
    return fastest_s(lambda: envs.step(action), clock), fastest_s(
        lambda: fleet.advance(0.05), clock
    )


def growth(resets: int) -> float:
    """Return by how much this process grows from a tenth of some resets to all, as a share."""
    envs = scm.gym.make_vec(LAP, 1000, copy=False, randomise=1.0)
    sizes = []
    for k in range(resets // 1000):
        envs.reset(seed=k)
        if k + 1 in (max(resets // 10_000, 1), resets // 1000):
            sizes.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return sizes[-1] / sizes[0] - 1.0


def peers() -> dict[str, Callable[[], Any]]:
    """Return by name what makes one world of each peer that is installed."""
    found: dict[str, Callable[[], Any]] = {}
    try:
        import gymnasium
        import highway_env  # noqa: F401

        found["highway-env, highway-v0"] = lambda: gymnasium.make("highway-v0")
        found["highway-env, racetrack-v0"] = lambda: gymnasium.make("racetrack-v0")
    except ModuleNotFoundError:
        print("highway-env is not installed")
    try:
        from metadrive import MetaDriveEnv

        found["MetaDrive"] = lambda: MetaDriveEnv({"log_level": 50})
    except ModuleNotFoundError:
        print("MetaDrive is not installed")
    return found


def peer_rate(make: Callable[[], Any]) -> float:
    """Return the steps a second of one world of a peer, its resets included."""
    env = make()
    env.reset()
    env.action_space.seed(1)
    begun_s, steps = time.perf_counter(), 0
    while time.perf_counter() - begun_s < PEER_S:
        _, _, ended, over, _ = env.step(env.action_space.sample())
        steps += 1
        if ended or over:
            env.reset()
    env.close()
    return steps / (time.perf_counter() - begun_s)


def main() -> None:
    """Print a row a figure."""
    parser = argparse.ArgumentParser(prog="python -m bench gym", description=__doc__)
    parser.add_argument("--worlds", type=int, default=1024)
    parser.add_argument("--resets", type=int, default=1_000_000)
    given = parser.parse_args()
    step_s, physics_s = ours(given.worlds)
    rate = given.worlds / step_s
    print(
        f"{given.worlds} worlds: {rate:.0f} agent-steps/s, {rate / LEAST:.2f} of the bar of "
        f"{LEAST:.0f}; {step_s / physics_s:.2f} of the physics' time alone (bar "
        f"{MOST_OF_PHYSICS})"
    )
    step_s, physics_s = ours(given.worlds, threads=1, clock=time.process_time)
    print(f"on one thread: {step_s / physics_s:.2f} of the physics' processor time")
    with_ranges_s, _ = ours(given.worlds, "ranges")
    seen = given.worlds / with_ranges_s
    print(
        f"with 108 rays each: {seen:.0f} agent-steps/s, {seen / LEAST_WITH_RANGES:.2f} of the bar"
    )
    for count in (64, 256):
        with_camera_s, _ = ours(count, "camera")
        print(f"{count} worlds with the front camera: {count / with_camera_s:.0f} agent-steps/s")
    one_s, _ = ours(1, threads=1)
    print(f"one world: {1.0 / one_s:.0f} steps/s")
    for name, make in peers().items():
        try:
            peer = peer_rate(make)
        except OSError as error:  # MetaDrive fetches its assets when it is first started
            print(f"{name}: cannot be started here: {error}")
            continue
        print(f"{name}: {peer:.0f} steps/s; ours {rate / peer:.0f} times that")
    print(
        f"{given.resets} resets: the process grows by {100.0 * growth(given.resets):.2f} % "
        f"(bar {100.0 * MOST_GROWTH:.0f} %)"
    )


if __name__ == "__main__":
    main()
