"""Which dictionary effects would explain most, by linear algebra, without a rollout."""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats, Ints
from scm.mismatch.discovery.dictionary import TILES, WAVE
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect, Values
from scm.mismatch.discovery.general_effect import SLOW, WEIGHTS
from scm.mismatch.discovery.impulse_response import Cells, Response
from scm.vehicles.jit import array_kernel


def pushes(effect: DictionaryEffect, cells: Cells, values: Values) -> Floats:
    """Return an effect's force, angle, throttle or moment at each moment, (cells,)."""
    n = len(effect.channel.parameters)
    numbers, channel = effect.shape.numbers(values[n:]), effect.channel.numbers(values[:n])
    return shape(numbers, cells) * amount(channel, cells)


def shape(numbers: Mapping[str, float], cells: Cells) -> Floats:
    """Return a shape at each moment, as `learned` has it, (cells,)."""
    q = np.full(len(cells), numbers.get("phase", 0.0))
    for name in WEIGHTS:
        if f"by_{name}" in numbers:
            q += numbers[f"by_{name}"] * variable(name, numbers, cells)
    parts = (numbers[name] * part(q) for name, part in _SHAPES.items() if name in numbers)
    return sum(parts, np.zeros(len(cells)))


def variable(name: str, numbers: Mapping[str, float], cells: Cells) -> Floats:
    """Return one of `learned.WEIGHTS`' variables at each moment, (cells,)."""
    if name == "away":
        x, y = cells.driven["x"] - numbers["away_x"], cells.driven["y"] - numbers["away_y"]
        return np.hypot(x, y)
    if name != "memory":
        return cells.driven[name]
    share = -math.expm1(-cells.wide / numbers["memory_s"])
    return remembered(cells.driven["throttle"], cells.drive, share)


@array_kernel
def remembered(values: Floats, drive: Ints, share: float) -> Floats:
    """Return what is remembered of values, of which each takes a share; a drive begins with 0."""
    found = np.zeros(len(values))
    for i in range(1, len(values)):
        before = found[i - 1] if drive[i] == drive[i - 1] else 0.0
        found[i] = before + share * (values[i - 1] - before)
    return found


def amount(channel: Mapping[str, float], cells: Cells) -> Floats:
    """Return what the shape is multiplied with at each moment, (cells,)."""
    parts = (channel[name] * _FACTORS[name](cells.driven) for name in channel)
    return sum(parts, np.zeros(len(cells)))


def _ones(driven: Mapping[str, Floats]) -> Floats:
    return np.ones_like(driven["speed"])


def _drag(driven: Mapping[str, Floats]) -> Floats:
    speed = driven["speed"] / SLOW
    return -speed / np.sqrt(1.0 + speed * speed)


_SHAPES: Mapping[str, Callable[[Floats], Floats]] = {
    "sine": np.sin, "cosine": np.cos, "one": np.ones_like, "line": lambda q: q, "size": np.abs,
    "square": lambda q: q * q, "cube": lambda q: q * q * q, "heavy": lambda q: np.abs(q) * q * q,
    "ramp": lambda q: np.maximum(q, 0.0), "step": lambda q: np.clip(q + 0.5, 0.0, 1.0),
}  # fmt: skip
_FACTORS: Mapping[str, Callable[[Mapping[str, Floats]], Floats]] = {
    "along_n": _ones, "drag_n": _drag, "world_x_n": lambda d: np.cos(d["yaw"]),
    "world_y_n": lambda d: np.sin(d["yaw"]), "turn_rad": _ones, "demand_rad": _ones,
    "turn_gain": lambda d: d["steer"], "throttle_gain": lambda d: d["throttle"],
    "pull_n_m": lambda d: -d["x"] * np.cos(d["yaw"]) - d["y"] * np.sin(d["yaw"]),
    "moment_nm": _ones,
}  # fmt: skip


FASTEST_HZ = 1.0
WAVES_AT_ONCE = 2000  # tens of thousands of waves fill memory
_HALVES = (0.0, 0.5 * np.pi)  # phases
SHORTEST = 2.2  # cells in a wave


