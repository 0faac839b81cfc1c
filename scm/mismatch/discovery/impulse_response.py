"""What a push at each moment would explain: responses of the weighted residuals to hats of time.

Hats a comb's pitch apart are felt one at a time, so one rollout tests many moments at once. What
they would explain together is a quadratic form, in which any effect is a vector: thousands are
compared without another rollout. The car's own numbers and known effects are refitted linearly.

Torque over a wheel's turn is quicker than these moments: waves of each whole number in a turn are
driven once, a sine and a cosine.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from scm.arrays import Floats, Ints
from scm.mismatch.discovery.dictionary import PHASE, dictionary
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect, Values
from scm.mismatch.discovery.general_effect import PREFIX
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood

PITCH_S = 8.0  # a hat's response has died away before the next one's begins
LEAST_S, MOST_CELLS = 0.1, 900
BEFORE_S = 0.3  # stamps may be early, and sensors average
AMOUNTS: Mapping[str, float] = {
    "along_n": 0.02, "turn_rad": 0.02, "throttle_add": 0.02, "moment_nm": 0.002,
}  # fmt: skip
"""Sizes of the hats; forces and moments for each newton of the car's weight."""
WAVES = tuple(float(n) for n in range(1, 13))
SIZE = 0.01  # of the torque on a wheel that would lift the car: small, so that all is linear
_HALVES = (0.0, 0.5 * math.pi)


@dataclass(frozen=True, slots=True)
class Cells:
    """The moments, and what the car did then.

    Attributes:
        wide: Between moments [s].
        drive: Number of the drive, (cells,).
        driven: Variables by their names in `learned`, each (cells,).
    """

    wide: float
    drive: Ints
    driven: Mapping[str, Floats]

    def __len__(self) -> int:
        return len(self.drive)


@dataclass(frozen=True, slots=True)
class Response:
    """What pushes in one channel would explain.

    A series of pushes f, (cells,), changes the objective by 2 f @ slope + f @ bend @ f.
    """

    slope: Floats
    bend: Floats

    def gains(self, pushes: Floats) -> tuple[Floats, Floats]:
        """Return the best factor of each series, and what it then explains: (cells, n) -> (n,)."""
        top = -(self.slope @ pushes)
        bottom = np.einsum("ij,ij->j", pushes, self.bend @ pushes)
        bottom = np.maximum(bottom, 1e-9 * max(float(bottom.max(initial=0.0)), 1e-12))
        return top / bottom, top * top / bottom


