"""An experiment laid out on the floor, its recording under an explanation, how far these differ.

They differ by the least that a wrong one leaves unexplained.

`lambda` is the smallest objective that an explanation reaches on a noise-free recording of another
one, its own numbers and the car's nominal parameters refitted (T-optimality); its root is in
standard deviations. Below 10 nobody can tell, from 25 on anybody.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scm.arrays import Bools, Floats
from scm.geometry import Pose2
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.experiment.manoeuvres import ROW_S, SIDEWAYS_M_S2, Manoeuvre, Pace
from scm.mismatch.fit.fitter import FARTHEST, SMALL, TAIL, Fitter
from scm.mismatch.fit.hypothesis import Hypothesis, numbers_of
from scm.mismatch.fit.likelihood import Likelihood, NominalParameter, Simulator
from scm.mismatch.fit.rollouts import Rollouts
from scm.mismatch.fit.sensor_prediction import Prediction
from scm.recording.read import Channel, Recording
from scm.replay.commands import FULL_SPEED
from scm.replay.drive import STEP_S, Drive
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet
from scm.vehicles.vehicle_status import VehicleStatus

SCALES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15)
LONGEST_S = 300.0
Numbers = Mapping[str, float]
Change = Callable[[Numbers, float], Numbers]
"""Turns a car's numbers into those on a changed experiment that starts with some heading [rad]."""
ROUNDS = 3


@dataclass(frozen=True, slots=True)
class Explanation:
    """An explanation: effects with their numbers, in the order of their knobs."""

    effects: tuple[Candidate, ...]
    values: Floats


@dataclass(frozen=True, slots=True)
class Leg:
    """One drive of an experiment.

    Attributes:
        change: What is done to the car or the floor first.
        turned: Whether it is driven across the direction in which it fits best.
    """

    build: Callable[[Pace], Manoeuvre]
    change: Change | None = None
    turned: bool = False


@dataclass(frozen=True, slots=True)
class Placed:
    """A leg that fits: its drive, where the car starts, and the room it takes [m]."""

    leg: Leg
    manoeuvre: Manoeuvre
    start: Pose2
    room: tuple[float, float]
    path: Floats

    def change(self, numbers: Numbers) -> Numbers:
        """Return a car's numbers on this leg."""
        return self.leg.change(numbers, self.start.yaw) if self.leg.change else numbers


def place(leg: Leg, car: Car, pace: Pace, explanations: Sequence[Numbers]) -> Placed | None:
    """Return a leg with the most throttle that keeps the car on the floor and upright."""
    scaled = [leg.build(replace(pace, throttle=round(s * pace.throttle, 3))) for s in SCALES]
    scaled = [manoeuvre for manoeuvre in scaled if manoeuvre.lasts_s < LONGEST_S]
    if not scaled:
        return None
    longest = max(round(w.lasts_s / STEP_S) for w in scaled) + 10
    commands = np.zeros((2, longest, len(scaled) * len(explanations)))
    for k, manoeuvre in enumerate(scaled):
        rows = np.repeat(manoeuvre.rows()[:, 1:], round(ROW_S / STEP_S), axis=0)[:longest]
        commands[:, : len(rows), k * len(explanations) : (k + 1) * len(explanations)] = rows.T[
            :, :, None
        ]
    changed = [leg.change(n, 0.0) if leg.change else n for n in explanations]
    path, ok = _driven(car, list(changed) * len(scaled), commands)
    for k, manoeuvre in enumerate(scaled):
        mine = slice(k * len(explanations), (k + 1) * len(explanations))
        if ok[mine].all():
            placed = _fitted_in(leg, manoeuvre, path[:, :, mine], pace)
            if placed is not None:
                return placed
    return None


def _driven(car: Car, sets: Sequence[Numbers], commands: Floats) -> tuple[Floats, Bools]:
    """Return x, y, yaw of cars from the origin, (3, steps + 1, sets), and which drove safely."""
    fleet = Fleet(car, len(sets))
    column = {c.param.key: i for i, c in enumerate(fleet.columns)}
    for numbers in sets:
        row = fleet.add(Pose2(0.0, 0.0, 0.0))
        for key, value in numbers.items():
            if key in column:
                fleet.parameters[row, column[key]] = value
    got = fleet.rollout(commands[0], commands[1], STEP_S, ("x", "y", "yaw", "accel_y"))
    path = np.zeros((3, len(commands[0]) + 1, len(sets)))
    path[0, 1:], path[1, 1:] = got["x"], got["y"]
    path[2, 1:] = np.unwrap(got["yaw"], axis=0)
    upright = np.array([s == VehicleStatus.OK for s in fleet.status[: len(sets)]])
    hard = np.percentile(np.abs(got["accel_y"]), 99, axis=0)
    return path, upright & (hard <= SIDEWAYS_M_S2)


