"""Levenberg-Marquardt over a timed elastic band: residuals, their derivatives, banded Cholesky.

A band is a row of states (x, y, yaw, speed, steering, time). Over one interval of dt the car drives
ds = (v0 + v1) / 2 dt at the mean steering angle, on an arc:

    yaw1 - yaw0                     = ds tan((steering0 + steering1) / 2) / wheelbase
    chord, along the mean yaw       = ds (1 - (yaw1 - yaw0)^2 / 24)
    chord, across the mean yaw      = 0

Everything is a residual: equations weigh most, a limit counts where it is passed, preferences
(time, nearness to the path, slow steering) weigh least. A residual touches one state or two
neighbours, so J'J has 12 diagonals beside the main one (durations of neighbouring intervals are
compared, which ties the times of three states), and a step takes time in proportion to the states.
Method and source: see `elastic_band`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Bools, Floats
from scm.vehicles.jit import array_kernel, kernel_function
from vehicle_agent.autonomy.grid_map import value_at

X, Y, YAW, SPEED, STEERING, TIME = range(6)
STATES = 6
TOUCHED = 3 * STATES  # variables of the states that one residual touches
WIDTH = 2 * STATES + 1  # of J'J's lower half: the times of three states, the rest of two

PLACE_M, TURN_RAD = 0.0005, 0.002  # deviations that cost 1: of an interval's equations,
SPEED_MPS, STEERING_RAD = 0.005, 0.005  # of limits of speed and steering, and of their rates,
CLEARANCE_M = 0.01  # of the room wanted,
PATH_M = 0.3  # from the path,
SERVO_RAD = 0.3  # steering in one interval, so that it turns no faster than it must,
SPACING_S = 0.5  # between the durations of neighbouring intervals
REVERSE = 1.2  # what a second backward costs; one forward costs 1
SHORTEST_S = 0.01  # added to dt below a root, whose slope has no end at 0

STEP = (0.1, 0.1, 0.3, 0.1, 0.3, 0.5)  # of each state variable, that costs 1 at a damping of 1
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 0.1, 1e-6, 1e9
CONVERGED = 1e-3  # of the cost, gained by a step
SHRINK, LEAST_S = 0.2, 1e-3  # part of an interval's duration that one step leaves at least, and s

HELD = 1e15  # added to the diagonal of variables that stay

Gears = NDArray[np.int64]


class Terms(NamedTuple):
    """What the residuals are made of besides the states.

    Attributes:
        wheelbase_m, steering_rad, rate_radps, speed_mps, reverse_mps, accel_mps2: Of `CarLimits`.
        discs_m: (c, 2) middles of discs that fill the car's edge, ahead of the rear axle and left.
        room_m: Wanted from a disc's middle to an obstacle.
        field_m: (rows, columns) clearance; `cell_m`, `x_m`, `y_m` as in `GridMap`.
        moving: (k, 5) x, y, vx, vy, radius at the band's beginning.
        end: (5,) pose to reach, and the deviations from it that cost 1, in place and in yaw.
        softness: 1, or more where equations and limits shall count less: stiff ones make a narrow
            curved valley, in which steps are short.
    """

    wheelbase_m: float
    steering_rad: float
    rate_radps: float
    speed_mps: float
    reverse_mps: float
    accel_mps2: float
    discs_m: Floats
    room_m: float
    field_m: Floats
    cell_m: float
    x_m: float
    y_m: float
    moving: Floats
    end: Floats
    softness: float


class Sums(NamedTuple):
    """J'J and J'r as residuals are added, and the slopes of the one at hand.

    Attributes:
        normal: (variables, WIDTH) lower half of J'J, [row, WIDTH - 1 + column - row].
        gradient: (variables,) J'r.
        slopes: (TOUCHED,) by the variables of a state and the next two.
        used: (TOUCHED,) which of them are not 0.
    """

    normal: Floats
    gradient: Floats
    slopes: Floats
    used: Gears


@kernel_function
def _clearance(terms: Terms, x: float, y: float) -> float:
    """Return how far a place is from obstacles; outside the map, minus the way in."""
    column, row = (x - terms.x_m) / terms.cell_m, (y - terms.y_m) / terms.cell_m
    i = min(max(row, 0.5), terms.field_m.shape[0] - 0.6)
    j = min(max(column, 0.5), terms.field_m.shape[1] - 0.6)
    outside = math.hypot(column - j, row - i) * terms.cell_m
    return value_at(terms.field_m, j, i) - outside


@kernel_function
def _add(sums: Sums, state: int, residual: float, scale: float) -> float:
    """Add a residual with the slopes at hand, clear these, and return what it costs.

    Args:
        sums: To add to.
        state: First one that it touches.
        residual: In its unit, as the slopes.
        scale: Residual that costs 1.
    """
    base, count, slopes, used, weight = state * STATES, 0, sums.slopes, sums.used, scale**-2
    for p in range(TOUCHED):
        if slopes[p] != 0.0:
            used[count] = p
            count += 1
    for j in range(count):
        p = used[j]
        row, slope = base + p, weight * slopes[p]
        sums.gradient[row] += slope * residual
        for k in range(j + 1):
            sums.normal[row, WIDTH - 1 + used[k] - p] += slope * slopes[used[k]]
    slopes[:] = 0.0
    return weight * residual * residual


@kernel_function
def _add_equations(a: Floats, b: Floats, i: int, terms: Terms, sums: Sums) -> float:
    """Add how an interval from state a to b misses the bicycle's motion; return the cost."""
    dt, v = b[TIME] - a[TIME], 0.5 * (a[SPEED] + b[SPEED])
    turn, mean = b[YAW] - a[YAW], 0.5 * (a[YAW] + b[YAW])
    bend = math.tan(0.5 * (a[STEERING] + b[STEERING])) / terms.wheelbase_m
    steeper = 0.5 * (1.0 / terms.wheelbase_m + bend * bend * terms.wheelbase_m)
    place, angle = terms.softness * PLACE_M, terms.softness * TURN_RAD
    dx, dy, way = b[X] - a[X], b[Y] - a[Y], v * dt
    cos, sin = math.cos(mean), math.sin(mean)
    along, across = cos * dx + sin * dy, cos * dy - sin * dx
    s, other = sums.slopes, STATES
    s[X], s[Y], s[other + X], s[other + Y] = sin, -cos, -sin, cos
    s[YAW] = s[other + YAW] = -0.5 * along
    cost = _add(sums, i, across, place)
    chord = 1.0 - turn * turn / 24.0
    s[X], s[Y], s[other + X], s[other + Y] = -cos, -sin, cos, sin
    s[YAW] = 0.5 * across - way * turn / 12.0
    s[other + YAW] = 0.5 * across + way * turn / 12.0
    s[SPEED] = s[other + SPEED] = -0.5 * dt * chord
    s[TIME], s[other + TIME] = v * chord, -v * chord
    cost += _add(sums, i, along - way * chord, place)
    s[YAW], s[other + YAW] = -1.0, 1.0
    s[SPEED] = s[other + SPEED] = -0.5 * dt * bend
    s[STEERING] = s[other + STEERING] = -way * steeper
    s[TIME], s[other + TIME] = v * bend, -v * bend
    return cost + _add(sums, i, turn - way * bend, angle)


