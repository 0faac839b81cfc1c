"""Local planner: a timed elastic band along a path, round what stands or moves, as fast as allowed.

States of the car in a row, and when it is there, are moved until the squares of all residuals are
least (`band_solver`). Speed and steering are states too: so the present ones, the servo's rate and
standstill at a cusp are linear in the variables. Where the car changes direction two states share a
place: between them it stands, and may steer. Each piece between cusps keeps the path's gear.

Obstacles part the free space into classes that small steps do not leave. Where the path is blocked,
bands that pass on the left, on the right, and later, are tried too; the cheapest free one is taken,
the present class unless another is clearly cheaper.

Holds: no slip, obstacles keep their velocity, their times are known.
Source: Rösmann, Hoffmann, Bertram, "Kinodynamic trajectory optimization and control for car-like
robots", IROS 2017, and "Integrated online trajectory planning and optimization in distinctive
topologies", Robotics and Autonomous Systems 88, 2017. Speed and steering as states, the servo's
rate, standing at cusps and waiting bands are ours.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats
from scm.geometry import Pose2
from vehicle_agent.autonomy.band import (
    INTERVAL_S,
    SPACING_M,
    STANDS_MPS,
    Band,
    Piece,
    ahead_of,
    apart,
    begun,
    continued,
    guessed,
    pieces_of,
    respaced,
    rest,
    trajectory_of,
)
from vehicle_agent.autonomy.band_solver import (
    SHORTEST_S,
    SPEED,
    STATES,
    TIME,
    YAW,
    Terms,
    optimise,
    rooms,
)
from vehicle_agent.autonomy.grid_map import GridMap
from vehicle_agent.autonomy.plan import CarLimits, Path, Trajectory
from vehicle_agent.autonomy.trajectory_check import is_free

MARGIN_M, HORIZON_M = 0.02, 1.2
LEAST_REST_M = 0.3  # of the path beyond the horizon; less is planned as well
STUB_M = 0.15  # pieces cut shorter than that are left out or planned whole
SEARCH_M = 0.4  # along the path, for the pose beside the car
AT_CUSP_M = 0.015
Rounds = tuple[tuple[int, float], ...]  # steps of the optimiser, and softness
FIRST: Rounds = (
    (16, 8.0),
)  # of new bands; the `FOLLOWED` cheapest go on, one less beside a free one with
THEN: Rounds = ((16, 3.0), (16, 1.0))
FOLLOWED = 2
WARM: Rounds = ((8, 1.0), (6, 1.0))
END = {True: (0.006, 0.03), False: (0.15, 0.15)}  # deviation that costs 1: goal or cusp, or path
BEYOND_M = 0.05  # wanted more round moving obstacles, else the path counts as blocked,
SLACK_S = (-1.0, 0.0, 1.0)  # at these times besides those of the first guess
AT_TIME = np.eye(STATES)[TIME]
DISC_M = 0.03  # radius
RAMP_M, OFFSETS_M = 0.35, np.arange(0.05, 0.51, 0.05)  # of bands pushed aside
WAITS_S = (1.0, 2.0, 3.0, 5.0)
BEFORE_M = (0.1, 0.2, 0.3, 0.4)  # a blocked place, where bands wait
KEEP = 0.85  # another class must cost less than that of the present one


class Task(NamedTuple):
    """What a band is optimised for: the path ahead, whether the car stops there, the residuals."""

    ahead: Sequence[Piece]
    stops: bool
    terms: Terms


class ElasticBand:
    """Plans again and again along a path, each time from the band before.

    Attributes:
        candidates: The bands of other classes that the last call of `plan` compared, as
            trajectories; none where it went on with the band before.
    """

    def __init__(
        self, limits: CarLimits, margin_m: float = MARGIN_M, horizon_m: float = HORIZON_M
    ) -> None:
        """Set up without a path.

        Args:
            limits: Of the car.
            margin_m: Wanted between the car and obstacles.
            horizon_m: How far along the path to plan.
        """
        self._limits, self._margin_m, self._horizon_m = limits, margin_m, horizon_m
        self._discs_m = discs_of(limits)
        self._path: Path | None = None
        self._pieces: list[Piece] = []  # of the path, without what the car has passed
        self._band: Band | None = None
        self._t_s = 0.0  # when it began
        self.candidates: tuple[Trajectory, ...] = ()

    def plan(
        self,
        grid: GridMap,
        path: Path,
        pose: Pose2,
        speed_mps: float,
        steering_rad: float,
        moving: Floats,
        t_s: float,
    ) -> Trajectory:
        """Return how to drive on along a path; `is_free` says whether it may be driven.

        Its end may miss the path's: a car beside its goal needs another path.

        Args:
            grid: What stands.
            path: The same object as before while it is followed; another one begins anew.
            pose: Of the rear axle at `t_s`, map frame.
            speed_mps: Then, + forward.
            steering_rad: Then, of the front wheels, + left.
            moving: (k, 5) x, y [m], vx, vy [m/s] and radius [m] of each moving obstacle at `t_s`.
            t_s: By any clock that runs on from call to call.
        """
        start = np.array((*pose, speed_mps, steering_rad, 0.0))
        if path is not self._path:
            self._path, self._pieces, self._band = path, pieces_of(path), None
        self._pass(start)
        terms = self._terms(grid, moving)
        ahead, stops = self._ahead(start, terms)
        terms = terms._replace(end=np.array((*ahead[-1].poses[-1], *END[stops])))
        task = Task(ahead, stops, terms)
        guess = begun(guessed(ahead, start, stops, self._limits), start, self._limits)
        band = self._warm(guess, start, t_s)
        if band is not None:
            band = _optimised(band, task, WARM)
        blocked = _blocked(guess, terms, self._margin_m)
        free = band is not None and self._is_free(grid, band, moving)
        new: list[Band] = []
        if band is None or blocked.any() or not free:
            new = _new_bands(task, guess, blocked)
            bands = _followed(task, band, new[: FOLLOWED - free])
            band = self._first_free(grid, bands, moving)
        self.candidates = tuple(trajectory_of(one) for one in new)
        self._band, self._t_s = band, t_s
        return trajectory_of(band)

    def _is_free(self, grid: GridMap, band: Band, moving: Floats) -> bool:
        return is_free(grid, self._limits, trajectory_of(band), moving)

    def _first_free(self, grid: GridMap, bands: Iterator[Band], moving: Floats) -> Band:
        """Return the first band that is free; if none is, the first."""
        first = next(bands)
        if self._is_free(grid, first, moving):
            return first
        return next((band for band in bands if self._is_free(grid, band, moving)), first)

    def _warm(self, guess: Band, start: Floats, t_s: float) -> Band | None:
        """Return the last band from here on; None where there is none, or it does not fit."""
        if self._band is None:
            return None
        warm = continued(self._band, guess, start, t_s - self._t_s)
        return None if warm is None else begun(warm, start, self._limits)

    def _terms(self, grid: GridMap, moving: Floats) -> Terms:
        limits = self._limits
        return Terms(
            limits.wheelbase_m, limits.steering_rad, limits.steering_rate_radps,
            limits.speed_mps, limits.reverse_mps, limits.accel_mps2, self._discs_m,
            DISC_M + self._margin_m, grid.clearance_m, grid.cell_m, grid.x_m, grid.y_m,
            np.ascontiguousarray(moving, dtype=np.float64).reshape(-1, 5), np.zeros(5), 1.0,
        )  # fmt: skip

    def _pass(self, start: Floats) -> None:
        """Drop what the car has passed of the path, and of the band where it stands at a cusp."""
        piece, band = self._pieces[0], self._band
        end, next_band = piece.poses[-1], None
        if band is not None:
            cusps = np.flatnonzero(band.gears[1:] == 0) + 1
            if len(cusps):
                end = band.states[cusps[0]]
                next_band = Band(band.states[cusps[0] :], band.gears[cusps[0] :])
        away = math.hypot(*(end[:2] - start[:2]))
        past = ahead_of(start, end[None], piece.gear)[0] < AT_CUSP_M and away < STUB_M
        if len(self._pieces) > 1 and past and abs(start[SPEED]) < STANDS_MPS:
            del self._pieces[0]
            self._band, piece = next_band, self._pieces[0]
        near = piece.along_m < SEARCH_M
        passed = int(np.argmin(apart(piece.poses[near], start)))
        self._pieces[0] = replace(piece, poses=piece.poses[passed:])

    def _ahead(self, start: Floats, terms: Terms) -> tuple[list[Piece], bool]:
        """Return the path from the car to the horizon, and whether the car stops there."""
        left = self._horizon_m
        if sum(piece.along_m[-1] for piece in self._pieces) < left + LEAST_REST_M:
            left = math.inf
        ahead: list[Piece] = []
        for piece in rest(self._pieces, start):
            if ahead and left < STUB_M:
                break
            ahead.append(piece)
            along = piece.along_m
            if along[-1] > left + STUB_M:
                states = np.column_stack((piece.poses, np.zeros_like(piece.poses)))
                room = rooms(states, terms._replace(moving=np.empty((0, 5))))[:, 0]
                fits = np.flatnonzero((along >= left) & (room > 0.0))
                last = fits[0] if len(fits) else len(along) - 1
                ahead[-1] = replace(piece, poses=piece.poses[: last + 1])
                return ahead, bool(last == len(along) - 1)
            left -= along[-1]
        return ahead, True


def discs_of(limits: CarLimits) -> Floats:
    """Return middles of discs of `DISC_M` inside the outline, along its edges, (c, 2).

    They stand out nowhere, as the circles that cover a car do, by a third of its width in front.
    Of a corner they leave 0.4 radii, which the margin covers.
    """
    ahead = (limits.rear_m + DISC_M, limits.front_m - DISC_M)
    beside = (limits.right_m + DISC_M, limits.left_m - DISC_M)
    columns, rows = (
        np.linspace(*ends, max(math.ceil((ends[1] - ends[0]) / (2.0 * DISC_M)), 1) + 1)
        for ends in (ahead, beside)
    )
    x, y = (one.ravel() for one in np.meshgrid(columns, rows))
    edge = np.isin(x, ahead) | np.isin(y, beside)
    return np.column_stack((x, y))[edge]


def _new_bands(task: Task, guess: Band, blocked: Bools) -> list[Band]:
    """Return a new band of each class, roughly optimised, cheapest first."""
    new = [guess, *_variants(guess, blocked, task.terms)]
    return sorted((_optimised(one, task, FIRST) for one in new), key=_cost)


def _followed(task: Task, present: Band | None, new: Sequence[Band]) -> Iterator[Band]:
    """Yield the present band and new ones, cheapest first; new ones must be clearly cheaper.

    Where none of them is taken, the best ones follow once more, optimised further.
    """
    bands = [_optimised(one, task, THEN) for one in new]
    if present is not None:
        bands.append(replace(present, cost=KEEP * present.cost))
    bands.sort(key=_cost)
    yield from bands
    yield from (_optimised(one, task, WARM) for one in bands[:FOLLOWED])


def _cost(band: Band) -> float:
    return band.cost


def _optimised(band: Band, task: Task, rounds: Rounds) -> Band:
    """Return a band after rounds of optimising, its intervals made equally long before each."""
    for steps, softness in rounds:
        band = respaced(band)
        held, beside = _held(band, task.stops), _beside(band, task.ahead)
        band.states[1:, SPEED][held[1:, SPEED]] = 0.0
        terms = task.terms._replace(softness=softness)
        states, cost = optimise(band.states, band.gears, held, beside, terms, steps)
        band = Band(states, band.gears, cost - SHORTEST_S * len(band.gears))
    return band


def _held(band: Band, stops: bool) -> Bools:
    """Return which variables stay: all of the first state, and speeds where the car stands."""
    held = np.zeros(band.states.shape, dtype=bool)
    stands = np.flatnonzero(band.gears == 0)
    held[stands, SPEED] = held[stands + 1, SPEED] = True
    held[-1, SPEED] = stops
    held[0] = True
    return held


def _beside(band: Band, ahead: Sequence[Piece]) -> Floats:
    """Return the path's pose nearest to each state, in its piece, (n, 3)."""
    beside = np.empty((len(band.states), 3))
    for number, piece in enumerate(ahead):
        own = band.pieces == number
        x, y = (band.states[own, p, None] - piece.poses[:, p] for p in range(2))
        beside[own] = piece.poses[np.argmin(x * x + y * y, axis=1)]
    return beside