def _fitted_in(leg: Leg, manoeuvre: Manoeuvre, path: Floats, pace: Pace) -> Placed | None:
    """Return where it starts so that all paths, and the car around them, are on the floor."""
    low, high = path[:2].min(axis=(1, 2)), path[:2].max(axis=(1, 2))
    room = high - low + 2.0 * pace.margin_m
    floor = pace.floor
    middle = np.array((sum(floor.x_m), sum(floor.y_m))) / 2.0
    ways = [
        yaw for yaw, size in ((0.0, room), (0.5 * np.pi, room[::-1]))
        if np.all(size <= np.array(floor.size) + 1e-9)
    ]  # fmt: skip
    if len(ways) <= int(leg.turned):
        return None
    yaw = ways[int(leg.turned)]
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array(((c, -s), (s, c)))
    x, y = middle - turn @ ((low + high) / 2.0)
    own = path[:, :, 0].copy()
    own[:2] = turn @ own[:2] + np.array(((x,), (y,)))
    own[2] += yaw
    return Placed(
        leg, manoeuvre, Pose2(float(x), float(y), yaw), (float(room[0]), float(room[1])), own
    )


def planned(model: Likelihood, legs: Sequence[Placed], truth: Numbers) -> Likelihood:
    """Return the likelihood of noise-free recordings of legs that nobody has made yet.

    Sensors, car and noise are those of a recording that was made; `truth` would drive the legs.
    """
    return Likelihood(_PlannedSimulator(model, legs, truth), model.noise)


class _PlannedSimulator(Simulator):
    """Drives legs that nobody has driven yet."""

    def __init__(self, model: Likelihood, legs: Sequence[Placed], truth: Numbers) -> None:
        self._legs = legs
        drives = list[Drive]()
        for leg in legs:
            blank = _imagined(model.drives[0], leg, None)
            seen = _read(blank, model, leg.change(truth))
            drives.append(_imagined(model.drives[0], leg, seen))
        super().__init__(drives, model.car, model.simulator.tiles)
        for drive, leg in zip(drives, legs, strict=True):
            _read(drive, model, leg.change(truth))

    def residuals(self, sets: Sequence[Numbers]) -> tuple[list[list[Floats]], Bools]:
        """Return residuals of every leg, each with what was changed for it."""
        self.runs += len(sets)
        found = [
            self.residuals_of(i, [leg.change(numbers) for numbers in sets])
            for i, leg in enumerate(self._legs)
        ]
        return [left for left, _ in found], np.all([ok for _, ok in found], axis=0)


def _read(drive: Drive, model: Likelihood, truth: Numbers) -> dict[str, Floats]:
    """Let a drive's sensors have read what this car would have done; return the values."""
    motions = Rollouts(drive, model.car, model.simulator.tiles).run([truth])
    residuals = Prediction(drive).residuals(motions, [truth])
    drive.streams = [
        replace(stream, values=stream.values - left[:, 0])
        for stream, left in zip(drive.streams, residuals, strict=True)
    ]
    return {stream.name: stream.values for stream in drive.streams}


def _imagined(like: Drive, leg: Placed, values: Mapping[str, Floats] | None) -> Drive:
    """Return a drive through a leg's commands with the streams of another recording."""
    car, rows = like.car, leg.manoeuvre.rows()
    times = STEP_S * np.arange(leg.path.shape[1])
    px, py = like.point
    c, s = np.cos(leg.path[2]), np.sin(leg.path[2])
    seen = {
        "pose.x": leg.path[0] + c * px - s * py,
        "pose.y": leg.path[1] + s * px + c * py,
        "pose.yaw": leg.path[2],
    }
    name, full = "command.throttle", 1.0
    if any(term.name == "speed_control" for term in car.terms):
        name, full = "command.speed", car.value(FULL_SPEED)
    channels = {
        name: Channel(rows[:, 0], full * rows[:, 1], None, (0.0, 0.0), "ratio"),
        "command.steering": Channel(rows[:, 0], rows[:, 2], None, (0.0, 0.0), "ratio"),
    }
    for stream in like.streams:
        pace = float(np.median(np.diff(stream.t)))
        t = np.arange(0.0, rows[-1, 0] + 0.5 * pace, pace)
        given = np.interp(t, times, seen.get(stream.name, np.zeros_like(times)))
        if values is not None:
            given = values[stream.name]
            t = t[: len(given)]
        point = like.point if stream.name.startswith("pose.") else (0.0, 0.0)
        channels[stream.name] = Channel(t, given, stream.std, point, "")
    return Drive(Recording(Path("planned"), like.recording.vehicle, channels), car)


