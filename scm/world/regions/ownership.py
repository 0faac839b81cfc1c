"""Which region owns which car: that of its place, and one for all that may touch one another.

    owner = region of the place of the lowest index in the car's group
    group = cars whose outlines, grown by the leeway on each side, overlap, directly or by others
    leeway = MARGIN_M + AHEAD_S * MAX_GAIN * speed of the fastest car of the city

Owners are decided from where all cars are at the end of a tick, and own from the next exchange to
the one after it: within `AHEAD_S` no two cars of two regions can touch. All regions know all
motions, so all come to the same result and none has to ask. The leeway is large enough since no
contact makes a car faster than `MAX_GAIN` times what struck it.
"""

import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.errors import RunError
from scm.geometry import Pose2
from scm.vehicles.jit import array_kernel, kernel_function
from scm.world.regions.cut import BAND_M, Cut, Regions
from scm.world.sweep import overlap_of

MARGIN_M = 0.01
MAX_GAIN = 2.0  # one hit, as of boxes in `contacts`
AHEAD_S = 0.04  # two ticks
NOBODY = -1


class CarsSeen(NamedTuple):
    """Cars of all regions, and what one region sees of them; all but `order` by vehicle index.

    Attributes:
        order: (n,) their indices, ascending.
        x, y, yaw: Of their rear axles.
        front: From there to the front bumper [m].
        size: Length and width [m].
        seen: Whether drivers of this region may have to look at the car; changes.
    """

    order: Ints
    x: Floats
    y: Floats
    yaw: Floats
    front: Floats
    size: Floats
    seen: Bools


class Ownership:
    """Who owns the cars of a city, as one of its regions sees it.

    Args:
        cut: The cut.
        number: Of this region.
        capacity: Of vehicle indices.
        look_m: How far beyond the region its drivers look; None: everywhere.

    Attributes:
        number: Of this region.
        visible: (rows, columns) which cells of the cut that is.
        owner: (capacity,) region that simulates each car now; -1: there is no such car.
        next: (capacity,) region that will after the next exchange.
        moved: How many cars have come or gone here.
        missed: Pairs of cars of two regions that were seen to overlap; the leeway was too small.
    """

    def __init__(self, cut: Cut, number: int, capacity: int, look_m: float | None) -> None:
        self.cut, self.number = cut, number
        self._look_m = look_m
        self.visible: Bools = self._visible_cells()
        self._home = cut.within(number, BAND_M)
        self.owner: Ints = np.full(capacity, NOBODY, np.int64)
        self.next: Ints = np.full(capacity, NOBODY, np.int64)
        self.moved = 0
        self.missed = 0

    def become(self, number: int) -> None:
        """Be another region from now on."""
        self.number = number
        self.visible = self._visible_cells()

    def _visible_cells(self) -> Bools:
        if self._look_m is None:
            return np.ones(self.cut.cells.shape, np.bool_)
        return self.cut.within(self.number, self._look_m)

    def reaches_far(self, x: Floats, y: Floats) -> bool:
        """Return whether this region has cars far beyond it, as of a queue over a cut.

        Args:
            x: Of the rear axles, by vehicle index; likewise `y`.
            y: See `x`.
        """
        own = np.flatnonzero((self.owner == self.number) | (self.next == self.number))
        left, low, edge = self.cut.frame.tolist()
        rows, columns = self._home.shape
        row = np.clip((y[own] - low) / edge, 0, rows - 1).astype(np.int64)
        column = np.clip((x[own] - left) / edge, 0, columns - 1).astype(np.int64)
        return not bool(self._home[row, column].all())

    def enter(self, index: int, pose: Pose2) -> bool:
        """Note a new car; return whether it is this region's."""
        region = self.cut.region_of(pose.x, pose.y)
        self.owner[index] = self.next[index] = region
        return region == self.number

    def leave(self, index: int) -> None:
        """Forget a car."""
        self.owner[index] = self.next[index] = NOBODY

    def decide(self, cars: CarsSeen, fastest_mps: float) -> None:
        """Decide who owns the cars next, and which of them its drivers may look at.

        Args:
            cars: All cars of the city, by ascending vehicle index; `seen` is written.
            fastest_mps: Speed of the fastest of them.

        Raises:
            RunError: when one is so fast that it may reach another region's cars unseen.
        """
        count = len(cars.order)
        leeway = MARGIN_M + AHEAD_S * MAX_GAIN * fastest_mps
        places, sizes = np.empty((count, 3)), np.empty((count, 2))
        regions: Ints = np.empty(count, np.int64)
        near: Bools = np.empty(count, np.bool_)
        frame, cut = self.cut.frame, self.cut
        widest = survey(
            frame, cut.cells, cut.near, self.visible, cars, places, sizes, regions, near
        )
        if 2.0 * (leeway + widest) > BAND_M:
            msg = f"regions: a car drives {fastest_mps:.1f} m/s, and may cross a cut unseen"
            raise RunError(msg)
        if near.any():
            head: Ints = np.zeros(1 << max(6, (2 * count - 1).bit_length()), np.int64)
            room, cell = np.zeros((3, count), np.int64), 2.0 * (widest + leeway)
            self.missed += group(
                regions, self.owner[cars.order], near, places, sizes, leeway, cell, head, room
            )
        self.next[cars.order] = regions


