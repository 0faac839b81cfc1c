"""Lights of many worlds, by a fixed cycle that begins anywhere, and what each car sees of them.

    stage after stage    green as long as the map says, else 8 s; then yellow 1 s; then all red 1 s

The cycle is short of what the city's own signals do: they follow plans and a kernel that guards
them (`scm/traffic`). A car passes red when its front is over the line while neither green nor
yellow shows.
"""

from collections.abc import Iterator

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.records.city_map import CityMap, Junction
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.drivers.driver_state import DONE, HERE, WINDOW_SIZE, DriverState, S
from scm.vehicles.drivers.lane_graph import GROUP, LaneArrays
from scm.vehicles.jit import array_kernel

GREEN_S, YELLOW_S, CLEAR_S = 8.0, 1.0, 1.0
REACH_M = 3.0  # lines farther ahead are not seen
TO_LINE_M, IS_GREEN, CHANGE_S, PASSED_RED = range(4)
"""Of each car: way of its front to the line ahead [m], 1 if that shows green, when that changes
[s], 1 if it passed a line at red in this step."""


class Cycles(ArrayStruct):
    """The cycles of all groups.

    Attributes:
        times: (groups, 3) length of the cycle, begin and end of green in it [s].
        junction: (groups,) number of each one's junction.
    """

    times: Floats
    junction: Ints


class Signals:
    """The lights of all worlds.

    Args:
        city_map: With its junctions.
        rows: How many cars.
        front_m: From their rear axle to their front.

    Attributes:
        known: Of each car, the columns above, (rows, 4).
    """

    def __init__(self, city_map: CityMap, rows: int, front_m: float) -> None:
        junctions = enumerate(city_map.junctions)
        found = [one for number, junction in junctions for one in _cycle(junction, number)]
        times = np.array([one[1:] for one in found], np.float64).reshape(-1, 3)
        self._cycles = Cycles(times, np.array([one[0] for one in found], np.int64))
        self._front_m = front_m
        self._line: Floats = np.full((rows, 2), np.inf)  # where the next is, and its group
        self._shares: Floats = np.zeros(rows)
        self.known: Floats = np.zeros((rows, 4))

    def begin(self, rows: Ints, shares: Floats) -> None:
        """Let episodes begin; at which share of their cycle, (n,)."""
        self._shares[rows] = shares
        self._line[rows] = np.inf

    def look(
        self, lanes: LaneArrays, state: DriverState, rows: Ints, now_s: Floats, present: Bools
    ) -> None:
        """Find what some cars (n,) see now, `now_s` (rows,) after their episode began."""
        _look(
            lanes, state, rows, self._cycles, self._front_m, now_s, self._shares, present,
            self._line, self.known,
        )  # fmt: skip


def _cycle(junction: Junction, number: int) -> Iterator[tuple[float, ...]]:
    """Yield junction, cycle, and begin and end of green of each of its groups, in their order."""
    stages = [(one.groups, one.green_s) for one in junction.stages]
    stages = stages or [((group.name,), GREEN_S) for group in junction.groups]
    whole_s = sum(green_s + YELLOW_S + CLEAR_S for _, green_s in stages)
    for group in junction.groups:
        begin_s = 0.0
        for groups, green_s in stages:
            if group.name in groups:
                yield number, whole_s, begin_s, begin_s + green_s
                break
            begin_s += green_s + YELLOW_S + CLEAR_S
        else:
            yield number, whole_s, 0.0, 0.0  # never green


@array_kernel
def _look(
    lanes: LaneArrays, state: DriverState, rows: Ints, cycles: Cycles, front: float,
    now_s: Floats, shares: Floats, present: Bools, line: Floats, known: Floats,
) -> None:  # fmt: skip
    for n in range(len(rows)):
        row = rows[n]
        known[row, PASSED_RED] = 0.0
        if not present[row]:
            continue
        at = state.floats[row, DONE] + front
        if at > line[row, 0]:
            group = int(line[row, 1])
            cycle, begin, end = cycles.times[group]
            phase = (now_s[row] + shares[row] * cycle) % cycle
            if not begin <= phase < end + YELLOW_S:
                known[row, PASSED_RED] = 1.0
        line[row, 0], line[row, 1] = _next_line(lanes, state, row, front)
        known[row, TO_LINE_M] = min(line[row, 0] - at, REACH_M)
        known[row, IS_GREEN], known[row, CHANGE_S] = 1.0, 0.0
        if line[row, 0] - at <= REACH_M:
            cycle, begin, end = cycles.times[int(line[row, 1])]
            phase = (now_s[row] + shares[row] * cycle) % cycle
            is_green = begin <= phase < end
            known[row, IS_GREEN] = 1.0 if is_green else 0.0
            known[row, CHANGE_S] = end - phase if is_green else (begin - phase) % cycle


@array_kernel
def _next_line(
    lanes: LaneArrays, state: DriverState, row: int, front: float
) -> tuple[float, float]:
    """Return at which way driven the next line with lights comes, and its group."""
    begun = state.floats[row, DONE] - state.floats[row, S]
    for ahead in range(HERE, WINDOW_SIZE):
        lane = state.lane_window[row, ahead]
        if lane < 0 or begun > state.floats[row, DONE] + front + REACH_M:
            break
        for k in range(lanes.line_first[lane], lanes.line_first[lane + 1]):
            place = begun + lanes.line_at[k]
            if lanes.line_links[k, GROUP] >= 0 and place >= state.floats[row, DONE] + front:
                return place, float(lanes.line_links[k, GROUP])
        begun += lanes.length[lane]
    return np.inf, 0.0
