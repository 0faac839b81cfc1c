"""An effect as a curve: what it does to the car against what it depends on, with a 90 % band.

What a car does with the effect and without it, from the same measured motion and for a few tenths
of a second, is reported as the force along the body or the wheels' angle that would do the same.
A discovered effect is drawn beside what pushes in the same channel would explain in each bin, free
of any form: one that is right runs through their bands.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from scm.arrays import Floats
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect, Values
from scm.mismatch.discovery.impulse_response import WAVES, Cells, by_turn, respond, waves_response
from scm.mismatch.discovery.screen import amount, shape, variable
from scm.mismatch.discovery.try_dictionary import DictionaryFits
from scm.mismatch.effect_catalogue import Candidate, identifications
from scm.mismatch.evidence import Curve
from scm.mismatch.findings import Equation
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.validate.explain import NINETY, WIDER
from scm.mismatch.validate.residuals import (
    ANGLE,
    ANGLE_RAD,
    FORCE,
    GRAVITY,
    HORIZONTAL_G,
    MOVED,
    RUN_S,
    inverse_of,
    response,
    starts_of,
)
from scm.replay.camera import Camera, Moved
from scm.replay.drive import STEP_S, Drive
from scm.replay.numbers import Numbers
from scm.replay.windows import Side, Windows
from scm.vehicles.identification import Line

EVERY_S = 0.5
BINS = 12
LEAST_IN_BIN = 4
POINTS = 25
DISCOVERED_BINS = 16
LEAST_CELLS = 3
TURN_POINTS = 73
_AXES = {
    "time": ("time", "s"), "heading": ("yaw", "rad"), "speed": ("speed", "m/s"),
    "steering angle": ("steer", "rad"), "steering sign": ("steer", "rad"),
    "throttle": ("throttle", "1"), "load": ("side", "m/s^2"), "yaw rate": ("rate", "rad/s"),
    "throttle's past": ("memory", "1"),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Own:
    """One effect's own numbers within a fitted model; `std` of each, `key`s in its order."""

    at: slice
    values: Floats
    std: Floats


def curve(best: Hypothesis, effect: Candidate) -> Curve | None:
    """Return an effect of the model found as a curve, or None where a curve would say nothing.

    A delay or a lag acts by what was commanded before: it is no curve over anything. Several drives
    count as one; their times follow the recordings' clocks.
    """
    model = best.model
    known = identifications()[effect.name]
    if known.line:
        return _sensor_curve(model, effect, _own(best, effect), known.line)
    if effect.equation is Equation.SENSOR or not effect.depends_on:
        return None
    if all(parameter.unit == "s" for parameter in effect.parameters):
        return None
    own = _own(best, effect)
    turning = effect.equation in (Equation.STEERING, Equation.TYRE) or known.turns
    parts = [_acted(drive, best, effect, own, int(turning)) for drive in model.drives]
    x, y, band = (np.concatenate([part[i] for part in parts]) for i in range(3))
    (y_name, y_unit), (x_name, x_unit) = (FORCE, ANGLE)[turning], _variable(effect)
    middle, mean, half = _binned(x, y, band)
    if len(middle) < 2:
        return None
    return Curve(
        effect=effect.name, x_name=x_name, x_unit=x_unit, y_name=y_name, y_unit=y_unit,
        x=middle, y=mean, low=mean - half, high=mean + half,
    )  # fmt: skip


def _own(best: Hypothesis, effect: Candidate) -> _Own:
    mine = best.place_of(effect)
    steps = np.array([parameter.step for parameter in effect.parameters])
    own = len(best.z)
    variance = np.zeros(len(steps))
    if best.covariance.size:
        variance = best.covariance.diagonal()[own:][mine]
    return _Own(
        mine, best.values[mine], WIDER * NINETY * steps * np.sqrt(np.maximum(variance, 0.0))
    )


def _sensor_curve(model: Likelihood, effect: Candidate, own: _Own, line: Line) -> Curve:
    """Return what a faulty sensor is off by, from its formula; of two numbers the larger one."""
    i = int(np.argmax(np.abs(own.values))) if effect.name == "camera_tilt" else 0
    x_name = line.x_name
    seen = np.concatenate([_seen(drive, x_name, i) for drive in model.drives])
    low, high = np.percentile(seen, (1.0, 99.0))
    if x_name == "position":
        x_name = f"position {'xy'[i]}"
    x = np.linspace(low, high, POINTS)
    value, std = float(own.values[i]), float(own.std[i])
    sides = np.stack([line.of(x, value + side * std) for side in (-1.0, 1.0)])
    return Curve(
        effect=effect.name, x_name=x_name, x_unit=line.x_unit, y_name=line.y_name,
        y_unit=line.y_unit, x=x, y=line.of(x, value), low=sides.min(axis=0), high=sides.max(axis=0),
    )  # fmt: skip