@array_kernel
def survey(
    frame: Floats, cells: Regions, near_cut: Bools, visible: Bools, cars: CarsSeen, places: Floats,
    sizes: Floats, regions: Ints, near: Bools,
) -> float:  # fmt: skip
    """Write where the cars' outlines are, and what the cut says of these places.

    Args:
        frame: Of the cut, as are `cells` and `near_cut`.
        cells: See `frame`.
        near_cut: See `frame`.
        visible: (rows, columns) what drivers of this region may look at.
        cars: The cars (n,); `seen` is written.
        places: (n, 3) gets x, y, yaw of the middles of their outlines.
        sizes: (n, 2) gets half lengths and half widths of these.
        regions: (n,) gets the regions of the places.
        near: (n,) gets whether another region is near.

    Returns:
        Half the diagonal of the largest outline [m].
    """
    rows, columns, widest = cells.shape[0], cells.shape[1], 0.0
    for i in range(cars.order.shape[0]):
        car = cars.order[i]
        length, width, yaw = 0.5 * cars.size[car, 0], 0.5 * cars.size[car, 1], cars.yaw[car]
        ahead = cars.front[car] - length
        x, y = cars.x[car] + ahead * math.cos(yaw), cars.y[car] + ahead * math.sin(yaw)
        places[i, 0], places[i, 1], places[i, 2] = x, y, yaw
        sizes[i, 0], sizes[i, 1] = length, width
        widest = max(widest, math.sqrt(length * length + width * width))
        row = int(min(max((y - frame[1]) / frame[2], 0.0), rows - 1.0))
        column = int(min(max((x - frame[0]) / frame[2], 0.0), columns - 1.0))
        regions[i], near[i] = cells[row, column], near_cut[row, column]
        cars.seen[car] = visible[row, column]
    return widest


@kernel_function
def gap_of(places: Floats, sizes: Floats, i: int, j: int, far: float) -> float:
    """Return how far two outlines are apart [m], at the least; below 0 they overlap.

    It is `far` where their middles are farther apart than that.
    """
    dx, dy = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
    if dx * dx + dy * dy >= far * far:
        return far
    ci, si = math.cos(places[i, 2]), math.sin(places[i, 2])
    cj, sj = math.cos(places[j, 2]), math.sin(places[j, 2])
    c, s = ci * cj + si * sj, ci * sj - si * cj
    x, y = ci * dx + si * dy, ci * dy - si * dx
    return -overlap_of(x, y, c, s, sizes[j, 0], sizes[j, 1], sizes[i, 0], sizes[i, 1])


@array_kernel
def group(
    regions: Ints, owner: Ints, near: Bools, places: Floats, sizes: Floats, leeway: float,
    cell: float, head: Ints, room: Ints,
) -> int:  # fmt: skip
    """Give all cars of a group that reaches over a cut the region of its first car.

    Groups are found from the cars near a cut; no other group reaches over one.

    Args:
        regions: (n,) of the cars' places; changes.
        owner: (n,) who owns them now.
        near: (n,) whether a cut is near.
        places: (n, 3) x, y, yaw.
        sizes: (n, 2) half lengths and widths.
        leeway: Of each outline on each side.
        cell: Edge of a cell, twice the reach of the largest.
        head: Room to work in, a power of two long.
        room: (3, n) likewise: next in a cell, cars of a group, and which were found.

    Returns:
        How often two cars of different owners overlap.
    """
    after, queue, found = room[0], room[1], room[2]
    sort_into_cells(places, cell, head, after)
    missed = 0
    for seed in range(places.shape[0]):
        if not near[seed] or found[seed] > 0:
            continue
        queue[0], found[seed] = seed, 1
        done, count, first = 0, 1, seed
        while done < count:
            i = queue[done]
            done += 1
            first = min(first, i)
            for k in range(9):
                j = head[bucket_of(places, i, cell, k, head.shape[0])]
                while j >= 0:
                    gap = gap_of(places, sizes, i, j, cell) if j != i else cell
                    missed += int(gap < 0.0 and owner[i] != owner[j])
                    if gap < 2.0 * leeway and found[j] == 0:
                        queue[count], found[j] = j, 1
                        count += 1
                    j = after[j]
        region = regions[first]
        for k in range(count):
            regions[queue[k]] = region
    return missed


@kernel_function
def sort_into_cells(places: Floats, cell: float, head: Ints, after: Ints) -> None:
    """Link the cars of each cell: `head` has the last one, `after` the one before each."""
    for bucket in range(head.shape[0]):
        head[bucket] = -1
    for i in range(places.shape[0]):
        bucket = bucket_of(places, i, cell, 4, head.shape[0])
        after[i], head[bucket] = head[bucket], i


@kernel_function
def bucket_of(places: Floats, i: int, cell: float, k: int, size: int) -> int:
    """Return the bucket of one of the nine cells around a car; 4: its own."""
    column = math.floor(places[i, 0] / cell) + k % 3 - 1
    row = math.floor(places[i, 1] / cell) + k // 3 - 1
    return int((column * 73856093 ^ row * 19349663) & (size - 1))