def _blocked(band: Band, terms: Terms, margin_m: float) -> Bools:
    """Return which states have discs in what stands, or about then near what moves, (n,)."""
    blocked = rooms(band.states, terms)[:, 0] < -margin_m
    for shift in SLACK_S if len(terms.moving) else ():
        blocked |= rooms(band.states + shift * AT_TIME, terms)[:, 1] < BEYOND_M
    return np.asarray(blocked)


def _variants(band: Band, blocked: Bools, terms: Terms) -> Iterator[Band]:
    """Yield bands that pass the first blocked place on the left, on the right, and later."""
    if not blocked.any():
        return
    states, pieces = band.states, band.pieces
    first = int(np.argmax(blocked))
    own = np.flatnonzero(pieces == pieces[first])
    last = int(own[blocked[own]][-1])
    gear = int(band.gears[max(first - 1, own[0])] or band.gears[first])
    along = Piece(states[:, :3], gear).along_m
    begin = min(max(along[first] - along[own[0]], SPACING_M), RAMP_M)
    end = min(max(along[own[-1]] - along[last], SPACING_M), RAMP_M)
    up = np.clip((along - along[first]) / begin + 1.0, 0.0, 1.0)
    down = np.clip((along[last] - along) / end + 1.0, 0.0, 1.0)
    ramps = (1.0 - np.cos(np.pi * up)) * (1.0 - np.cos(np.pi * down))
    bump = np.where(pieces == pieces[first], 0.25 * ramps, 0.0)
    slope = gear * np.gradient(bump) / np.maximum(np.gradient(along), 0.1 * SPACING_M)
    zone = slice(first, last + 1)
    for side in (1.0, -1.0):
        for offset in side * OFFSETS_M:
            moved = states.copy()
            moved[1:, 0] -= (offset * bump * np.sin(states[:, YAW]))[1:]
            moved[1:, 1] += (offset * bump * np.cos(states[:, YAW]))[1:]
            moved[1:, YAW] += np.arctan(offset * slope)[1:]
            if (rooms(moved[zone], terms) > 0.0).all():
                yield Band(moved, band.gears)
                break
    for wait, before in itertools.product(WAITS_S if len(terms.moving) else (), BEFORE_M):
        at = max(int(np.argmax(along > along[first] - before)), 1)
        waiting = _waiting(band, at, wait)
        if (rooms(waiting.states, terms)[1:, 1] > 0.0).all():
            yield waiting
            break


def _waiting(band: Band, at: int, wait_s: float) -> Band:
    """Return a band that stands for a time at one of its states."""
    count = math.ceil(wait_s / INTERVAL_S)
    standing = np.repeat(band.states[at : at + 1], count, axis=0)
    standing[:, SPEED] = 0.0
    standing[:, TIME] += np.linspace(0.0, wait_s, count)
    later = band.states[at + 1 :].copy()
    later[:, TIME] += wait_s
    gears = np.insert(band.gears, at, np.full(count - 1, band.gears[at - 1] or band.gears[at]))
    return Band(np.vstack((band.states[:at], standing, later)), gears)
