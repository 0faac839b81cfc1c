"""Signals of many worlds behind the city's own kernel, and what stands before them.

    choice -> stage, groups that do not conflict -> kernel -> colours -> cars that rules drive

The kernel (`scm.traffic.signals.kernel`) alone decides the colours: what it does in each state that
can be reached under any choices is tabulated once, so that all worlds step by looking it up.
"""

from collections.abc import Iterator

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.errors import MapError
from scm.maps.route import Roads, roads_of
from scm.records.city_map import CityMap
from scm.traffic.signals import kernel
from scm.traffic.signals.kernel import Phase, Program
from scm.traffic.signals.policies.max_pressure import stages_of
from scm.traffic.signals.program import program_of
from scm.vehicles.drivers.driver_state import HERE, WINDOW_SIZE, DriverState, S
from scm.vehicles.drivers.lane_graph import GROUP, LIMIT, LaneArrays, lane_graph_of
from scm.vehicles.jit import array_kernel

REACH_M = 2.0  # cars farther before a line, or farther behind the junction, are not counted
STANDS_MPS = 0.05
NEAR, QUEUE, AHEAD, SLOW = range(4)
"""Of a group: cars that drive up to its line, those of them that stand, cars behind the junction
where its ways lead; and by how much those before the line are slower than they may be, as a sum of
shares of the limit."""
COLUMNS = 4


class Interlock:
    """The kernel of one junction as a table.

    Args:
        program: Of the junction.
        period_s: Between two steps of the kernel.

    Attributes:
        stages: Largest sets of groups without conflict, by the numbers of agents' choices.
        following: State after a period, by state and the stage requested, (states, stages);
            state 0 is that after power-on.
        green: Which groups are green in a state, (states, groups).
    """

    def __init__(self, program: Program, period_s: float) -> None:
        self.stages, dt_ns = tuple(stages_of(program)), round(period_s * NS_PER_S)
        states = [kernel.start(program)]
        numbers, following = {states[0]: 0}, []
        for state in states:  # grows during the loop
            row = [kernel.step(program, state, stage, dt_ns) for stage in self.stages]
            for after in row:
                if after not in numbers:
                    numbers[after] = len(states)
                    states.append(after)
            following.append([numbers[after] for after in row])
        self.following: Ints = np.array(following, np.int64)
        is_green = [[group.phase is Phase.GREEN for group in state] for state in states]
        self.green: Bools = np.array(is_green, np.bool_)


class Junctions:
    """All junctions of many worlds of one map.

    Args:
        city_map: With its junctions.
        worlds: How many.
        period_s: Between two choices.

    Attributes:
        names: Of the junctions, as the map has them.
        choices: Most stages that a junction has.
        places: Most groups that a junction has.
        interlocks: Of each junction.
        stage: Chosen at each junction, (worlds, junctions).
        since: Choices since it was another one, (worlds, junctions).
        green: Which groups are green, (worlds, groups), junction after junction.
        known: Of each group, the columns above, (worlds, groups, 4).
        delay_s: What cars before a junction's lines lost in this step, (worlds, junctions).

    Raises:
        MapError: The map has no junctions.
    """

    def __init__(self, city_map: CityMap, worlds: int, period_s: float) -> None:
        if not city_map.junctions:
            raise MapError(f"map {city_map.name}: expected junctions with signals")
        roads = roads_of(city_map)
        programs = [program_of(junction, roads) for junction in city_map.junctions]
        self.interlocks = [Interlock(program, period_s) for program in programs]
        self.names = tuple(junction.name for junction in city_map.junctions)
        self.choices = max(len(one.stages) for one in self.interlocks)
        counts = [len(program.groups) for program in programs]
        self.places = max(counts)
        self._groups = np.split(np.arange(sum(counts)), np.cumsum(counts)[:-1])
        self._exits: Floats = np.array(list(_exits(city_map, roads)), np.float64).reshape(-1, 4)
        shape = (worlds, len(self.names))
        self._state: Ints = np.zeros(shape, np.int64)
        self.stage: Ints = np.zeros(shape, np.int64)
        self.since: Ints = np.zeros(shape, np.int64)
        self.green: Bools = np.zeros((worlds, sum(counts)), np.bool_)
        self.known: Floats = np.zeros((worlds, sum(counts), COLUMNS))
        self.delay_s: Floats = np.zeros(shape)

    def begin(self, worlds: Ints) -> None:
        """Let episodes of worlds (n,) begin: all red, as if everybody had just gone."""
        self._state[worlds] = self.stage[worlds] = self.since[worlds] = 0
        self.green[worlds], self.delay_s[worlds] = False, 0.0

    def request(self, choices: Ints) -> None:
        """Let the kernels step, with a stage chosen at each junction, (worlds, junctions).

        A number beyond a junction's stages leaves the stage that was chosen before.
        """
        self.delay_s[:] = 0.0
        for k, lock in enumerate(self.interlocks):
            before = self.stage[:, k].copy()
            chosen = np.where(choices[:, k] < len(lock.stages), choices[:, k], before)
            self.stage[:, k] = chosen
            self.since[:, k] = np.where(chosen == before, self.since[:, k] + 1, 0)
            self._state[:, k] = lock.following[self._state[:, k], chosen]
            self.green[:, self._groups[k]] = lock.green[self._state[:, k]]

    def look(
        self, lanes: LaneArrays, state: DriverState, worlds: Ints, cars: Ints, speed: Floats,
        passed_s: Floats,
    ) -> None:  # fmt: skip
        """Count cars in some worlds.

        Args:
            lanes: Of the map.
            state: Where all cars are.
            worlds: Which, (n,).
            cars: Rows of each world's, (worlds, cars).
            speed: Of all cars [m/s].
            passed_s: Since the last time, (n,).
        """
        _count(lanes, state, worlds, cars, speed, self._exits, self.known)
        for k, groups in enumerate(self._groups):
            slow = self.known[worlds[:, None], groups, SLOW].sum(axis=1)
            self.delay_s[worlds, k] += passed_s * slow

    def of_places(self, values: Floats | Bools) -> Floats:
        """Return what is of each group (worlds, groups) for each junction, (worlds, junctions, p).

        Where a junction has fewer groups than others, the rest is 0.
        """
        found: Floats = np.zeros((*self.stage.shape, self.places))
        for k, groups in enumerate(self._groups):
            found[:, k, : len(groups)] = values[:, groups]
        return found


