"""Where the error of a re-tuned car lies: which sensors show it, when, and where on the floor.

An effect's gain at a moment is how much better it explains the innovation there. A place counts
where its gain is beyond what chance gives the best of all places looked at.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.quality import Span
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.evidence import FreeRuns, Residual, without_pauses
from scm.mismatch.findings import Effect, Equation, Fit, Located, Place
from scm.mismatch.fit.fitter import TAIL, Fitter
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.validate.residuals import on_one_axis, residual_forces, sensor_residuals
from scm.replay.numbers import NEUTRAL

BLOCK_S = 2.5
CELLS = 8  # along the longer side of the floor
ALARM = 0.05
REST = 0.05  # of the gain may lie outside the places named
MOST_TIME = 0.4  # what acts for longer, or comes and goes, acts all the time
MOST_SPANS = 3
MOST_FLOOR = 0.35
NOISE_LOSS = 0.862  # mean loss of an innovation that is nothing but noise
MIN_STRAY_SHARE = 0.1  # of the error of free runs, to be reported
LEAST_SHARE = 0.03  # of a sensor in the gain, to be named
_OWN = {  # sensors by the keys of their faults
    "measure.gyro": "imu.gyro", "measure.accel": "imu.accel", "measure.imu": "imu.accel",
    "measure.speed": "speed", "measure.encoder": "encoder.", "wheel.radius": "encoder.",
    "measure.": "pose.",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Looked:
    """Where and when each innovation of all drives was measured, (events,)."""

    t: Floats
    x: Floats
    y: Floats
    stream: Ints
    names: tuple[str, ...]


def locate(
    retuned: Hypothesis, best: Hypothesis
) -> tuple[tuple[Located, ...], tuple[Residual, ...]]:
    """Return where the error that the effects of `best` explain lies, and what is left over.

    Args:
        retuned: The car with its own numbers refitted alone.
        best: The car with all effects found; with none, nothing is located.
    """
    model, numbers = best.model, best.numbers
    residuals = residual_forces(model.drives, model.car, {}, numbers)
    if not best.effects:
        return (), residuals
    gains, rest = _gains(retuned, best)
    looked = _looked(model)
    total = rest + sum(max(float(gain.sum()), 0.0) for gain in gains)
    located = [
        _located(effect, best.values[place], gain, looked, total)
        for (effect, place), gain in zip(best.each(), gains, strict=True)
        if gain.sum() > chance(1)
    ]
    shown = [name for one in located if one.equation is Equation.SENSOR for name in one.channels]
    faults = {key for effect in best.effects for key in _faults(effect)}
    if shown and faults:
        residuals = (*sensor_residuals(model, numbers, faults, shown), *residuals)
    return tuple(sorted(located, key=lambda one: -one.share_of_error)), residuals


def _faults(effect: Candidate) -> Iterator[str]:
    """Yield the keys of an effect's own faults of measurement."""
    yield from (parameter.key for parameter in effect.parameters if parameter.key in NEUTRAL)


def chance(places: int) -> float:
    """Return the gain that the best of so many places has by chance with 5 %, at most."""
    return 2.0 * math.log(places / ALARM)


def _gains(retuned: Hypothesis, best: Hypothesis) -> tuple[list[Floats], float]:
    """Return what each effect gains at each innovation, and what all of them leave beyond noise.

    An effect's gain is over the same car without it, its own numbers refitted.
    """
    model, own = best.model, len(best.z)
    fitter = Fitter(model, np.ones(len(model.t)))
    alone = retuned.z if len(best.effects) == 1 else best.z
    e, _ = model([best.numbers])
    after, jacobian, gains = _loss(e[:, 0]), best.jacobian[:, :own], list[Floats]()
    for i, (_, place) in enumerate(best.each()):
        effects = (*best.effects[:i], *best.effects[i + 1 :])
        values = np.delete(best.values, place)
        without = replace(best, effects=effects, z=alone, values=values, jacobian=jacobian)
        before, _ = model([without.numbers])
        base = replace(without, innovations=before[:, 0])
        (moved,) = fitter.begin(base, [(effects, values)])
        without_it = moved.innovations if np.isfinite(moved.score) else before[:, 0]
        gains.append(model.valid * (_loss(without_it) - after))
    events = float(model.valid.sum())
    rest = float((model.valid * after).sum()) - NOISE_LOSS * events - 2.0 * math.sqrt(events)
    return gains, max(rest, 0.0)


