"""A law's curve beside the law: what each bin of what it depends on asks for, with a band.

The bins are pushes in the same channel, fitted together and free of any form; a law that is right
runs through their bands.
"""

import math

import numpy as np

from scm.arrays import Floats
from scm.mismatch.evidence import Curve
from scm.mismatch.fit import Fitted
from scm.mismatch.laws.cells import Cells
from scm.mismatch.laws.law import Law, Values
from scm.mismatch.laws.pushes import amount, shape
from scm.mismatch.laws.seek import Sought

BINS = 16
NINETY = 1.645
LEAST_CELLS = 3
_AXES = {
    "time": ("time", "s"), "heading": ("yaw", "rad"), "speed": ("speed", "m/s"),
    "steering angle": ("steer", "rad"), "steering sign": ("steer", "rad"),
    "throttle": ("throttle", "1"),
}  # fmt: skip
_UNITS = {"along_n": "N", "turn_rad": "rad", "throttle_add": "1", "moment_nm": "N*m"}


def law_curves(fitted: Fitted, sought: Sought) -> tuple[Curve, ...]:
    """Return a hypothesis' law as the recordings show it in bins, and as it was fitted."""
    law = fitted.effects[-1]
    if not isinstance(law, Law) or law.channel.response not in sought.responses:
        return ()
    values = tuple(float(v) for v in fitted.values[-len(law.knobs) :])
    n, cells = len(law.channel.knobs), sought.cells
    x, x_name, x_unit = _axis(law, values[n:], cells)
    one = (1.0, *values[1:n])
    unit = amount(law.channel.numbers(one), cells)
    edges = np.linspace(float(x.min()), float(x.max()), BINS + 1)
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    used = [b for b in range(BINS) if np.count_nonzero(place == b) >= LEAST_CELLS]
    courses = np.stack([np.where(place == b, unit, 0.0) for b in used], axis=1)
    response = sought.responses[law.channel.response]
    bend = courses.T @ response.bend @ courses
    bend += 1e-9 * np.trace(bend) * np.eye(len(used))
    covariance = np.linalg.inv(bend)
    y = -covariance @ (courses.T @ response.slope)
    band = NINETY * np.sqrt(np.maximum(covariance.diagonal(), 0.0))
    middle = 0.5 * (edges[:-1] + edges[1:])[used]
    fit = values[0] * shape(law.curve.numbers(values[n:]), cells)
    order = np.argsort(x)
    names = {"x_name": x_name, "x_unit": x_unit, "y_name": law.channel.word,
             "y_unit": _UNITS[law.channel.response]}  # fmt: skip
    return (
        Curve(effect=law.name, x=middle, y=y, low=y - band, high=y + band, **names),
        Curve(effect=law.name, x=x[order], y=fit[order], low=fit[order], high=fit[order], **names),
    )


def _axis(law: Law, values: Values, cells: Cells) -> tuple[Floats, str, str]:
    """Return what a law depends on at each moment; waves are laid over each other."""
    known = dict(zip((k.name for k in law.curve.knobs), values, strict=True))
    if law.curve.word == "position":
        way = known.get("way_rad", 0.0)
        x = cells.driven["x"] * math.cos(way) + cells.driven["y"] * math.sin(way)
        length = known.get("length_m")
        if length is None:
            return x, f"position towards {way:.2f} rad", "m"
        return np.mod(x, length), f"position within a wave towards {way:.2f} rad", "m"
    name, unit = _AXES[law.curve.word]
    x = cells.driven[name]
    period = known.get("period_s")
    if period is not None:
        return np.mod(x, period), "time within a swing", unit
    return x, law.curve.word, unit
