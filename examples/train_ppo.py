"""Train a car to drive a task by proximal policy optimisation, on many worlds at once.

    python examples/train_ppo.py driving_school/lap-v1 --out lap.onnx

Needs scm[gym,learn]. One small network acts, one says what is to be gained; both see observations
over their usual size. Agents of one world share them, and learn nothing while they are out.
Source: Schulman et al., "Proximal policy optimization algorithms", 2017.
"""

import argparse
import time
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

import scm.gym
from scm.gym.policy_file import write_policy

HIDDEN, AGENTS, STEPS = 64, 512, 64
ROUNDS, BATCHES = 4, 8  # over what was driven, and pieces of it
DISCOUNT, TRACE, CLIP, RATE, ENTROPY = 0.99, 0.95, 0.2, 1e-3, 1e-3


class Usual:
    """Mean and spread of the observations so far."""

    def __init__(self, columns: int) -> None:
        self.count, self.mean, self.square = 1e-4, np.zeros(columns), np.ones(columns)

    def add(self, seen: np.ndarray) -> None:
        """Add observations (n, columns)."""
        share = len(seen) / (self.count + len(seen))
        self.mean += share * (seen.mean(axis=0) - self.mean)
        self.square += share * ((seen**2).mean(axis=0) - self.square)
        self.count += len(seen)

    def of(self, seen: np.ndarray) -> np.ndarray:
        """Return observations less their mean, over their spread."""
        return np.clip((seen - self.mean) / self.spread, -10.0, 10.0).astype(np.float32)

    @property
    def spread(self) -> np.ndarray:
        """Their standard deviation, or a little where they hardly differ."""
        return np.sqrt(np.maximum(self.square - self.mean**2, 1e-4))


class Driven(NamedTuple):
    """What was seen, done and gained, each (steps, agents, ...)."""

    seen: np.ndarray
    action: np.ndarray
    likelihood: np.ndarray
    gain: np.ndarray
    value: np.ndarray
    present: np.ndarray


def layers(key: jax.Array, *sizes: int) -> list[tuple[jax.Array, jax.Array]]:
    """Return the weights of a network; its last layer begins near zero."""
    draw, pairs = jax.nn.initializers.orthogonal(np.sqrt(2.0)), list(pairwise(sizes))
    keys = jax.random.split(key, len(pairs))
    made = [(draw(own, pair), jnp.zeros(pair[1])) for own, pair in zip(keys, pairs, strict=True)]
    return [*made[:-1], (0.01 * made[-1][0], made[-1][1])]


def run(network: list[tuple[jax.Array, jax.Array]], seen: jax.Array) -> jax.Array:
    """Return a network's outputs."""
    for weights, bias in network[:-1]:
        seen = jnp.tanh(seen @ weights + bias)
    weights, bias = network[-1]
    return seen @ weights + bias