@kernel_function
def _add_rate(
    a: Floats, b: Floats, i: int, kind: int, most: float, scale: float, sums: Sums
) -> float:
    """Add how far a state variable's rate, times the duration, passes its limit."""
    change = b[kind] - a[kind]
    over = abs(change) - most * (b[TIME] - a[TIME])
    if over <= 0.0:
        return 0.0
    s, sign = sums.slopes, math.copysign(1.0, change)
    s[kind], s[STATES + kind], s[TIME], s[STATES + TIME] = -sign, sign, most, -most
    return _add(sums, i, over, scale)


@kernel_function
def _add_preferences(
    states: Floats, gears: Gears, i: int, reference: Floats, terms: Terms, sums: Sums
) -> float:
    """Add the preferences for an interval: short, even, little steering, near the path."""
    a, b, gear, s, cost = states[i], states[i + 1], gears[i], sums.slopes, 0.0
    if gear != 0:
        s[STEERING], s[STATES + STEERING] = -1.0, 1.0
        cost += _add(sums, i, b[STEERING] - a[STEERING], SERVO_RAD)
    if gear != 0 and i + 1 < len(gears) and gears[i + 1] != 0:
        s[TIME], s[STATES + TIME], s[2 * STATES + TIME] = 1.0, -2.0, 1.0
        cost += _add(sums, i, a[TIME] - 2.0 * b[TIME] + states[i + 2, TIME], SPACING_S)
    root = math.sqrt(b[TIME] - a[TIME] + SHORTEST_S)
    s[TIME], s[STATES + TIME] = -0.5 / root, 0.5 / root
    cost += _add(sums, i, root, REVERSE**-0.5 if gear < 0 else 1.0)
    cos, sin = math.cos(reference[i + 1, YAW]), math.sin(reference[i + 1, YAW])
    s[X], s[Y] = -sin, cos
    beside = cos * (b[Y] - reference[i + 1, Y]) - sin * (b[X] - reference[i + 1, X])
    return cost + _add(sums, i + 1, beside, PATH_M)