def _loss(e: Floats) -> Floats:
    return np.asarray(TAIL * np.log1p(e * e / TAIL))


def _looked(model: Likelihood) -> _Looked:
    """Return when, where and by which sensor each innovation was measured."""
    t, x, y, names = list[Floats](), list[Floats](), list[Floats](), list[str]()
    stream, moves = list[Ints](), on_one_axis(model.drives)
    for drive, whitener, move in zip(model.drives, model.whiteners, moves, strict=True):
        t.append(whitener.t + move)
        x.append(drive.smoothed["pose.x"].at(whitener.t))
        y.append(drive.smoothed["pose.y"].at(whitener.t))
        new = [name for name in drive.names if name not in names]
        names += new
        number = np.array([names.index(name) for name in drive.names])
        stream.append(number[whitener.stream])
    whole = [np.concatenate(parts) for parts in (t, x, y)]
    return _Looked(whole[0], whole[1], whole[2], np.concatenate(stream), tuple(names))


def _located(
    effect: Candidate, values: Floats, gain: Floats, looked: _Looked, total: float
) -> Located:
    share = max(float(gain.sum()), 0.0) / max(total, 1e-9)
    when = spans_of(gain, looked.t)
    where = _named(effect, values) or box_of(gain, looked.x, looked.y)
    return Located(
        equation=effect.equation,
        channels=_channels(effect, gain, looked),
        depends_on=effect.depends_on,
        when_s=when,
        where=where,
        share_of_error=min(share, 1.0),
    )


def _channels(effect: Candidate, gain: Floats, looked: _Looked) -> tuple[str, ...]:
    """Return the sensors that show an effect, most telling first.

    A filter that weighs sensors against each other blames whichever comes later; a fault of
    measurement is that of its own sensor.
    """
    per = np.bincount(looked.stream, weights=gain, minlength=len(looked.names))
    order = [looked.names[i] for i in np.argsort(-per)]
    own = tuple(
        next((start for key, start in _OWN.items() if parameter.key.startswith(key)), "")
        for parameter in effect.parameters
    )
    own = tuple(start for start in own if start and any(n.startswith(start) for n in order))
    if own:
        return tuple(name for name in order if name.startswith(own))
    least = max(chance(len(per)), LEAST_SHARE * float(gain.sum()))
    return tuple(looked.names[i] for i in np.argsort(-per) if per[i] > least)


def _strong(gain: Floats, places: int) -> Bools | None:
    """Return the places that hold an effect's gain; None where others hold some of it too."""
    held = gain > chance(places)
    rest = float(gain[~held].sum())
    few = rest <= max(chance(1), REST * float(gain.sum()))
    return held if held.any() and few else None


def spans_of(gain: Floats, t: Floats) -> tuple[Span, ...] | None:
    """Return the spans of time that hold a gain, (events,); None for all the time."""
    first, last = float(t.min()), float(t.max())
    blocks = max(int((last - first) / BLOCK_S), 2)
    cuts = np.linspace(first, last, blocks + 1)
    block = np.clip(np.searchsorted(cuts, t, side="right") - 1, 0, blocks - 1)
    per: Floats = np.bincount(block, weights=gain, minlength=blocks).astype(np.float64)
    held = _strong(per, blocks)
    if held is None or held.mean() > MOST_TIME:
        return None
    edges = np.diff(np.concatenate(([0], held.astype(np.int64), [0])))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    if len(begins) > MOST_SPANS:
        return None
    return tuple((float(cuts[a]), float(cuts[b])) for a, b in zip(begins, ends, strict=True))


