"""A drive driven again by many parameter sets at once: rows of one fleet, one compiled car.

The car has every known effect at its neutral numbers, which leave the motion as it was bit for
bit, so one kernel serves all hypotheses. Motion of the body contracts under recorded commands and
needs no restart; the pose does not, and is carried back to the measured one twice a second.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.geometry import Pose2
from scm.replay.drive import RUN_IN_S, STEP_S, Drive
from scm.replay.numbers import (
    MOTION_VARIABLES,
    STEERING_DELAY,
    TETHER_STEPS,
    THROTTLE_CLOCK,
    THROTTLE_DELAY,
    Change,
    Dependence,
    Numbers,
    changes_in,
    dependences_in,
)
from scm.replay.recorded_variables import VARIABLES
from scm.vehicles.car import Car
from scm.vehicles.compiler.vector_code import LANES, WIDTH
from scm.vehicles.fleet import SUBSTEP_S, Fleet
from scm.vehicles.fleet_rows import COG, WHEELS, pool, whole_steps
from scm.vehicles.jit import array_kernel
from scm.vehicles.term import reads
from scm.vehicles.vehicle_status import VehicleStatus

ROWS, THREADS = LANES, 2
COMMANDED = 10  # parts of a step, each with a command: a servo at its rate moves by when
REMEMBERED = 2  # of a car that remembers its commands: there each part costs a call from Python
FOLLOWED_STEPS = 5  # between two moments at which numbers follow a variable
WHEEL_ANGLES = slice(6, 10)  # of these
_LATE = (THROTTLE_DELAY, STEERING_DELAY, THROTTLE_CLOCK)
_Used = TypeVar("_Used")


@dataclass(frozen=True, slots=True)
class Motions:
    """What each parameter set did, on the drive's edges, (steps + 1, sets).

    Attributes:
        ok: Whether the car stayed within physical bounds, (sets,).
    """

    variables: Mapping[str, Floats]
    ok: Bools

    def __getitem__(self, name: str) -> Floats:
        return self.variables[name]

    def of(self, columns: Sequence[int]) -> "Motions":
        """Return the motions in these columns, each as often as it is named."""
        if list(columns) == list(range(len(self.ok))):
            return self
        some = {name: variable[:, columns] for name, variable in self.variables.items()}
        return Motions(some, self.ok[columns])


class Tiles:
    """Fleets of one compiled car, a tile for each thread, that rollouts take turns with.

    Attributes:
        params: The car's numbers; `columns`: where each stands in a fleet, by key.
        smaller: Of the same car with fewer effects, for sets that name none of the others.
    """

    def __init__(self, car: Car, smaller: "Tiles | None" = None) -> None:
        self.car, self.smaller = car, smaller
        self.fleets = [Fleet(car, ROWS) for _ in range(THREADS)]
        self.params = tuple(column.param for column in self.fleets[0].columns)
        self.columns = {param.key: i for i, param in enumerate(self.params)}

    def __reduce__(self) -> tuple[type["Tiles"], tuple[Car, "Tiles | None"]]:
        return type(self), (self.car, self.smaller)  # fleets hold memory that is not theirs alone

    def enough_for(self, sets: Sequence[Numbers]) -> "Tiles":
        """Return the tiles of the smallest car that has all the numbers named."""
        if self.smaller is None:
            return self
        more = self.columns.keys() - self.smaller.columns.keys()
        return self if any(more & numbers.keys() for numbers in sets) else self.smaller


def shares_of(sets: int) -> list[list[range]]:
    """Return which sets each thread drives, tile by tile.

    A last tile without another beside it is cut in two, where each half is one vector of it.
    """
    tiles = [range(first, min(first + ROWS, sets)) for first in range(0, sets, ROWS)]
    if len(tiles) % THREADS == 1 and len(tiles[-1]) > WIDTH:
        last = tiles.pop()
        tiles += [last[:WIDTH], last[WIDTH:]]
    return [tiles[thread::THREADS] for thread in range(THREADS)]


class Rollouts:
    """Drives one recording again."""

    def __init__(self, drive: Drive, car: Car, tiles: Tiles | None = None) -> None:
        self.drive, self.car = drive, car
        self.tiles = tiles or Tiles(car)
        self.params = self.tiles.params
        smoothed, edges = drive.smoothed, drive.edges
        psi = smoothed["pose.yaw"].at(edges)
        px, py = drive.point
        c, s = np.cos(psi), np.sin(psi)
        self._x = smoothed["pose.x"].at(edges) - c * px + s * py
        self._y = smoothed["pose.y"].at(edges) - s * px - c * py
        self._yaw = psi
        self._blind = drive.is_blind(edges)
        self._turned = drive.turned
        self._integrals = dict[int, Floats]()

    def run(self, sets: Sequence[Numbers]) -> Motions:
        """Drive all parameter sets; each is nominal but for the numbers it names by key."""
        parts = self.each(sets, lambda motions, which: (motions, which))
        back = np.argsort(np.concatenate([which for _, which in parts]))
        together = {
            n: np.concatenate([p[n] for p, _ in parts], axis=1)[:, back] for n in MOTION_VARIABLES
        }
        return Motions(together, np.concatenate([p.ok for p, _ in parts])[back])

    def each(
        self, sets: Sequence[Numbers], use: Callable[[Motions, Sequence[int]], _Used]
    ) -> list[_Used]:
        """Drive all parameter sets, a tile at a time; return what `use` makes of each.

        Motions of many sets are large: what is read of them is better read where they are made.
        Sets that differ only in faults of measurement share one.

        Args:
            sets: Numbers by key.
            use: Is called on all threads, with motions and which sets they are of. What it raises
                is raised here, once no thread drives any more.
        """
        moving = [self._moving(numbers) for numbers in sets]
        places = {one: k for k, one in enumerate(dict.fromkeys(moving))}
        at = [places[one] for one in moving]
        different = [dict(one) for one in places]
        shares = shares_of(len(different))

        def share(thread: int) -> list[_Used]:
            found = list[_Used]()
            for tile in shares[thread]:
                mine = [i for i, k in enumerate(at) if k in tile]
                motions = self._run(thread, different[tile.start : tile.stop])
                found.append(use(motions.of([at[i] - tile.start for i in mine]), mine))
            return found

        others = pool(THREADS).map(share, [k for k in range(1, THREADS) if shares[k]])
        try:
            mine = share(0)
        finally:  # whatever `use` raised, the fleets are free again
            rest = [one for other in others for one in other]
        return [*mine, *rest]

    def _moving(self, numbers: Numbers) -> tuple[tuple[str, float], ...]:
        """Return the numbers that a car's motion depends on."""
        known = self.tiles.columns
        return tuple(
            (k, v)
            for k, v in numbers.items()
            for of in (k.partition("@")[0],)
            if of in known or of in _LATE
        )

    def _run(self, thread: int, sets: Sequence[Numbers]) -> Motions:
        tiles = self.tiles.enough_for(sets)
        fleet = tiles.fleets[thread]
        n, edges, tether = len(sets), self.drive.edges, _Tether(fleet)
        delays = self._set(fleet, tiles.columns, sets)
        starts = range(0, len(edges) - 1, TETHER_STEPS)
        stretches = edges[[*starts, len(edges) - 1]]
        changing = _Changing(fleet, tiles.columns, delays, list(changes_in(sets)), stretches)
        following = _Following(fleet, tiles, self._followed, list(dependences_in(sets)))
        every = FOLLOWED_STEPS if following else TETHER_STEPS
        changing.set(-1)
        parts = tether.parts
        self._begin(fleet, n, delays, parts)
        changes = np.linspace(edges[0], edges[-1], parts * (len(edges) - 1) + 1)
        out, first = np.empty((len(edges), len(MOTION_VARIABLES), fleet.capacity)), _now(fleet)
        for k, name in enumerate(MOTION_VARIABLES):
            out[0, k] = first[name]
        tether.roll(n, out[:0], self._turned[0])
        for stretch, a in enumerate(starts):
            b = min(a + TETHER_STEPS, len(edges) - 1)
            changing.set(stretch)
            if self.drive.battery is not None:
                fleet.battery[:n] = self.drive.battery[a]
            for begin in range(a, b, every):
                end = min(begin + every, b)
                following.set(begin, end)
                commands = self._commands(changes[parts * begin : parts * end + 1], delays)
                tether.rollout(*commands, out[begin + 1 : end + 1])
            if not self._blind[b]:
                tether.carry(n, self._x[b], self._y[b], self._yaw[b])
            tether.roll(n, out[a + 1 : b + 1], self._turned[b])
        ok = fleet.status[:n] == VehicleStatus.OK
        return Motions({name: out[:, k, :n] for k, name in enumerate(MOTION_VARIABLES)}, ok)

    def _followed(self, variable: int) -> Floats:
        """Return the integral of a recorded variable up to each edge, (steps + 1,)."""
        if variable not in self._integrals:
            curve = VARIABLES[variable].curve(self.drive)
            self._integrals[variable] = np.append(0.0, np.cumsum(curve[:-1]))
        return self._integrals[variable]

    def _set(self, fleet: Fleet, columns: Mapping[str, int], sets: Sequence[Numbers]) -> Floats:
        """Give each row its numbers; return the commands' delays, (2, rows)."""
        delays = np.zeros((2, fleet.capacity))
        for row in range(fleet.capacity):
            fleet.remove(row)
        fleet.add(Pose2(self._x[0], self._y[0], self._yaw[0]))
        fleet.copy_row(0, slice(1, len(sets)))
        for row, numbers in enumerate(sets):
            for key, value in numbers.items():
                if key in _LATE:
                    delays[int(key == STEERING_DELAY), row] += value
                elif "@" not in key:
                    fleet.parameters[row, columns[key]] = value
        return delays

    def _commands(self, edges: Floats, delays: Floats) -> tuple[Floats, Floats]:
        """Return what each row is commanded between these times, late by its delays."""
        throttle, steering = self.drive.throttle, self.drive.steering
        return throttle.means(edges, delays[0]), steering.means(edges, delays[1])

    def _begin(self, fleet: Fleet, n: int, delays: Floats, parts: int) -> None:
        """Start every row in the measured motion, its actuators run in by the commands before."""
        drive = self.drive
        part_s = STEP_S / parts
        before = drive.edges[0] + part_s * np.arange(-round(RUN_IN_S / part_s), 1)
        fleet.rollout(*self._commands(before, delays), part_s, ())
        x, y, yaw = (drive.smoothed[f"pose.{n}"] for n in ("x", "y", "yaw"))
        psi = float(self._yaw[0])
        vx, vy = float(x.rate[0]), float(y.rate[0])
        c, s = np.cos(psi), np.sin(psi)
        pose = Pose2(float(self._x[0]), float(self._y[0]), psi)
        for row in range(n):
            fleet.place(row, pose, c * vx + s * vy, 0.0, float(yaw.rate[0]), keep_actuators=True)