@kernel_function
def _add_limits(a: Floats, i: int, gear: int, stands: bool, terms: Terms, sums: Sums) -> float:
    """Add how far a state's speed, in the gear's direction, and steering pass their limits."""
    forward, cost = gear * a[SPEED], 0.0
    most = terms.reverse_mps if gear < 0 else terms.speed_mps
    over = max(forward - most, 0.0) + min(forward, 0.0)
    if over != 0.0 and not stands:
        sums.slopes[SPEED] = gear
        cost += _add(sums, i, over, terms.softness * SPEED_MPS)
    over = abs(a[STEERING]) - terms.steering_rad
    if over > 0.0:
        sums.slopes[STEERING] = math.copysign(1.0, a[STEERING])
        cost += _add(sums, i, over, terms.softness * STEERING_RAD)
    return cost


@kernel_function
def _add_obstacles(a: Floats, i: int, terms: Terms, sums: Sums) -> float:
    """Add how much room the car's discs lack at a state, and at its time."""
    s, cost = sums.slopes, 0.0
    cos, sin = math.cos(a[YAW]), math.sin(a[YAW])
    for j in range(len(terms.discs_m)):
        ahead, beside = terms.discs_m[j]
        dx, dy = ahead * cos - beside * sin, ahead * sin + beside * cos
        x, y, cell = a[X] + dx, a[Y] + dy, terms.cell_m
        free = _clearance(terms, x, y)
        if free < terms.room_m:  # central differences: a slope without jumps
            gx = _clearance(terms, x + cell, y) - _clearance(terms, x - cell, y)
            gy = _clearance(terms, x, y + cell) - _clearance(terms, x, y - cell)
            gx, gy = 0.5 * gx / cell, 0.5 * gy / cell
            s[X], s[Y], s[YAW] = -gx, -gy, gx * dy - gy * dx
            cost += _add(sums, i, terms.room_m - free, CLEARANCE_M)
        for k in range(len(terms.moving)):
            vx, vy = terms.moving[k, 2], terms.moving[k, 3]
            away_x = x - terms.moving[k, 0] - vx * a[TIME]
            away_y = y - terms.moving[k, 1] - vy * a[TIME]
            apart = max(math.hypot(away_x, away_y), 1e-6)
            lack = terms.room_m + terms.moving[k, 4] - apart
            if lack > 0.0:
                gx, gy = away_x / apart, away_y / apart
                s[X], s[Y], s[YAW] = -gx, -gy, gx * dy - gy * dx
                s[TIME] = gx * vx + gy * vy
                cost += _add(sums, i, lack, CLEARANCE_M)
    return cost


