"""The lanes that cars drive along: where each begins, and where it is on them.

A course is the lanes from some on, without end: where they branch, a draw of the episode decides.
Compiled, one call for all cars.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scm.arrays import Floats, Ints
from scm.errors import MapError, nearest
from scm.maps.route import Roads
from scm.records.city_map import CityMap
from scm.vehicles.drivers.driver_state import (
    AFTER,
    CIRCULATE,
    COUNT,
    DONE,
    HERE,
    INDEX,
    ROUTE,
    SEED,
    DriverState,
    S,
    empty_state,
)
from scm.vehicles.drivers.lane_graph import (
    AT,
    COS,
    CURVATURE,
    LIMIT,
    SIN,
    YAW,
    LaneArrays,
    X,
    Y,
    lane_graph_of,
)
from scm.vehicles.drivers.lane_tracking import (
    advance_window,
    fill_window,
    heading_change,
    list_segments,
    project,
    segment_at,
    update_position,
)
from scm.vehicles.jit import array_kernel
from scm.vehicles.lane_math import sin_cos

MOST_SEGMENTS = 32
AHEAD_M = (0.2, 0.4, 0.8, 1.6)
"""Distances at which a car is shown how the lane turns."""
# Columns of what is known of each car.
BESIDE_M, TURNED_RAD, LIMIT_MPS, DONE_M, BENDS = range(5)
COLUMNS = BENDS + len(AHEAD_M)
# Columns of an episode's draws, uniform from 0 to 1: where it begins, and where the lanes branch.
WHERE, BESIDE_DRAW, TURNED_DRAW, BRANCHES = range(4)


class Course:
    """Where cars are along their lanes, rows of them.

    Args:
        city_map: With its lanes.
        rows: How many cars.
        lanes: By name, that a car may begin on; none: on any from which one can go on for ever.

    Attributes:
        graph: Of the lanes.
        known: Of each row (rows, columns): its offset from the lane's centre, + = left [m], and how
            far it is turned from the lane's direction, + = left [rad]; the speed limit [m/s]; how
            far it has come along the lanes since it began [m]; how far the lane will have turned
            after each of `AHEAD_M` [rad].
        half_width: Of each row's lane [m].

    Raises:
        MapError: There is no such lane, or none from which one can go on.
    """

    def __init__(self, city_map: CityMap, rows: int, lanes: Sequence[str] = ()) -> None:
        graph = self.graph = lane_graph_of(Roads(city_map))
        for name in lanes:
            if name not in graph.numbers:
                msg = f"map {city_map.name}: no lane {name!r}{nearest(name, sorted(graph.names))}"
                raise MapError(msg)
        chosen = [graph.numbers[name] for name in lanes]
        chosen = chosen or [number for number, endless in enumerate(graph.goes_round) if endless]
        if not chosen:
            msg = f"map {city_map.name}: expected a lane from which cars can drive on for ever"
            raise MapError(msg)
        self._lanes = graph.arrays
        self._begins = np.array(chosen, np.int64)
        self._ends = np.cumsum(graph.arrays.length[chosen])
        self._half_widths = np.array([0.5 * lane.width_m for lane in city_map.lanes])
        self._state = replace(empty_state(rows), routes=np.zeros(rows, np.int64))
        self._state.ints[:, AFTER], self._state.ints[:, COUNT] = CIRCULATE, 1
        self._state.ints[:, ROUTE] = np.arange(rows)
        self._every: Ints = np.arange(rows)
        self._ids, self._at = np.zeros(MOST_SEGMENTS, np.int64), np.zeros(MOST_SEGMENTS + 1)
        self.known: Floats = np.zeros((rows, COLUMNS))

    @property
    def arrays(self) -> tuple[LaneArrays, DriverState]:
        """The lanes, and where each row is on them, for compiled code."""
        return self._lanes, self._state

    @property
    def half_width(self) -> Floats:
        """Of each row's lane [m]."""
        return self._half_widths[self._state.lane_window[:, HERE]]

    def lanes_ahead(self, row: int) -> tuple[tuple[str, ...], float]:
        """Return the names of a car's lanes from its own on, and how far along that it is [m]."""
        numbers = self._state.lane_window[row, HERE:]
        names = tuple(self.graph.names[n] for n in numbers if n >= 0)
        return names, float(self._state.floats[row, S])

    def begin(
        self, rows: Ints, draws: Floats, beside_m: float, turned_rad: float,
        ahead_m: Floats | None = None,
    ) -> Floats:  # fmt: skip
        """Let cars begin somewhere along the lanes; return the poses of their rear axles.

        Args:
            rows: Which, (n,).
            draws: Of their episodes, (n, 4).
            beside_m: At most so far beside the lane's centre.
            turned_rad: At most so far from its direction.
            ahead_m: How much farther along its lanes each begins than is drawn, (n,); None: 0.

        Returns:
            x, y and yaw, map frame, (n, 3) [m, rad].
        """
        poses: Floats = np.empty((len(rows), 3))
        ahead_m = np.zeros(len(rows)) if ahead_m is None else ahead_m
        _begin(
            self._lanes, self._state, rows, draws, self._begins, self._ends, ahead_m, beside_m,
            turned_rad, poses,
        )  # fmt: skip
        return poses

    def enter(self, row: int, lane: str, s: float, branches: float = 0.0) -> None:
        """Let a car that is on a lane already follow it from there.

        Args:
            row: Which.
            lane: Its name.
            s: About how far along it the rear axle is [m].
            branches: A draw, 0 to 1, that decides where the lanes branch.
        """
        _enter(self._lanes, self._state, row, self.graph.numbers[lane], s, branches)

    def follow(self, x: Floats, y: Floats, yaw: Floats, rows: Ints | None = None) -> None:
        """Find where cars are, from where they were; `known` says it.

        Args:
            x: Of all rows' rear axles, map frame (rows,); likewise `y` and `yaw`.
            y: See `x`.
            yaw: See `x`.
            rows: Which cars, (n,); None: all.
        """
        rows = self._every if rows is None else rows
        _follow(
            self._lanes, self._state, rows, x, y, yaw, np.array(AHEAD_M), self._ids, self._at,
            self.known,
        )  # fmt: skip


