"""A discovered effect's curve, and beside it what each bin would explain, with a band.

The bins are pushes in the same channel, fitted together and free of any form; an effect that is
right runs through their bands.
"""

import math
from dataclasses import replace

import numpy as np

from scm.arrays import Floats
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect, Values
from scm.mismatch.discovery.impulse_response import Cells, respond
from scm.mismatch.discovery.screen import amount, shape, variable
from scm.mismatch.discovery.try_dictionary import Tried
from scm.mismatch.discovery.wheel_ripple import WAVES, by_turn, waves_response
from scm.mismatch.evidence import Curve
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import Hypothesis

BINS = 16
NINETY = 1.645
LEAST_CELLS = 3
TURN_POINTS = 73
_AXES = {
    "time": ("time", "s"), "heading": ("yaw", "rad"), "speed": ("speed", "m/s"),
    "steering angle": ("steer", "rad"), "steering sign": ("steer", "rad"),
    "throttle": ("throttle", "1"), "load": ("side", "m/s^2"), "yaw rate": ("rate", "rad/s"),
    "throttle's past": ("memory", "1"),
}  # fmt: skip
_UNITS = {"along_n": "N", "turn_rad": "rad", "throttle_add": "1", "moment_nm": "N*m"}


def discovered_curves(fitted: Hypothesis, tried: Tried) -> tuple[Curve, ...]:
    """Return a discovered effect as the recordings show it in bins, and as it was fitted."""
    first = 0
    for effect in fitted.effects:
        if isinstance(effect, DictionaryEffect):
            drawn = _round_a_turn if effect is by_turn() else _curves
            return drawn(effect, slice(first, first + len(effect.parameters)), fitted, tried)
        first += len(effect.parameters)
    return ()


def _curves(
    effect: DictionaryEffect, mine: slice, fitted: Hypothesis, tried: Tried
) -> tuple[Curve, Curve]:
    values = tuple(float(v) for v in fitted.values[mine])
    n, cells = len(effect.channel.parameters), tried.cells
    x, x_name, x_unit = axis_of(effect, values[n:], cells)
    unit = amount(effect.channel.numbers((1.0, *values[1:n])), cells)
    edges = np.linspace(float(x.min()), float(x.max()), BINS + 1)
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    used = [b for b in range(BINS) if np.count_nonzero(place == b) >= LEAST_CELLS]
    courses = np.stack([np.where(place == b, unit, 0.0) for b in used], axis=1)
    more, covariance = _left_over(effect, mine, fitted, tried, courses)
    fit = values[0] * shape(effect.curve.numbers(values[n:]), cells)
    y = np.array([fit[place == b].mean() for b in used]) + more
    band = NINETY * np.sqrt(np.maximum(covariance.diagonal(), 0.0))
    middle = np.array([x[place == b].mean() for b in used])
    order = np.argsort(x)
    names = {"x_name": x_name, "x_unit": x_unit, "y_name": effect.channel.word,
             "y_unit": _UNITS[effect.channel.response]}  # fmt: skip
    return (
        Curve(effect=effect.name, x=middle, y=y, low=y - band, high=y + band, **names),
        Curve(
            effect=effect.name, x=x[order], y=fit[order], low=fit[order], high=fit[order], **names
        ),
    )


def _round_a_turn(
    effect: DictionaryEffect, mine: slice, fitted: Hypothesis, tried: Tried
) -> tuple[Curve, Curve]:
    """Return a torque over a wheel's turn as the sum of all waves, and as it was fitted."""
    torque, waves, phase = (float(v) for v in fitted.values[mine])
    own = np.arange(len(fitted.z) + mine.start, len(fitted.z) + mine.stop)
    held = replace(fitted, jacobian=np.delete(fitted.jacobian, own, axis=1))
    slope, bend = waves_response(Fitter(fitted.model, tried.part), held)
    covariance = np.linalg.inv(bend + 1e-9 * np.trace(bend) * np.eye(len(bend)))
    x: Floats = np.linspace(0.0, 2.0 * math.pi, TURN_POINTS)
    shapes = np.stack([f(n * x) for n in WAVES for f in (np.sin, np.cos)], axis=1)
    fit = torque * np.sin(waves * x + phase)
    y = fit - shapes @ (covariance @ slope)
    band = NINETY * np.sqrt(np.einsum("ij,jk,ik->i", shapes, covariance, shapes))
    names = {
        "x_name": "wheel turn",
        "x_unit": "rad",
        "y_name": effect.channel.word,
        "y_unit": "N*m",
    }
    return (
        Curve(effect=effect.name, x=x, y=y, low=y - band, high=y + band, **names),
        Curve(effect=effect.name, x=x, y=fit, low=fit, high=fit, **names),
    )


def _left_over(
    effect: DictionaryEffect, mine: slice, fitted: Hypothesis, tried: Tried, courses: Floats
) -> tuple[Floats, Floats]:
    """Return what each course explains beyond the effect as found, and how sure that is."""
    own = np.arange(len(fitted.z) + mine.start, len(fitted.z) + mine.stop)
    held = replace(fitted, jacobian=np.delete(fitted.jacobian, own, axis=1))
    fitter = Fitter(fitted.model, tried.part)
    response = respond(fitter, held, tried.cells, effect.channel.response)
    bend = courses.T @ response.bend @ courses
    bend += 1e-9 * np.trace(bend) * np.eye(len(bend))
    covariance: Floats = np.linalg.inv(bend).astype(np.float64)
    return -covariance @ (courses.T @ response.slope), covariance


def axis_of(effect: DictionaryEffect, values: Values, cells: Cells) -> tuple[Floats, str, str]:
    """Return what an effect depends on at each moment; waves and turns are laid over each other."""
    known = dict(zip((k.name for k in effect.curve.parameters), values, strict=True))
    if effect.curve.word == "position":
        way = known.get("way_rad", 0.0)
        x = cells.driven["x"] * math.cos(way) + cells.driven["y"] * math.sin(way)
        length = known.get("length_m")
        if length is None:
            return x, f"position towards {way:.2f} rad", "m"
        return np.mod(x, length), f"position within a wave towards {way:.2f} rad", "m"
    name, unit = _AXES[effect.curve.word]
    x = variable(name, effect.curve.numbers(values), cells)
    if name == "yaw":  # turns of the same heading fill the same bin
        x = np.arctan2(np.sin(x), np.cos(x))
    period = known.get("period_s")
    if period is not None:
        return np.mod(x, period), "time within a swing", unit
    return x, effect.curve.word, unit