@kernel_function
def _assembled(
    states: Floats, gears: Gears, held: Bools, reference: Floats, terms: Terms, sums: Sums
) -> float:
    """Fill J'J and J'r; return the cost: squares of all residuals."""
    sums.normal[:], sums.gradient[:], cost = 0.0, 0.0, 0.0
    speed, steering = terms.softness * SPEED_MPS, terms.softness * STEERING_RAD
    for i in range(len(gears)):
        a, b = states[i], states[i + 1]
        cost += _add_equations(a, b, i, terms, sums)
        cost += _add_rate(a, b, i, SPEED, terms.accel_mps2, speed, sums)
        cost += _add_rate(a, b, i, STEERING, terms.rate_radps, steering, sums)
        cost += _add_preferences(states, gears, i, reference, terms, sums)
        cost += _add_obstacles(b, i + 1, terms, sums)
        cost += _add_limits(b, i + 1, gears[i], held[i + 1, SPEED], terms, sums)
    for p in range(3):
        sums.slopes[p] = 1.0
        scale, missed = terms.end[3 + p // 2], states[-1, p] - terms.end[p]
        cost += _add(sums, len(gears), missed, scale)
    for i in range(len(states)):
        for p in range(STATES):
            if held[i, p]:
                sums.normal[i * STATES + p, WIDTH - 1] += HELD
                sums.gradient[i * STATES + p] = 0.0
    return cost


@kernel_function
def _solved(sums: Sums, damping: float, factor: Floats, column: Floats, step: Floats) -> bool:
    """Solve (J'J + damping / STEP^2) step = -J'r by Cholesky; False where it breaks down.

    Column by column: the innermost loop runs over neighbours in memory and sums nothing.
    """
    count, right = len(step), WIDTH - 1
    for r in range(count):
        for k in range(WIDTH):
            factor[r, k] = sums.normal[r, k]
        factor[r, right] += damping / STEP[r % STATES] ** 2
        step[r] = -sums.gradient[r]
    for c in range(count):
        if not factor[c, right] > 0.0:
            return False
        pivot, below = math.sqrt(factor[c, right]), min(WIDTH, count - c)
        factor[c, right] = pivot
        step[c] /= pivot
        for j in range(1, below):
            column[j] = factor[c + j, right - j] / pivot
            factor[c + j, right - j] = column[j]
        for j in range(1, below):
            if column[j] != 0.0:
                step[c + j] -= column[j] * step[c]
                for k in range(1, j + 1):
                    factor[c + j, right - j + k] -= column[j] * column[k]
    _substitute_back(factor, step)
    return True


@kernel_function
def _substitute_back(factor: Floats, step: Floats) -> None:
    """Solve factor' x = step in place."""
    for c in range(len(step) - 1, -1, -1):
        step[c] /= factor[c, WIDTH - 1]
        for j in range(1, min(WIDTH, c + 1)):
            step[c - j] -= factor[c, WIDTH - 1 - j] * step[c]


@kernel_function
def _moved(states: Floats, held: Bools, step: Floats, trial: Floats) -> None:
    """Write the states after a step; no interval shrinks to less than `SHRINK` of itself."""
    for i in range(len(states)):
        for p in range(STATES):
            trial[i, p] = states[i, p] + (0.0 if held[i, p] else step[i * STATES + p])
        if i > 0:
            before = states[i, TIME] - states[i - 1, TIME]
            change = step[i * STATES + TIME] - step[(i - 1) * STATES + TIME]
            trial[i, TIME] = trial[i - 1, TIME] + max(before + change, SHRINK * before, LEAST_S)


@array_kernel
def optimise(
    states: Floats, gears: Gears, held: Bools, reference: Floats, terms: Terms, steps: int
) -> tuple[Floats, float]:
    """Return the states after some steps of Levenberg-Marquardt, and their cost.

    Args:
        states: (n, 6) to begin from; stays as it is.
        gears: (n - 1,) +1 forward, -1 backward, 0: the car stands or comes to stand, and steers.
        held: (n, 6) what may not change.
        reference: (n, 3) pose of the path beside each state.
        terms: The rest; see there.
        steps: At most so many.
    """
    count = states.size
    now, trial, step = states.copy(), np.empty_like(states), np.empty(count)
    slopes, used = np.zeros(TOUCHED), np.empty(TOUCHED, np.int64)
    sums = Sums(np.empty((count, WIDTH)), np.empty(count), slopes, used)
    after_sums = Sums(np.empty((count, WIDTH)), np.empty(count), slopes, used)
    factor, column = np.empty((count, WIDTH)), np.empty(WIDTH)
    cost = _assembled(now, gears, held, reference, terms, sums)
    damping = FIRST_DAMPING
    for _ in range(steps):
        if _solved(sums, damping, factor, column, step):
            _moved(now, held, step, trial)
            after = _assembled(trial, gears, held, reference, terms, after_sums)
        else:
            after = math.inf
        if after < cost:
            gained = cost - after
            now, trial, cost = trial, now, after
            sums, after_sums = after_sums, sums
            damping = max(0.2 * damping, LEAST_DAMPING)
            if gained < CONVERGED * cost and damping < FIRST_DAMPING:
                break
        else:
            damping *= 5.0
            if damping > MOST_DAMPING:
                break
    return now, cost


@array_kernel
def rooms(states: Floats, terms: Terms) -> Floats:
    """Return how much more room each state has than it wants, least of all discs, (n, 2).

    Column 0: to what does not move; 1: to moving obstacles, each state at its time.
    """
    room = np.full((len(states), 2), np.inf)
    for i in range(len(states)):
        t, cos, sin = states[i, TIME], math.cos(states[i, YAW]), math.sin(states[i, YAW])
        for j in range(len(terms.discs_m)):
            ahead, beside = terms.discs_m[j]
            x = states[i, X] + ahead * cos - beside * sin
            y = states[i, Y] + ahead * sin + beside * cos
            room[i, 0] = min(room[i, 0], _clearance(terms, x, y) - terms.room_m)
            for k in range(len(terms.moving)):
                dx = x - terms.moving[k, 0] - t * terms.moving[k, 2]
                dy = y - terms.moving[k, 1] - t * terms.moving[k, 3]
                apart = math.hypot(dx, dy) - terms.moving[k, 4]
                room[i, 1] = min(room[i, 1], apart - terms.room_m)
    return room