def _seen(drive: Drive, variable: str, axis: int) -> Floats:
    """Return which values of a variable a drive has seen."""
    x, y, yaw = (drive.smoothed[f"pose.{name}"] for name in ("x", "y", "yaw"))
    if variable == "time":
        return drive.edges
    if variable == "speed":
        return drive.pose_speed
    if variable == "yaw rate":
        return yaw.rate
    return (x, y)[axis].value if variable == "position" else np.hypot(x.value, y.at(x.t))


def _acted(
    drive: Drive, best: Hypothesis, effect: Candidate, own: _Own, which: int
) -> tuple[Floats, Floats, Floats]:
    """Return what an effect depends on along a drive, what it does, and the band around that."""
    car = best.model.car

    def numbers(values: Floats) -> Numbers:
        changed = best.values.copy()
        changed[own.at] = values
        return replace(best, values=changed).numbers

    neutral = np.array([parameter.neutral for parameter in effect.parameters])
    low, high = (
        np.array([parameter.bounds[i] for parameter in effect.parameters]) for i in range(2)
    )
    moved = [
        np.clip(own.values + np.where(np.arange(len(neutral)) == j, own.std, 0.0), low, high)
        for j in range(len(neutral))
    ]
    force, found = HORIZONTAL_G * GRAVITY * car.value("body.mass_kg"), numbers(own.values)
    camera = Camera(drive, found)
    sides = [
        Side(found, camera),
        Side(found, camera, like=0, push=(force, 0.0)),
        Side(found, camera, like=0, push=(0.0, ANGLE_RAD)),
        *(Side(numbers(values), camera) for values in (neutral, *moved)),
    ]
    steps, every = round(RUN_S / STEP_S), round(EVERY_S / STEP_S)
    at = starts_of(drive, camera, steps, every)
    if not len(at):
        return np.zeros(0), np.zeros(0), np.zeros(0)
    runs = Windows(drive, car).run(sides, np.tile(at, (len(sides), 1)), steps)
    inverse = inverse_of(response(runs, 0, ((1, force), (2, ANGLE_RAD))))
    last = np.stack([runs[name][-1] for name in MOVED])
    does = np.einsum("ijw,jsw->isw", inverse, last[:, [0, *range(4, len(sides))]] - last[:, 3:4])
    does = does[which]
    middle = drive.edges[at] + 0.5 * RUN_S
    motion = camera.motion(middle)
    band = np.sqrt(((does[1:] - does[0]) ** 2).sum(axis=0))
    return _values(drive, effect, middle, motion), does[0], band


def _variable(effect: Candidate) -> tuple[str, str]:
    """Return name and unit of what an effect is drawn against."""
    return _NAMED.get(effect.depends_on[0], ("time", "s"))


_NAMED: Mapping[str, tuple[str, str]] = {
    "speed": ("speed", "m/s"),
    "throttle": ("throttle", "1"),
    "torque": ("throttle", "1"),
    "side": ("throttle", "1"),
    "constant": ("speed", "m/s"),
    "steering": ("steering", "1"),
    "steering angle": ("steering", "1"),
    "steering history": ("steering", "1"),
    "heading": ("heading", "rad"),
    "acceleration": ("acceleration", "m/s^2"),
    "lateral acceleration": ("lateral acceleration", "m/s^2"),
    "lateral force": ("lateral acceleration", "m/s^2"),
    "slip": ("lateral acceleration", "m/s^2"),
    "slip history": ("lateral acceleration", "m/s^2"),
}


def _values(drive: Drive, effect: Candidate, t: Floats, motion: Moved) -> Floats:
    """Return the variable that an effect is drawn against, at given times."""
    name = _variable(effect)[0]
    if name == "speed":
        return motion.speed
    if name == "heading":
        return np.arctan2(np.sin(motion.yaw), np.cos(motion.yaw))
    if name == "lateral acceleration":
        return motion.speed * motion.yaw_rate
    if name == "acceleration":
        return np.gradient(motion.speed, t)
    if name in ("throttle", "steering"):
        command = drive.throttle if name == "throttle" else drive.steering
        row = np.clip(np.searchsorted(command.t, t - 0.5 * RUN_S) - 1, 0, len(command.t) - 1)
        return command.values[row]
    return t


def _binned(x: Floats, y: Floats, band: Floats) -> tuple[Floats, Floats, Floats]:
    """Return middle, mean and half band of each bin that holds enough."""
    known = np.isfinite(y) & np.isfinite(band)
    if not known.any():
        return np.zeros(0), np.zeros(0), np.zeros(0)
    x, y, band = x[known], y[known], band[known]
    low, high = (float(v) for v in np.percentile(x, (1.0, 99.0)))
    cuts = np.linspace(low, high, BINS + 1)
    which = np.clip(np.searchsorted(cuts, x, side="right") - 1, 0, BINS - 1)
    held = [which == b for b in range(BINS) if (which == b).sum() >= LEAST_IN_BIN]
    return (
        np.array([float(x[mine].mean()) for mine in held]),
        np.array([float(np.median(y[mine])) for mine in held]),
        np.array([float(np.median(band[mine])) for mine in held]),
    )


