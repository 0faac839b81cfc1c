"""Laws as courses of pushes over moments: what the general effect gives where the car was then."""

from collections.abc import Mapping

import numpy as np

from scm.arrays import Floats
from scm.mismatch.laws.cells import Cells
from scm.mismatch.laws.law import Law, Values
from scm.mismatch.laws.learned import SLOW, WEIGHTS


def pushes(law: Law, cells: Cells, values: Values) -> Floats:
    """Return a law's force, angle, throttle or moment at each moment, (cells,)."""
    n = len(law.channel.knobs)
    curve, channel = law.curve.numbers(values[n:]), law.channel.numbers(values[:n])
    return shape(curve, cells) * amount(channel, cells)


def shape(curve: Mapping[str, float], cells: Cells) -> Floats:
    """Return a curve at each moment, as `learned` has it, (cells,)."""
    q = np.full(len(cells), curve.get("phase", 0.0))
    for name in WEIGHTS:
        if f"by_{name}" in curve:
            q += curve[f"by_{name}"] * cells.driven[name]
    away = np.abs(q)
    parts = {
        "sine": np.sin(q), "cosine": np.cos(q), "one": np.ones(len(q)), "line": q, "size": away,
        "square": q * q, "cube": q * q * q, "heavy": away * q * q, "ramp": np.maximum(q, 0.0),
        "step": np.clip(q + 0.5, 0.0, 1.0),
    }  # fmt: skip
    return sum((curve[k] * part for k, part in parts.items() if k in curve), np.zeros(len(q)))


def amount(channel: Mapping[str, float], cells: Cells) -> Floats:
    """Return what the shape is multiplied with at each moment, (cells,)."""
    driven = cells.driven
    speed = driven["speed"] / SLOW
    ones = np.ones(len(cells))
    factors: dict[str, Floats] = {
        "along_n": ones, "drag_n": -speed / np.sqrt(1.0 + speed * speed),
        "world_x_n": np.cos(driven["yaw"]), "world_y_n": np.sin(driven["yaw"]),
        "turn_rad": ones, "turn_gain": driven["steer"], "throttle_gain": driven["throttle"],
        "moment_nm": ones,
    }  # fmt: skip
    return sum((channel[k] * factors[k] for k in channel), np.zeros(len(cells)))
