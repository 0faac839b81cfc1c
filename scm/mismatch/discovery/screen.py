"""Which laws would explain most, by linear algebra over moments; no rollout is made here."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect, Values
from scm.mismatch.discovery.grids import grid_of
from scm.mismatch.discovery.impulse_response import Cells, Response
from scm.mismatch.discovery.pushes import pushes
from scm.mismatch.discovery.shapes import TILES, WAVE

MAX_STARTS = 3  # starts of each law that are followed
SAME_ABOVE = 0.9  # correlation above which two starts are one
MAX_WAVES = 60  # waves that may be stripes
HALVINGS, FIRST_STEP = 6, 2.0
_PHASES = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)


@dataclass(frozen=True, slots=True)
class Start:
    """A law at values of its knobs, and what it would explain of the objective there."""

    effect: DictionaryEffect
    values: Values
    gain: float


def screen(
    effects: Sequence[DictionaryEffect], cells: Cells, responses: Mapping[str, Response]
) -> list[list[Start]]:
    """Return the best starts of each law, best first, from all that a drive could show."""
    waves, found = dict[str, list[Start]](), list[list[Start]]()
    for effect in sorted(effects, key=lambda effect: effect.curve is TILES):
        word = effect.channel.response
        if word not in responses:
            continue
        if effect.curve is TILES:  # a wave that never turns round: it begins where waves explain
            grid = [(*s.values[:-1], float(p)) for s in waves[word] for p in _PHASES]
            found.append(_best(effect, grid, cells, responses[word]))
        elif any(parameter.name == "phase_rad" for parameter in effect.parameters):
            starts = _waves(effect, list(grid_of(effect, cells)), cells, responses[word])
            if effect.curve is WAVE:
                waves[word] = starts
            found.append(starts[:MAX_STARTS])
        else:
            found.append(_best(effect, list(grid_of(effect, cells)), cells, responses[word]))
    return found


def _best(
    effect: DictionaryEffect, grid: Sequence[Values], cells: Cells, response: Response
) -> list[Start]:
    courses = np.stack([pushes(effect, cells, (1.0, *values[1:])) for values in grid], axis=1)
    amounts, gains = response.gains(courses)
    order, chosen = np.argsort(-gains), list[int]()
    for i in order[:200]:
        if len(chosen) < MAX_STARTS and all(
            _alike(courses[:, i], courses[:, j]) < SAME_ABOVE for j in chosen
        ):
            chosen.append(int(i))
    return [Start(effect, (float(amounts[i]), *grid[i][1:]), float(gains[i])) for i in chosen]


def _alike(a: Floats, b: Floats) -> float:
    return abs(float(a @ b)) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-12)


def _waves(
    effect: DictionaryEffect, grid: Sequence[Values], cells: Cells, response: Response
) -> list[Start]:
    """Return the best waves; amount and phase come from a wave's two halves together."""
    halves = [np.empty((len(cells), len(grid))) for _ in range(2)]  # thousands of waves fill memory
    for half, phase in zip(halves, (0.0, 0.5 * np.pi), strict=True):
        for i, v in enumerate(grid):
            half[:, i] = pushes(effect, cells, (*v[:-1], phase))
    top = np.stack([-(response.slope @ half) for half in halves])
    ss = np.einsum("ij,ij->j", halves[0], response.bend @ halves[0])
    bent = response.bend @ halves[1]
    cc, sc = (np.einsum("ij,ij->j", half, bent) for half in halves[::-1])
    del bent
    size = ss * cc - sc * sc
    size = np.maximum(size, 1e-6 * ss * cc + 1e-30)
    a, b = (cc * top[0] - sc * top[1]) / size, (ss * top[1] - sc * top[0]) / size
    gains = a * top[0] + b * top[1]
    most = MAX_WAVES if effect.curve is WAVE else MAX_STARTS
    found, chosen = list[Start](), list[Floats]()
    for i in np.argsort(-gains)[:400]:
        course = a[i] * halves[0][:, i] + b[i] * halves[1][:, i]
        if len(found) < most and all(_alike(course, k) < SAME_ABOVE for k in chosen):
            chosen.append(course)
            values = (float(np.hypot(a[i], b[i])), *grid[i][1:-1], float(np.arctan2(b[i], a[i])))
            found.append(Start(effect, values, float(gains[i])))
    return found


def polished(start: Start, cells: Cells, response: Response) -> Start:
    """Return a start with all its knobs but the amount moved to where it explains most nearby."""
    parameters = start.effect.parameters[1:]
    values, gain = np.array(start.values[1:]), start.gain
    steps_now = np.array([FIRST_STEP * parameter.step for parameter in parameters])
    low, high = np.array([k.bounds for k in parameters]).reshape(-1, 2).T
    amount, left = start.values[0], HALVINGS
    while left > 0 and len(parameters):
        steps = np.concatenate((np.diag(steps_now), -np.diag(steps_now)))
        moves = np.clip(values + steps, low, high)
        courses = np.stack([pushes(start.effect, cells, (1.0, *m)) for m in moves], axis=1)
        amounts, gains = response.gains(courses)
        best = int(np.argmax(gains))
        if gains[best] > gain + 0.1:
            values, gain, amount = moves[best], float(gains[best]), float(amounts[best])
        else:
            steps_now, left = 0.5 * steps_now, left - 1
    return Start(start.effect, (amount, *map(float, values)), gain)