class _Changing:
    """Numbers of a fleet's rows that change while they drive, by stretches between `edges`."""

    def __init__(
        self,
        fleet: Fleet,
        columns: Mapping[str, int],
        delays: Floats,
        changes: Sequence[Change],
        edges: Floats,
    ) -> None:
        self._each = list[tuple[Floats, tuple[int, int], Floats]]()
        for change in changes:
            late = change.key in _LATE
            place = (
                (int(change.key == STEERING_DELAY), change.column)
                if late
                else (change.column, columns[change.key])
            )
            array = delays if late else fleet.parameters
            starts = np.append(edges[0], edges[:-1])  # before the first stretch: as it begins
            left = 1.0 - change.done(starts, np.append(edges[0], edges[1:]))
            numbers = float(array[place]) + left * (change.before - change.after)
            self._each.append((array, place, numbers))

    def set(self, stretch: int) -> None:
        """Set the numbers to their means over a stretch; -1: to those at the beginning."""
        for array, place, numbers in self._each:
            array[place] = numbers[stretch + 1]


class _Following:
    """Numbers of a fleet's rows that follow a recorded variable while they drive."""

    def __init__(
        self,
        fleet: Fleet,
        tiles: Tiles,
        followed: Callable[[int], Floats],
        dependences: Sequence[Dependence],
    ) -> None:
        self._parameters = fleet.parameters
        self._each = list[tuple[Dependence, int, tuple[float, float], Floats]]()
        for one in dependences:
            column = tiles.columns[one.key]
            integral = followed(one.variable) / one.at
            self._each.append((one, column, tiles.params[column].bounds, integral))

    def __bool__(self) -> bool:
        return bool(self._each)

    def set(self, first: int, last: int) -> None:
        """Set the numbers to their means over a stretch of steps, within what a car file allows."""
        for one, column, (low, high), integral in self._each:
            share = float(integral[last] - integral[first]) / (last - first)
            number = one.before + share * (one.after - one.before)
            self._parameters[one.column, column] = min(max(number, low), high)


