"""Bands, and how they begin: from a path's pieces, from the band before, spaced evenly in time."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from vehicle_agent.autonomy.band_solver import SPEED, STATES, STEERING, TIME, YAW, Gears
from vehicle_agent.autonomy.plan import CarLimits, Path, Trajectory

PASSED_M = 0.005  # poses less far ahead count as passed
INTERVAL_S, INTERVALS = 0.15, 70  # duration wanted; at most about so many
SPACING_M, LEAST_INTERVALS = 0.03, 3  # of a first guess; of a piece
STANDS_MPS = 0.02  # states slower than that may be where the car waits
ROLLS_MPS = 0.005  # a car slower than that stands
LATE_MPS = 0.02  # 1 s beside its time counts as that far from a state
SLOW_MPS = 0.02  # taken for slower cars, to guess when they are at the next state
SHORT_S = 0.02  # of a first guess of an interval


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Part of a path in one gear: poses (n, 3), and +1 forward or -1 backward."""

    poses: Floats
    gear: int

    @property
    def along_m(self) -> Floats:
        """Way to each pose from the first."""
        steps = np.hypot(*np.diff(self.poses[:, :2], axis=0).T)
        return np.concatenate(((0.0,), np.cumsum(steps)))


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """States (n, 6), the gear of each interval (n - 1,), 0: standing, and the cost."""

    states: Floats
    gears: Gears
    cost: float = math.inf

    @property
    def pieces(self) -> Gears:
        """Number of the piece that each state belongs to, (n,)."""
        return np.concatenate(((0, 0), np.cumsum(self.gears[1:] == 0)))


def rest(pieces: Sequence[Piece], start: Floats) -> Iterator[Piece]:
    """Yield pieces from a state on, the first without what lies behind, their yaw without jumps."""
    last = start[:3]
    for number, piece in enumerate(pieces):
        poses = piece.poses
        if number == 0:
            before = ahead_of(start, poses[:-1], piece.gear) < PASSED_M
            poses = poses[int(np.argmin(np.append(before, False))) :]
        poses = np.vstack((last, poses[number > 0 :]))
        poses[:, YAW] = np.unwrap(poses[:, YAW])
        last = poses[-1]
        yield Piece(poses, piece.gear)


def pieces_of(path: Path) -> list[Piece]:
    """Return a path's pieces between cusps."""
    cusps = np.flatnonzero(np.diff(path.gears[1:])) + 1
    edges = (0, *cusps, len(path.poses) - 1)
    return [Piece(path.poses[a : b + 1], int(path.gears[b])) for a, b in itertools.pairwise(edges)]


def trajectory_of(band: Band) -> Trajectory:
    """Return a band as a trajectory; its yaw runs on past pi, so that it can be interpolated."""
    states = band.states
    return Trajectory(
        times_s=states[:, TIME].copy(), poses=states[:, :3].copy(),
        speeds_mps=states[:, SPEED].copy(), steering_rad=states[:, STEERING].copy(),
    )  # fmt: skip


def ahead_of(start: Floats, poses: Floats, gear: int) -> Floats:
    """Return how far poses lie in the direction of travel from a state, (n,) [m]."""
    along = np.cos(start[YAW]) * (poses[:, 0] - start[0])
    return np.asarray(gear * (along + np.sin(start[YAW]) * (poses[:, 1] - start[1])))


def apart(poses: Floats, start: Floats) -> Floats:
    """Return squares of how far poses are from a state; 1 rad counts as 0.1 m."""
    turn = np.remainder(poses[:, YAW] - start[YAW] + math.pi, math.tau) - math.pi
    return np.asarray(((poses[:, :2] - start[:2]) ** 2).sum(axis=1) + (0.1 * turn) ** 2)


def guessed(ahead: Sequence[Piece], start: Floats, stops: bool, limits: CarLimits) -> Band:
    """Return the path's pieces as a band: at full speed, but for where it starts and stops."""
    rows: list[Floats] = []
    gears: list[int] = []
    spacing = max(SPACING_M, sum(piece.along_m[-1] for piece in ahead) / INTERVALS)
    for number, piece in enumerate(ahead):
        along, length = piece.along_m, piece.along_m[-1]
        count = max(math.ceil(length / spacing), LEAST_INTERVALS)
        at = np.linspace(0.0, length, count + 1)
        part = np.zeros((count + 1, STATES))
        for p in range(3):
            part[:, p] = np.interp(at, along, piece.poses[:, p])
        step = max(length / count, 1e-6)
        bend = np.diff(part[:, YAW]) / step * piece.gear
        steering = np.clip(
            np.arctan(limits.wheelbase_m * bend), -limits.steering_rad, limits.steering_rad
        )
        part[:, STEERING] = np.interp(np.arange(count + 1), np.arange(count) + 0.5, steering)
        most = limits.speed_mps if piece.gear > 0 else limits.reverse_mps
        fastest = np.full(count + 1, most)
        first = max(piece.gear * start[SPEED], 0.0) if number == 0 else 0.0
        last = 0.0 if stops or number < len(ahead) - 1 else most
        twice = 2.0 * limits.accel_mps2
        fastest = np.minimum(fastest, np.sqrt(first**2 + twice * at))
        fastest = np.minimum(fastest, np.sqrt(last**2 + twice * (length - at)))
        part[:, SPEED] = piece.gear * fastest
        took = step / np.maximum(0.5 * (fastest[1:] + fastest[:-1]), 0.01)
        part[1:, TIME] = np.cumsum(took)
        if rows:
            turn = abs(part[0, STEERING] - rows[-1][-1, STEERING])
            part[:, TIME] += rows[-1][-1, TIME] + turn / limits.steering_rate_radps + SHORT_S
            gears.append(0)
        gears += [piece.gear] * count
        rows.append(part)
    states = np.vstack(rows)
    states[0] = start
    return Band(states, np.array(gears))