def grid_of(effect: DictionaryEffect, cells: Cells) -> Iterator[Values]:
    """Yield values of an effect's parameters except its amount, which is 1; a wave's phase is 0."""
    names = [parameter.name for parameter in effect.parameters][1:]
    if "length_m" in names:
        yield from ((1.0, length, way, 0.0) for length, way in _vectors(cells))
        return
    grids = _grids(cells)
    sizes = [grids[name] for name in names]
    for row in itertools.product(*sizes):
        yield (1.0, *map(float, row))


def _grids(cells: Cells) -> Mapping[str, Floats]:
    t, speed = cells.driven["time"], cells.driven["speed"]
    x, y = cells.driven["x"], cells.driven["y"]
    span, size = float(t.max()), float(np.hypot(x, y).max())
    slowest, fastest = 0.7 / span, min(FASTEST_HZ, 1.0 / (SHORTEST * cells.wide))
    centre_at = np.linspace(-0.8, 0.8, 25) * size
    extent = max(float(np.ptp(x)), float(np.ptp(y)))
    return {
        "toward_rad": np.linspace(0.0, np.pi, 6, endpoint=False),
        "period_s": 1.0 / np.arange(slowest, fastest, 0.4 / span),
        "phase_rad": np.zeros(1),
        "against_rad": np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False),
        "way_rad": np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False),
        "beyond_m": centre_at,
        "x_m": np.linspace(float(x.min()), float(x.max()), 9),
        "y_m": np.linspace(float(y.min()), float(y.max()), 9),
        "radius_m": extent * np.array([0.1, 0.16, 0.25]),
        "memory_s": np.geomspace(0.5, 0.7 * span, 12),
        "above_mps": np.percentile(speed, [5, 20, 35, 50, 65, 80, 90]),
    }


def _vectors(cells: Cells) -> Iterator[tuple[float, float]]:
    """Yield (length, direction) of waves over the floor, no two alike where the car drove."""
    width, height = (max(float(np.ptp(cells.driven[k])), 0.1) for k in ("x", "y"))
    pace = float(np.percentile(cells.driven["speed"], 90)) * cells.wide
    most = 2.0 * np.pi / max(SHORTEST * pace, 0.06)
    kx = np.arange(0.0, most, 2.5 / width)
    ky = np.arange(-most, most, 2.5 / height)
    for a in kx:
        for b in ky:
            size = float(np.hypot(a, b))
            if 0.9 * 2.0 * np.pi / max(width, height) < size < most and (a > 0.0 or b > 0.0):
                yield 2.0 * np.pi / size, float(np.arctan2(b, a))


MAX_STARTS = 3  # starts of each effect that are followed
SAME_ABOVE = 0.9  # correlation above which two starts are one
MAX_WAVES = 60  # waves that may be stripes
HALVINGS, FIRST_STEP = 6, 2.0
_PHASES = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)


@dataclass(frozen=True, slots=True)
class Start:
    """An effect at values of its parameters, and what it would explain of the objective there."""

    effect: DictionaryEffect
    values: Values
    gain: float


def screen(
    effects: Sequence[DictionaryEffect], cells: Cells, responses: Mapping[str, Response]
) -> list[list[Start]]:
    """Return the best starts of each effect, best first, from all that a drive could show."""
    waves, found = dict[str, list[Start]](), list[list[Start]]()
    for effect in sorted(effects, key=lambda effect: effect.shape is TILES):
        word = effect.channel.response
        if word not in responses:
            continue
        if effect.shape is TILES:  # a wave that never turns round: it begins where waves explain
            grid = [(*s.values[:-1], float(p)) for s in waves[word] for p in _PHASES]
            found.append(_best(effect, grid, cells, responses[word]))
        elif any(parameter.name == "phase_rad" for parameter in effect.parameters):
            starts = _waves(effect, list(grid_of(effect, cells)), cells, responses[word])
            if effect.shape is WAVE:
                waves[word] = starts
            found.append(starts[:MAX_STARTS])
        else:
            found.append(_best(effect, list(grid_of(effect, cells)), cells, responses[word]))
    return found