def cells_of(base: Hypothesis) -> Cells:
    """Return the moments of the drives, with what the car does under a hypothesis."""
    model = base.model
    spans = [float(d.edges[-1] - d.edges[0]) for d in model.drives]
    wide = max(LEAST_S, sum(spans) / MOST_CELLS)
    parts, numbers = list[dict[str, Floats]](), list[Ints]()
    for i, drive in enumerate(model.drives):
        motion = model.simulator.rollouts[i].run([base.numbers])
        edges = drive.edges
        t = wide * np.arange(int(spans[i] / wide) + 1, dtype=np.float64)
        x, y, yaw = (drive.smoothed[f"pose.{n}"].at(edges[0] + t) for n in ("x", "y", "yaw"))
        throttle = drive.throttle.means(edges, np.zeros(1))[:, 0]
        now = {name: np.interp(t, edges - edges[0], motion[name][:, 0])
               for name in ("speed", "steer_angle", "yaw_rate", "accel_y")}  # fmt: skip
        parts.append({
            "time": t, "x": x, "y": y, "yaw": yaw, "speed": now["speed"],
            "steer": now["steer_angle"], "rate": now["yaw_rate"], "side": now["accel_y"],
            "throttle": np.interp(t, edges[1:] - edges[0], throttle),
        })  # fmt: skip
        numbers.append(np.full(len(t), i))
    driven = {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
    return Cells(wide, np.concatenate(numbers), driven)


def respond(fitter: Fitter, base: Hypothesis, cells: Cells, channel: str) -> Response:
    """Return what pushes in one channel would explain beside a hypothesis."""
    model = fitter.model
    count = round(PITCH_S / cells.wide)
    values = base.numbers
    amount = AMOUNTS[channel]
    if channel in ("along_n", "moment_nm"):
        amount *= 9.81 * model.car.value("body.mass_kg")
    comb = {"comb": 1.0, "comb_every": count * cells.wide, "comb_wide": cells.wide}
    comb[channel] = amount
    sets = [
        values | {PREFIX + k: v for k, v in (comb | {"comb_at": j * cells.wide}).items()}
        for j in range(count)
    ]
    e, _ = model([values, *sets])
    changes = (e[:, 1:] - e[:, :1]) / amount
    weights, jacobian = fitter.weights(base.innovations), base.jacobian
    own = np.zeros((jacobian.shape[1], len(cells)))
    slope, bend = np.zeros(len(cells)), np.zeros((len(cells), len(cells)))
    for rows, places, felt in _windows(model, cells, count, changes):
        weighed = felt * weights[rows, None]
        slope[places] += weighed.T @ base.innovations[rows]
        own[:, places] += jacobian[rows].T @ weighed
        bend[np.ix_(places, places)] += felt.T @ weighed
    return _refitted(fitter, base, Response(slope, bend), own)


def beside(fitter: Fitter, base: Hypothesis, felt: Floats) -> Response:
    """Return what amounts of what is felt, (events, n), would explain beside a hypothesis."""
    weighed = felt.T * fitter.weights(base.innovations)
    alone = Response(weighed @ base.innovations, weighed @ felt)
    return _refitted(fitter, base, alone, (weighed @ base.jacobian).T)


def _refitted(fitter: Fitter, base: Hypothesis, alone: Response, own: Floats) -> Response:
    """Return a response where all that is fitted already follows linearly.

    Args:
        fitter: Of the hypothesis.
        base: Which it stands beside.
        alone: The response where nothing follows.
        own: How what is fitted and what is felt go together, (fitted, felt).
    """
    weighed = base.jacobian.T * fitter.weights(base.innovations)
    prior = np.full(len(weighed), 1e-6)
    prior[: len(base.z)] = 1.0
    tilt = weighed @ base.innovations
    tilt[: len(base.z)] += base.z
    held = np.linalg.solve(weighed @ base.jacobian + np.diag(prior), own)
    return Response(alone.slope - held.T @ tilt, alone.bend - own.T @ held)


def _windows(
    model: Likelihood, cells: Cells, count: int, changes: Floats
) -> Iterator[tuple[slice, Ints, Floats]]:
    """Yield stretches of rows as long as a pitch, the cells felt there, and how."""
    first = 0
    for i, (drive, whitener) in enumerate(zip(model.drives, model.whiteners, strict=True)):
        places = np.flatnonzero(cells.drive == i)
        t, pitch = whitener.t - drive.edges[0] + BEFORE_S, count * cells.wide
        for block in range(int(t[-1] / pitch) + 1):
            a, b = np.searchsorted(t, (block * pitch, (block + 1) * pitch))
            rows = slice(first + a, first + b)
            low, high = max(block - 1, 0) * count, min((block + 1) * count, len(places))
            since = t[a:b, None] - cells.wide * np.arange(low, high)
            felt = changes[rows][:, np.arange(low, high) % count]
            yield rows, places[low:high], np.where((since >= 0.0) & (since < pitch), felt, 0.0)
        first += len(t)


@cache
def by_turn() -> DictionaryEffect:
    """Return the effect of a torque over a wheel's turn."""
    return next(effect for effect in dictionary() if effect.shape is PHASE)


def ripples(fitter: Fitter, base: Hypothesis) -> Iterator[tuple[Values, float]]:
    """Yield the best torque of each number of waves in a turn, and what it would explain."""
    response = waves_response(fitter, base)
    slope, bend = response.slope, response.bend
    for i, waves in enumerate(WAVES):
        both = slice(2 * i, 2 * i + 2)
        sine, cosine = map(float, -np.linalg.pinv(bend[both, both]) @ slope[both])
        gain = -float(slope[both] @ (sine, cosine))
        yield (math.hypot(sine, cosine), waves, math.atan2(cosine, sine)), gain


def waves_response(fitter: Fitter, base: Hypothesis) -> Response:
    """Return the response to a sine and a cosine [N*m] of each of `WAVES`."""
    model, values = fitter.model, base.numbers
    amount = SIZE * 9.81 * model.car.value("body.mass_kg") * model.car.value("wheel.radius_m")
    waves = [by_turn().numbers((amount, n, half)) for n in WAVES for half in _HALVES]
    e, _ = model([values, *(values | wave for wave in waves)])
    return beside(fitter, base, (e[:, 1:] - e[:, :1]) / amount)
