"""Laws as courses of pushes over moments: what the general effect gives where the car was then."""

import math
from collections.abc import Callable, Mapping

import numpy as np

from scm.arrays import Floats, Ints
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect, Values
from scm.mismatch.discovery.general_effect import SLOW, WEIGHTS
from scm.mismatch.discovery.impulse_response import Cells
from scm.vehicles.jit import array_kernel


def pushes(effect: DictionaryEffect, cells: Cells, values: Values) -> Floats:
    """Return a law's force, angle, throttle or moment at each moment, (cells,)."""
    n = len(effect.channel.parameters)
    curve, channel = effect.curve.numbers(values[n:]), effect.channel.numbers(values[:n])
    return shape(curve, cells) * amount(channel, cells)


def shape(curve: Mapping[str, float], cells: Cells) -> Floats:
    """Return a curve at each moment, as `learned` has it, (cells,)."""
    q = np.full(len(cells), curve.get("phase", 0.0))
    for name in WEIGHTS:
        if f"by_{name}" in curve:
            q += curve[f"by_{name}"] * variable(name, curve, cells)
    parts = (curve[name] * part(q) for name, part in _SHAPES.items() if name in curve)
    return sum(parts, np.zeros(len(cells)))


def variable(name: str, curve: Mapping[str, float], cells: Cells) -> Floats:
    """Return one of `learned.WEIGHTS`' variables at each moment, (cells,)."""
    if name != "memory":
        return cells.driven[name]
    share = -math.expm1(-cells.wide / curve["memory_s"])
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
    "moment_nm": _ones,
}  # fmt: skip