def box_of(gain: Floats, x: Floats, y: Floats) -> Place | None:
    """Return the box on the floor that holds a gain, (events,); None for everywhere."""
    size = max(np.ptp(x), np.ptp(y)) / CELLS
    column, row = (((v - v.min()) / size).astype(np.int64) for v in (x, y))
    cell = column + (CELLS + 1) * row
    per: Floats = np.bincount(cell, weights=gain).astype(np.float64)
    seen = np.bincount(cell)
    held = _strong(per, int((seen > 0).sum()))
    if held is None:
        return None
    inside = held[cell]
    box = Place(
        x_m=(float(x[inside].min()), float(x[inside].max())),
        y_m=(float(y[inside].min()), float(y[inside].max())),
    )
    within = (
        (x >= box.x_m[0]) & (x <= box.x_m[1])
        & (y >= box.y_m[0]) & (y <= box.y_m[1])
    )  # fmt: skip
    return box if within.mean() <= MOST_FLOOR else None


def _named(effect: Candidate, values: Floats) -> Place | None:
    """Return the place that an effect's own numbers name."""
    known = {
        parameter.name: float(value)
        for parameter, value in zip(effect.parameters, values, strict=True)
    }
    if not {"x_m", "y_m", "radius_m"} <= known.keys():
        return None
    x, y, radius = known["x_m"], known["y_m"], known["radius_m"]
    return Place(x_m=(x - radius, x + radius), y_m=(y - radius, y + radius))


def since_changes(
    located: Sequence[Located], effects: Sequence[Effect], end_s: float,
    pauses: Sequence[tuple[float, float]] = (),
) -> tuple[Located, ...]:  # fmt: skip
    """Return what was located with its time, where effects began at a moment.

    Args:
        located: Of a part of the car each; its error is not always there if no effect of that part
            was there before.
        effects: That were found.
        end_s: Of the recording, on its clock.
        pauses: As `Evidence.pauses`: where something was located is known without them.
    """
    found = list[Located]()
    for one in located:
        began = [
            (effect.since_s.value, effect.until_s.value if effect.until_s else end_s)
            if effect.since_s and not effect.before
            else None
            for effect in effects
            if effect.equation is one.equation
        ]
        spans = [span for span in began if span is not None]
        is_late = one.when_s is None and bool(spans) and len(spans) == len(began)
        when_s = one.when_s
        if is_late:
            ends = min(since for since, _ in spans), max(until for _, until in spans)
            when_s = ((without_pauses(ends[0], pauses), without_pauses(ends[1], pauses)),)
        found.append(structs.replace(one, when_s=when_s))
    return tuple(found)


def strayed(runs: FreeRuns, fit: Fit) -> tuple[Located, ...]:
    """Return where the error of the free runs `after` lies, the larger part first.

    Args:
        runs: Of the re-tuned car.
        fit: Judged with them; noise of measuring alone is taken off by its floor.
    """
    floor_m = fit.confirm.noise_floor.get("position_m", 0.0)
    along, across = _along_and_across(runs)
    known: Bools = np.isfinite(along) & np.isfinite(across)
    if not known.any() or floor_m <= 0.0:
        return ()
    middle = runs.measured["x"].shape[1] // 2
    x, y = (runs.measured[name][:, middle] for name in ("x", "y"))
    known &= np.isfinite(x) & np.isfinite(y)
    t = runs.start_s + 0.5 * float(runs.t_s[-1])
    beyond = {
        equation: 2.0 * (apart[known] / floor_m) ** 2 - 1.0
        for equation, apart in ((Equation.DRIVE, along), (Equation.STEERING, across))
    }
    sums = {equation: max(float(gain.sum()), 0.0) for equation, gain in beyond.items()}
    total = sum(sums.values())
    located = [
        Located(
            equation=equation,
            channels=("pose.x", "pose.y"),
            depends_on=(),
            when_s=spans_of(beyond[equation], t[known]),
            where=box_of(beyond[equation], x[known], y[known]),
            share_of_error=mine / total,
        )
        for equation, mine in sums.items()
        if mine > MIN_STRAY_SHARE * total
    ]
    return tuple(sorted(located, key=lambda one: -one.share_of_error))


def _along_and_across(runs: FreeRuns) -> tuple[Floats, Floats]:
    """Return how far windows end along the recorded heading and across it [m]."""
    dx, dy = (runs.after[name][:, -1] - runs.measured[name][:, -1] for name in ("x", "y"))
    yaw = runs.measured["yaw"][:, -1]
    return np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