@array_kernel
def _enter(
    lanes: LaneArrays, state: DriverState, row: int, lane: int, s: float, branches: float
) -> None:
    state.routes[row] = lane
    state.ints[row, INDEX] = 0
    state.ints[row, SEED] = int(branches * 2.0**31)
    for column in range(state.floats.shape[1]):
        state.floats[row, column] = 0.0
    state.floats[row, S] = s
    fill_window(lanes, state, row, lane)


@array_kernel
def _begin(
    lanes: LaneArrays, state: DriverState, rows: Ints, draws: Floats, begins: Ints, ends: Floats,
    ahead_m: Floats, beside_m: float, turned_rad: float, poses: Floats,
) -> None:  # fmt: skip
    for k in range(len(rows)):
        row, along = rows[k], draws[k, WHERE] * ends[-1]
        at = 0
        while at < len(begins) - 1 and along >= ends[at]:
            at += 1
        lane = begins[at]
        s = along - (ends[at - 1] if at else 0.0) + ahead_m[k]
        _enter(lanes, state, row, lane, s, draws[k, BRANCHES])
        while s > lanes.length[lane]:
            s -= lanes.length[lane]
            advance_window(lanes, state, row)
            lane = state.lane_window[row, HERE]
        state.floats[row, S] = s
        segment = lanes.segments[segment_at(lanes.segment_first, lanes.segments, lane, s)]
        beside = (2.0 * draws[k, BESIDE_DRAW] - 1.0) * beside_m
        turn = segment[CURVATURE] * (s - segment[AT])
        sine, cosine = sin_cos(turn)
        ahead, left = s - segment[AT], beside
        if segment[CURVATURE] != 0.0:
            ahead = sine / segment[CURVATURE] - beside * sine
            left = (1.0 - cosine) / segment[CURVATURE] + beside * cosine
        poses[k, 0] = segment[X] + segment[COS] * ahead - segment[SIN] * left
        poses[k, 1] = segment[Y] + segment[SIN] * ahead + segment[COS] * left
        poses[k, 2] = segment[YAW] + turn + (2.0 * draws[k, TURNED_DRAW] - 1.0) * turned_rad


@array_kernel
def _follow(
    lanes: LaneArrays, state: DriverState, rows: Ints, x: Floats, y: Floats, yaw: Floats,
    ahead: Floats, ids: Ints, at: Floats, known: Floats,
) -> None:  # fmt: skip
    for n in range(len(rows)):
        row = rows[n]
        if state.lane_window[row, HERE] < 0 or not np.isfinite(x[row] + y[row] + yaw[row]):
            continue
        update_position(lanes, state, row, x[row], y[row])
        window, s = state.lane_window[row], state.floats[row, S]
        segment = lanes.segments[segment_at(lanes.segment_first, lanes.segments, window[HERE], s)]
        _along, beside, cosine, sine = project(segment, x[row], y[row], s - segment[AT])
        own_s, own_c = sin_cos(yaw[row])
        lane_c = segment[COS] * cosine - segment[SIN] * sine
        lane_s = segment[SIN] * cosine + segment[COS] * sine
        known[row, BESIDE_M] = beside
        known[row, TURNED_RAD] = np.arctan2(
            own_s * lane_c - own_c * lane_s, own_c * lane_c + own_s * lane_s
        )
        known[row, LIMIT_MPS] = segment[LIMIT]
        known[row, DONE_M] = state.floats[row, DONE]
        count, here, _ends = list_segments(
            lanes.segment_first, lanes.segments, window, s, 0.0, ahead[-1], ids, at
        )
        for k in range(len(ahead)):
            known[row, BENDS + k] = heading_change(lanes.segments, ids, at, count, here, ahead[k])