def _best(
    effect: DictionaryEffect, grid: Sequence[Values], cells: Cells, response: Response
) -> list[Start]:
    every_series = np.stack([pushes(effect, cells, (1.0, *values[1:])) for values in grid], axis=1)
    amounts, gains = response.gains(every_series)
    order, chosen = np.argsort(-gains), list[int]()
    for i in order[:200]:
        if len(chosen) < MAX_STARTS and all(
            _alike(every_series[:, i], every_series[:, j]) < SAME_ABOVE for j in chosen
        ):
            chosen.append(int(i))
    return [Start(effect, (float(amounts[i]), *grid[i][1:]), float(gains[i])) for i in chosen]


def _alike(a: Floats, b: Floats) -> float:
    return abs(float(a @ b)) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-12)


def _waves(
    effect: DictionaryEffect, grid: Sequence[Values], cells: Cells, response: Response
) -> list[Start]:
    """Return the best waves; amount and phase come from a wave's two halves together."""
    some = (grid[k : k + WAVES_AT_ONCE] for k in range(0, len(grid), WAVES_AT_ONCE))
    parts = [_amounts(effect, one, cells, response) for one in some]
    a, b, gains = np.concatenate(parts, axis=1)
    most = MAX_WAVES if effect.shape is WAVE else MAX_STARTS
    found, chosen = list[Start](), list[Floats]()
    for i in np.argsort(-gains)[:400]:
        halves = [pushes(effect, cells, (*grid[i][:-1], phase)) for phase in _HALVES]
        series = a[i] * halves[0] + b[i] * halves[1]
        if len(found) < most and all(_alike(series, k) < SAME_ABOVE for k in chosen):
            chosen.append(series)
            values = (float(np.hypot(a[i], b[i])), *grid[i][1:-1], float(np.arctan2(b[i], a[i])))
            found.append(Start(effect, values, float(gains[i])))
    return found


def _amounts(
    effect: DictionaryEffect, grid: Sequence[Values], cells: Cells, response: Response
) -> Floats:
    """Return the amounts of the two halves of waves, and what they gain, (3, waves)."""
    halves = [
        np.stack([pushes(effect, cells, (*v[:-1], phase)) for v in grid], axis=1)
        for phase in _HALVES
    ]
    top = np.stack([-(response.slope @ half) for half in halves])
    ss = np.einsum("ij,ij->j", halves[0], response.bend @ halves[0])
    bent = response.bend @ halves[1]
    cc, sc = (np.einsum("ij,ij->j", half, bent) for half in halves[::-1])
    size = ss * cc - sc * sc
    size = np.maximum(size, 1e-6 * ss * cc + 1e-30)
    a, b = (cc * top[0] - sc * top[1]) / size, (ss * top[1] - sc * top[0]) / size
    return np.stack((a, b, a * top[0] + b * top[1]))


def polished(start: Start, cells: Cells, response: Response) -> Start:
    """Return a start with its parameters, but not the amount, moved to where it explains most."""
    parameters = start.effect.parameters[1:]
    values, gain = np.array(start.values[1:]), start.gain
    steps_now = np.array([FIRST_STEP * parameter.step for parameter in parameters])
    low, high = np.array([k.bounds for k in parameters]).reshape(-1, 2).T
    amount, left = start.values[0], HALVINGS
    while left > 0 and len(parameters):
        steps = np.concatenate((np.diag(steps_now), -np.diag(steps_now)))
        moves = np.clip(values + steps, low, high)
        every_series = np.stack([pushes(start.effect, cells, (1.0, *m)) for m in moves], axis=1)
        amounts, gains = response.gains(every_series)
        best = int(np.argmax(gains))
        if gains[best] > gain + 0.1:
            values, gain, amount = moves[best], float(gains[best]), float(amounts[best])
        else:
            steps_now, left = 0.5 * steps_now, left - 1
    return Start(start.effect, (amount, *map(float, values)), gain)