@jax.jit
def act(params: dict, seen: jax.Array, key: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Return drawn actions, their log-likelihood, and the values of what was seen."""
    mean, spread = run(params["actor"], seen), jnp.exp(params["spread"])
    action = mean + spread * jax.random.normal(key, mean.shape)
    return action, likelihood(mean, params["spread"], action), run(params["critic"], seen)[:, 0]


def likelihood(mean: jax.Array, log_spread: jax.Array, action: jax.Array) -> jax.Array:
    """Return the log-likelihood of actions (n, 2), but for a constant."""
    return (-0.5 * ((action - mean) / jnp.exp(log_spread)) ** 2 - log_spread).sum(axis=-1)


def loss(params: dict, part: tuple[jax.Array, ...]) -> jax.Array:
    """Return what is to be made small, for a piece of what was driven."""
    seen, action, before, gain, target, present = part
    ratio = jnp.exp(likelihood(run(params["actor"], seen), params["spread"], action) - before)
    better = jnp.minimum(ratio * gain, jnp.clip(ratio, 1.0 - CLIP, 1.0 + CLIP) * gain)
    off = 0.5 * (run(params["critic"], seen)[:, 0] - target) ** 2
    mean = ((off - better) * present).sum() / present.sum()
    return mean - ENTROPY * params["spread"].sum()


def learner(rate: float) -> tuple:
    """Return the optimiser and a compiled step of it."""
    optimiser = optax.chain(optax.clip_by_global_norm(0.5), optax.adam(rate))

    @jax.jit
    def learn(params: dict, state: tuple, part: tuple) -> tuple[dict, tuple]:
        gradient = jax.grad(loss)(params, part)
        change, state = optimiser.update(gradient, state)
        return optax.apply_updates(params, change), state

    return optimiser, learn


def advantages(driven: Driven, ended: np.ndarray, over: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return how much more than expected was gained from each step on."""
    found, trace = np.zeros_like(driven.gain), np.zeros(driven.gain.shape[1])
    for t in range(STEPS - 1, -1, -1):
        ahead = last if t == STEPS - 1 else driven.value[t + 1]
        off = driven.gain[t] + DISCOUNT * ahead * ~ended[t] - driven.value[t]
        trace = off + DISCOUNT * TRACE * trace * ~(ended[t] | over[t])
        found[t] = trace
    return found


def arguments() -> argparse.Namespace:
    """Return what was given on the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("task", nargs="?", default="driving_school/lap-v1")
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--steps", type=float, default=np.inf, help="of all agents, at most")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--action", default="throttle_steering", help="or speed_curvature")
    parser.add_argument("--car", help="car file, such as one that scm mismatch found")
    parser.add_argument("--randomise", type=float, default=0.0, help="its numbers, so many stds")
    words = ("KEY", "LOW", "HIGH")
    parser.add_argument("--range", nargs=3, action="append", default=[], metavar=words)
    parser.add_argument("--out", type=Path, default=Path("policy.onnx"))
    return parser.parse_args()


def main() -> None:
    """Train, print what is gained, and write the network."""
    given = arguments()
    ranges = {key: (float(low), float(high)) for key, low, high in given.range}
    envs = scm.gym.make_vec(
        given.task, AGENTS, copy=False, action=given.action, car=given.car,
        randomise=given.randomise, ranges=ranges,
    )  # fmt: skip
    reach = envs.single_action_space.high
    columns = envs.single_observation_space.shape[0]
    key = jax.random.key(given.seed)
    key, first, second = jax.random.split(key, 3)
    params = {
        "actor": layers(first, columns, HIDDEN, HIDDEN, 2), "spread": jnp.full(2, -0.5),
        "critic": layers(second, columns, HIDDEN, HIDDEN, 1),
    }  # fmt: skip
    optimiser, learn = learner(RATE)
    state, usual, rng = optimiser.init(params), Usual(columns), np.random.default_rng(given.seed)
    raw, infos = envs.reset(seed=given.seed)
    usual.add(raw)
    begun_s, taken, returns, own = time.perf_counter(), 0, [], np.zeros(AGENTS)
    while time.perf_counter() - begun_s < 60.0 * given.minutes and taken < given.steps:
        rows, ended, over = [], [], []
        for _ in range(STEPS):
            seen, present = usual.of(raw), infos["present"]
            key, draw = jax.random.split(key)
            action, before, value = map(np.asarray, act(params, seen, draw))
            raw, gain, end, late, infos = envs.step(reach * np.clip(action, -1.0, 1.0))
            usual.add(raw[infos["present"]])
            rows.append(Driven(seen, action, before, gain, value, present))
            ended.append(end)
            over.append(late)
            own += gain
            done = end | late
            returns += own[done].tolist()
            own[done] = 0.0
            taken += present.sum()
        driven = Driven(*map(np.array, zip(*rows, strict=True)))
        _, _, last = act(params, usual.of(raw), key)
        gain = advantages(driven, np.array(ended), np.array(over), np.asarray(last))
        target = gain + driven.value
        those = gain[driven.present]
        gain = (gain - those.mean()) / (those.std() + 1e-8)
        table = [driven.seen, driven.action, driven.likelihood, gain, target, driven.present]
        table = [one.reshape(STEPS * AGENTS, *one.shape[2:]).astype(np.float32) for one in table]
        for _ in range(ROUNDS):
            for piece in np.array_split(rng.permutation(STEPS * AGENTS), BATCHES):
                params, state = learn(params, state, tuple(one[piece] for one in table))
        spent_s = time.perf_counter() - begun_s
        mean = np.mean(returns[-AGENTS:]) if returns else np.nan
        print(
            f"{spent_s:6.1f} s {taken:10d} steps, {taken / spent_s:8.0f}/s, return {mean:7.3f}",
            flush=True,
        )
    layers_of = [tuple(map(np.asarray, layer)) for layer in params["actor"]]
    layers_of[-1] = tuple(reach * one for one in layers_of[-1])
    write_policy(given.out, layers_of, usual.mean, usual.spread, envs)
    print(f"{given.out}: drive it by vehicle-agent drive {given.out} --vehicle NAME")


if __name__ == "__main__":
    main()