@dataclass(frozen=True, slots=True)
class Separation:
    """How far explanations come apart, and with which numbers the wrong ones come nearest.

    Attributes:
        lambdas: Of the column's explanation where the row's is right, (explanations, explanations).
        z: The car's ordinary numbers then, (explanations, explanations, numbers).
        values: Of the explanation's effects, one array a pair.
    """

    lambdas: Floats
    z: Floats
    values: tuple[tuple[Floats, ...], ...]

    @property
    def least(self) -> float:
        """Lambda of the pair that comes apart least, whichever of them is right."""
        off = ~np.eye(len(self.lambdas), dtype=np.bool_)
        return float(self.lambdas[off].min())


def linear_separation(planned: Likelihood, explanations: Sequence[Explanation]) -> Separation:
    """Return how far explanations come apart by one linear refit of each.

    `planned` is of the first explanation's motion.
    """
    own, parameters = planned.nominal, [_parameters(r) for r in explanations]
    n, e = len(explanations), np.nan_to_num(planned(_sets(planned, explanations))[0])
    common = (e[:, n : n + len(own)] - e[:, :1]) / np.array([_side(o) for o in own])
    lambdas, z, at = np.zeros((n, n)), np.zeros((n, n, len(own))), n + len(own)
    values = list[list[Floats]]()
    for j, mine in enumerate(parameters):
        slopes = e[:, at : at + len(mine)] - e[:, j : j + 1]
        at += len(mine)
        jacobian = np.concatenate((common, slopes), axis=1)
        prior = np.concatenate((np.ones(len(own)), np.full(len(mine), 1e-6)))
        normal = jacobian.T @ jacobian + np.diag(prior)
        gaps = e[:, j : j + 1] - e[:, :n]
        moves = -np.linalg.lstsq(normal, jacobian.T @ gaps, rcond=1e-12)[0]
        lambdas[:, j] = _loss(gaps + jacobian @ moves) + prior @ (moves * moves)
        z[:, j] = np.clip(moves[: len(own)].T, -FARTHEST, FARTHEST)
        values.append([_moved(explanations[j], mine, move) for move in moves[len(own) :].T])
    np.fill_diagonal(lambdas, 0.0)
    return Separation(lambdas, z, tuple(zip(*values, strict=True)))


def refitted_separation(
    plan: Callable[[Explanation], Likelihood],
    explanations: Sequence[Explanation],
    start: Separation,
) -> Separation:
    """Return how far explanations come apart when each is refitted with all that is not linear.

    `plan` gives the recordings that a right explanation would leave. What the linear refit `start`
    could explain counts as explained.
    """
    lambdas = start.lambdas.copy()
    for i, right in enumerate(explanations):
        planned = plan(right)
        others = [j for j in range(len(explanations)) if j != i]
        none = np.zeros(0)
        fits = [
            Hypothesis(planned, explanations[j].effects, start.z[i, j], start.values[i][j],
                       none, 0.0, np.zeros((0, 0)))
            for j in others
        ]  # fmt: skip
        refined = Fitter(planned, np.ones(len(planned.t))).refine(fits, ROUNDS, fresh=True)
        for j, fitted in zip(others, refined, strict=True):
            lambdas[i, j] = min(lambdas[i, j], fitted.score)
    return Separation(lambdas, start.z, start.values)


def _sets(planned: Likelihood, explanations: Sequence[Explanation]) -> list[dict[str, float]]:
    """Return each explanation's numbers, then small steps of the car's own, then of every knob."""
    bases = [numbers_of(r.effects, r.values) for r in explanations]
    sets = list(bases)
    sets += [{**bases[0], o.key: o.mean + _side(o) * o.std} for o in planned.nominal]
    for explanation in explanations:
        for k, parameter in enumerate(_parameters(explanation)):
            values = np.array(explanation.values, dtype=np.float64)
            values[k] += _step(parameter, values[k])
            sets.append(numbers_of(explanation.effects, values))
    return sets


def _loss(e: Floats) -> Floats:
    return np.asarray((TAIL * np.log1p(e * e / TAIL)).sum(axis=0))


def _parameters(explanation: Explanation) -> list[Parameter]:
    return [parameter for effect in explanation.effects for parameter in effect.parameters]


def _side(nominal: NominalParameter) -> float:
    """Return a small step of an ordinary number that stays within its bounds."""
    o = nominal
    return -SMALL if o.mean + SMALL * o.std > o.bounds[1] else SMALL


def _step(parameter: Parameter, value: float) -> float:
    return (
        -0.5 * parameter.step
        if value + 0.5 * parameter.step > parameter.bounds[1]
        else 0.5 * parameter.step
    )


def _moved(explanation: Explanation, parameters: Sequence[Parameter], move: Floats) -> Floats:
    """Return an explanation's values moved by so many of the small steps, within their bounds."""
    values = np.array(explanation.values, dtype=np.float64)
    for k, parameter in enumerate(parameters):
        values[k] += move[k] * _step(parameter, values[k])
        values[k] = min(max(values[k], parameter.bounds[0]), parameter.bounds[1])
    return values