class _Tether:
    """Drives a fleet's rows stretch by stretch, and carries them to the measured pose between.

    It is what `Fleet.rollout`, `planar_cogs` and `push_rows` do, without their checks and copies.

    Attributes:
        parts: Of a step, with a command each.
    """

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        self._kernel, places = fleet._kernel, fleet._offsets  # noqa: SLF001 its innermost loop
        self._state = (fleet._block, fleet._numbers, fleet._alive, fleet._status)  # noqa: SLF001
        self._cog = np.array([places[n][0] for n in (*COG, "x", "y")], dtype=np.int64)
        self._saved = np.array([fleet._offset_of(n) for n in MOTION_VARIABLES])  # noqa: SLF001
        self._remembers = fleet.history is not None
        self.parts = REMEMBERED if self._remembers else COMMANDED
        self._steps = whole_steps(STEP_S / self.parts, SUBSTEP_S)
        self._by_turn = any("wheel_angle" in reads(term.function) for term in fleet.car.terms)
        self._moved = np.zeros((4, fleet.capacity))

    def rollout(self, throttle: Floats, steering: Floats, out: Floats) -> None:
        """Drive all rows through commands, (parts, rows); write steps' variables."""
        if self._remembers:
            got = self._fleet.rollout(throttle, steering, STEP_S / self.parts, MOTION_VARIABLES)
            for k, name in enumerate(MOTION_VARIABLES):
                out[:, k] = got[name][self.parts - 1 :: self.parts]
            return
        self._kernel.rollout(
            *self._state, 0, self._fleet.capacity, self._steps, SUBSTEP_S, throttle, steering,
            self._saved, out,
        )  # fmt: skip

    def carry(self, n: int, x: float, y: float, yaw: float) -> None:
        """Carry the first rows to a measured pose; their motion in their own frames stays."""
        block, _, _, status = self._state
        _carry(block, status, self._cog, n, x, y, yaw)
        self._kernel.advance(*self._state, 0, self._fleet.capacity, 0, SUBSTEP_S)

    def roll(self, n: int, out: Floats, turned: Floats) -> None:
        """Turn the first rows' wheels as far as measured, left and right [rad].

        Only where an effect depends on it. Steps' variables, `out`, go on as if nothing had been.
        """
        if not self._by_turn:
            return
        out[:, WHEEL_ANGLES] -= self._moved
        angles = self._fleet.wheel_angle[:n]
        more = turned - angles[:, 2:]
        angles += np.tile(more, 2)
        self._moved[:, :n] += np.tile(more, 2).T


@array_kernel
def _carry(
    block: Floats, status: Ints, places: Ints, n: int, x: float, y: float, yaw: float
) -> None:
    cog_x, cog_y, heading, vx, vy, _, rear_x, rear_y = places
    for row in range(n):
        if status[row] != 0:
            continue
        turn = yaw - block[heading, row]
        turn = np.arctan2(np.sin(turn), np.cos(turn))
        c, s = np.cos(turn), np.sin(turn)
        arm_x = block[cog_x, row] - block[rear_x, row]
        arm_y = block[cog_y, row] - block[rear_y, row]
        fast, side = block[vx, row], block[vy, row]
        block[vx, row] += c * fast - s * side - fast
        block[vy, row] += s * fast + c * side - side
        block[cog_x, row] += x + c * arm_x - s * arm_y - block[cog_x, row]
        block[cog_y, row] += y + s * arm_x + c * arm_y - block[cog_y, row]
        block[heading, row] += turn


def _now(fleet: Fleet) -> dict[str, Floats]:
    """Return every variable of a fleet's cars as they are."""
    wheel = dict(zip(WHEELS, fleet.wheel_angle.T, strict=True))
    return {s: wheel[s[-2:]] if "." in s else getattr(fleet, s) for s in MOTION_VARIABLES}