def discovered_curves(fitted: Hypothesis, tried: DictionaryFits) -> tuple[Curve, ...]:
    """Return a discovered effect as the recordings show it in bins, and as it was fitted."""
    first = 0
    for effect in fitted.effects:
        if isinstance(effect, DictionaryEffect):
            drawn = _round_a_turn if effect is by_turn() else _in_bins
            return drawn(effect, slice(first, first + len(effect.parameters)), fitted, tried)
        first += len(effect.parameters)
    return ()


def _in_bins(
    effect: DictionaryEffect, mine: slice, fitted: Hypothesis, tried: DictionaryFits
) -> tuple[Curve, Curve]:
    values = tuple(float(v) for v in fitted.values[mine])
    n, cells = len(effect.channel.parameters), tried.cells
    x, x_name, x_unit = axis_of(effect, values[n:], cells)
    unit = amount(effect.channel.numbers((1.0, *values[1:n])), cells)
    edges = np.linspace(float(x.min()), float(x.max()), DISCOVERED_BINS + 1)
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, DISCOVERED_BINS - 1)
    used = [b for b in range(DISCOVERED_BINS) if np.count_nonzero(place == b) >= LEAST_CELLS]
    every_series = np.stack([np.where(place == b, unit, 0.0) for b in used], axis=1)
    fitter = Fitter(fitted.model, tried.part)
    response = respond(fitter, _without(fitted, mine), cells, effect.channel.response)
    covariance = _inverse(every_series.T @ response.bend @ every_series)
    fit = values[0] * shape(effect.shape.numbers(values[n:]), cells)
    y = np.array([fit[place == b].mean() for b in used])
    y = y - covariance @ (every_series.T @ response.slope)
    band = NINETY * np.sqrt(np.maximum(covariance.diagonal(), 0.0))
    middle, order = np.array([x[place == b].mean() for b in used]), np.argsort(x)
    draw = partial(
        Curve, effect=effect.name, x_name=x_name, x_unit=x_unit, y_name=effect.channel.word,
        y_unit=effect.channel.parameters[0].unit,
    )  # fmt: skip
    line = fit[order]
    return (
        draw(x=middle, y=y, low=y - band, high=y + band),
        draw(x=x[order], y=line, low=line, high=line),
    )


def _round_a_turn(
    effect: DictionaryEffect, mine: slice, fitted: Hypothesis, tried: DictionaryFits
) -> tuple[Curve, Curve]:
    """Return a torque over a wheel's turn as the sum of all waves, and as it was fitted."""
    torque, waves, phase = (float(v) for v in fitted.values[mine])
    response = waves_response(Fitter(fitted.model, tried.part), _without(fitted, mine))
    covariance = _inverse(response.bend)
    x: Floats = np.linspace(0.0, 2.0 * math.pi, TURN_POINTS)
    shapes = np.stack([f(n * x) for n in WAVES for f in (np.sin, np.cos)], axis=1)
    fit = torque * np.sin(waves * x + phase)
    y = fit - shapes @ (covariance @ response.slope)
    band = NINETY * np.sqrt(np.einsum("ij,jk,ik->i", shapes, covariance, shapes))
    draw = partial(
        Curve, effect=effect.name, x_name="wheel turn", x_unit="rad", y_name=effect.channel.word,
        y_unit="N*m", x=x,
    )  # fmt: skip
    return draw(y=y, low=y - band, high=y + band), draw(y=fit, low=fit, high=fit)


def _without(fitted: Hypothesis, mine: slice) -> Hypothesis:
    """Return a hypothesis in which an effect's numbers, `mine` of its values, do not move."""
    own = np.arange(len(fitted.z) + mine.start, len(fitted.z) + mine.stop)
    return replace(fitted, jacobian=np.delete(fitted.jacobian, own, axis=1))


def _inverse(bend: Floats) -> Floats:
    """Return the covariance of amounts; finite where a series shows nothing."""
    return np.asarray(np.linalg.inv(bend + 1e-9 * np.trace(bend) * np.eye(len(bend))))


def axis_of(effect: DictionaryEffect, values: Values, cells: Cells) -> tuple[Floats, str, str]:
    """Return what an effect depends on at each moment; waves and turns are laid over each other."""
    known = dict(zip((k.name for k in effect.shape.parameters), values, strict=True))
    if "radius_m" in known:
        away = variable("away", effect.shape.numbers(values), cells)
        return away, f"distance from ({known['x_m']:.2f}, {known['y_m']:.2f})", "m"
    if effect.shape.word == "position":
        way = known.get("way_rad", 0.0)
        x = cells.driven["x"] * math.cos(way) + cells.driven["y"] * math.sin(way)
        length = known.get("length_m")
        if length is None:
            return x, f"position towards {way:.2f} rad", "m"
        return np.mod(x, length), f"position within a wave towards {way:.2f} rad", "m"
    name, unit = _AXES[effect.shape.word]
    x = variable(name, effect.shape.numbers(values), cells)
    if name == "yaw":  # turns of the same heading fill the same bin
        x = np.arctan2(np.sin(x), np.cos(x))
    period = known.get("period_s")
    if period is not None:
        return np.mod(x, period), "time within a swing", unit
    return x, effect.shape.word, unit