def begun(band: Band, start: Floats, limits: CarLimits) -> Band:
    """Return a band that stops first, and may steer, where the car stands or rolls back."""
    if band.gears[0] == 0 or band.gears[0] * start[SPEED] > ROLLS_MPS:
        return band
    first, speed = start.copy(), abs(start[SPEED])
    first[:3] = _rolled(start, speed / limits.accel_mps2)
    first[SPEED], first[STEERING] = 0.0, band.states[1, STEERING]
    turn = abs(first[STEERING] - start[STEERING]) / limits.steering_rate_radps
    first[TIME] = max(turn, speed / limits.accel_mps2) + SHORT_S
    later = band.states[1:].copy()
    later[:, TIME] += first[TIME]
    return Band(np.vstack((start, first, later)), np.concatenate(((0,), band.gears)))


def _rolled(start: Floats, time_s: float) -> Floats:
    """Return the pose where a car comes to stand that brakes for a time, straight on."""
    way = 0.5 * start[SPEED] * time_s
    heading = np.array((math.cos(start[YAW]), math.sin(start[YAW]), 0.0))
    return np.asarray(start[:3] + way * heading)


def continued(band: Band, guess: Band, start: Floats, elapsed_s: float) -> Band | None:
    """Return a band from the car on, lengthened as the horizon moved; None where they do not fit.

    Which state the car is at, the place says, and where several lie there, the time.
    """
    states, gears = band.states, band.gears
    first = band.pieces == 0
    late = LATE_MPS * (states[first, TIME] - elapsed_s)
    now = int(np.argmin(apart(states[first], start) + late**2))
    coming = now + 1
    while coming < len(states) - 1 and gears[coming - 1] != 0 and gears[coming] != 0:
        ahead = ahead_of(start, states[coming : coming + 1], int(gears[coming - 1]))[0]
        if ahead > PASSED_M or abs(states[coming, SPEED]) < STANDS_MPS:
            break
        coming += 1
    own, theirs = band.pieces[-1], guess.pieces
    if coming >= len(states) or not (theirs == own).any():
        return None
    last = states[-1]
    same = np.flatnonzero(theirs == own)
    joint = int(same[np.argmin(apart(guess.states[same], last))])
    later, tail = states[coming:].copy(), guess.states[joint + 1 :].copy()
    later[:, YAW] += math.tau * np.round((start[YAW] - later[0, YAW]) / math.tau)
    to_go = states[coming, TIME] - elapsed_s
    if gears[coming - 1] != 0:
        speed = max(0.5 * abs(later[0, SPEED] + start[SPEED]), SLOW_MPS)
        to_go = math.hypot(*(later[0, :2] - start[:2])) / speed
    later[:, TIME] -= later[0, TIME] - max(to_go, SHORT_S)
    tail[:, TIME] += later[-1, TIME] - guess.states[joint, TIME]
    joined = np.vstack((start, later, tail))
    return Band(joined, np.concatenate((gears[coming - 1 :], guess.gears[joint:])))


def respaced(band: Band) -> Band:
    """Return a band with each piece's states equally far apart in time."""
    states, gears = band.states, band.gears
    wanted = max(INTERVAL_S, states[-1, TIME] / INTERVALS)
    edges = np.flatnonzero(np.diff(gears)) + 1
    rows, spaced = [states[:1]], []
    for a, b in itertools.pairwise((0, *edges, len(gears))):
        count, times = 1, states[a : b + 1, TIME]
        if gears[a] != 0:
            count = max(round((times[-1] - times[0]) / wanted), LEAST_INTERVALS)
        at = np.linspace(times[0], times[-1], count + 1)[1:]
        columns = [np.interp(at, times, states[a : b + 1, p]) for p in range(STATES)]
        rows.append(np.column_stack(columns))
        spaced += [int(gears[a])] * count
    return Band(np.vstack(rows), np.array(spaced), band.cost)