def _exits(city_map: CityMap, roads: Roads) -> Iterator[tuple[float, ...]]:
    """Yield each group with a stretch that its ways lead to: lane's number, and from and to."""
    numbers = lane_graph_of(roads).numbers
    groups = [group for junction in city_map.junctions for group in junction.groups]
    for number, group in enumerate(groups):
        found = set[tuple[float, ...]]()
        for way in group.movements:
            whole = roads.length_of(way.lane)
            found.add((number, numbers[way.lane], way.to_m, min(whole, way.to_m + REACH_M)))
            left = REACH_M - (whole - way.to_m)
            if left > 0.0:
                found |= {(number, numbers[lane], 0.0, left) for lane in roads.successors(way.lane)}
        yield from sorted(found)


@array_kernel
def _count(
    lanes: LaneArrays, state: DriverState, worlds: Ints, cars: Ints, speed: Floats, exits: Floats,
    known: Floats,
) -> None:  # fmt: skip
    for n in range(len(worlds)):
        groups = known[worlds[n]]
        groups[:] = 0.0
        for row in cars[worlds[n]]:
            lane, along = state.lane_window[row, HERE], state.floats[row, S]
            for k in range(len(exits)):
                if exits[k, 1] == lane and exits[k, 2] <= along <= exits[k, 3]:
                    groups[int(exits[k, 0]), AHEAD] += 1.0
            group = _group_ahead(lanes, state, row)
            if group >= 0:
                limit = lanes.segments[lanes.segment_first[lane], LIMIT]
                groups[group, NEAR] += 1.0
                groups[group, QUEUE] += 1.0 if speed[row] < STANDS_MPS else 0.0
                groups[group, SLOW] += max(0.0, 1.0 - speed[row] / limit)


@array_kernel
def _group_ahead(lanes: LaneArrays, state: DriverState, row: int) -> int:
    """Return the group of the next line that a car drives up to; -1: none within reach."""
    begun = -state.floats[row, S]
    for ahead in range(HERE, WINDOW_SIZE):
        lane = state.lane_window[row, ahead]
        if lane < 0 or begun > REACH_M:
            break
        for k in range(lanes.line_first[lane], lanes.line_first[lane + 1]):
            way = begun + lanes.line_at[k]
            if lanes.line_links[k, GROUP] >= 0 and 0.0 <= way <= REACH_M:
                return int(lanes.line_links[k, GROUP])
        begun += lanes.length[lane]
    return -1
