"""The cars around, as their CAMs told: the last ones of every station, and cells to find them by.

A car is moved on from its CAM at its last speed and turn, for a second at most; one that fell
silent is forgotten after three. Where frames get lost a driver believes the last one that it got
for longer: there silence is not absence.
"""

import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.clock import NS_PER_S
from scm.records.city_map import CityMap
from scm.vehicles.drivers.channel import IDEAL, Channel, has_arrived
from scm.vehicles.jit import array_kernel, law

REMEMBER_NS = 3 * NS_PER_S
BELIEVE_NS = 16 * NS_PER_S
LONGEST_GUESS_S = 1.0
CELL_M = 1.0
MARGIN_M = 1.0

# Columns of a CAM: the middle of the front bumper, speed along the heading, and turn of it.
CAM_X, CAM_Y, CAM_YAW, CAM_SPEED, CAM_YAW_RATE = range(5)
# Columns of where a station is believed to be: the middle of its outline, its heading, its speed.
AT_X, AT_Y, AT_COS, AT_SIN, AT_SPEED = range(5)
# Columns of the floor's cells: its corner, cells along x and along y, a car's largest half.
LOW_X, LOW_Y, CELLS_X, CELLS_Y, LARGEST = range(5)


class Heard(NamedTuple):
    """The arrays, by station; m CAMs are kept of each.

    Attributes:
        newest: Which of the CAMs kept is the newest.
        number: (m, capacity) of each CAM, -1: there is none.
        t_ns: (m, capacity) when it was on the air.
        cams: (m, capacity, 5).
        size: (capacity, 2) length and width; 0: nobody.
        at: (capacity, 5) where each is believed to be now, by its newest CAM.
        cell_first: Where each cell's stations begin in `in_cell`; one more for the end.
        in_cell: Stations, cell by cell.
        cell_of: (capacity,) of each station, -1: silent.
        floor: See the columns above.
        channel: What the air does to CAMs on their way.
    """

    newest: Ints
    number: Ints
    t_ns: Ints
    cams: Floats
    size: Floats
    at: Floats
    cell_first: Ints
    in_cell: Ints
    cell_of: Ints
    floor: Floats
    channel: Channel


def nobody(city_map: CityMap, capacity: int, kept: int, channel: Channel) -> Heard:
    """Return the arrays for a map on which nobody has spoken."""
    (x0, x1), (y0, y1) = city_map.floor.x_m, city_map.floor.y_m
    across = max(1, math.ceil((x1 - x0 + 2.0 * MARGIN_M) / CELL_M))
    up = max(1, math.ceil((y1 - y0 + 2.0 * MARGIN_M) / CELL_M))
    return Heard(
        newest=np.zeros(capacity, np.int64),
        number=np.full((kept, capacity), -1, np.int64),
        t_ns=np.zeros((kept, capacity), np.int64),
        cams=np.zeros((kept, capacity, 5)),
        size=np.zeros((capacity, 2)),
        at=np.zeros((capacity, 5)),
        cell_first=np.zeros(across * up + 1, np.int64),
        in_cell=np.zeros(capacity, np.int64),
        cell_of=np.full(capacity, -1, np.int64),
        floor=np.array([x0 - MARGIN_M, y0 - MARGIN_M, across, up, 0.0]),
        channel=channel,
    )


@law
def moved_on(cam: Floats, age: float, length: float) -> tuple[float, float, float, float, float]:
    """Return (x, y, cos, sin, speed) of a car's middle, some time [s] after its CAM."""
    age = min(max(age, 0.0), LONGEST_GUESS_S)
    ahead = cam[CAM_SPEED] * age - 0.5 * length
    turned = cam[CAM_YAW_RATE] * age
    way = cam[CAM_YAW] + 0.5 * turned
    yaw = cam[CAM_YAW] + turned
    x, y = cam[CAM_X] + ahead * math.cos(way), cam[CAM_Y] + ahead * math.sin(way)
    return x, y, math.cos(yaw), math.sin(yaw), cam[CAM_SPEED]


@law
def cell_number(floor: Floats, x: float, low: int, cells: int) -> int:
    """Return the row or column of cells that holds a coordinate; what lies outside, the nearest."""
    at = (x - floor[low]) / CELL_M
    return int(min(max(at, 0.0), floor[cells] - 1.0))


@array_kernel
def find_cells(heard: Heard, now_ns: int) -> None:
    """Work out where everybody is now, and sort the stations into cells."""
    first, floor = heard.cell_first, heard.floor
    across = int(floor[CELLS_X])
    for cell in range(len(first)):
        first[cell] = 0
    floor[LARGEST] = 0.0
    for station in range(len(heard.newest)):
        heard.cell_of[station] = -1
        length, width = heard.size[station, 0], heard.size[station, 1]
        place = heard.newest[station]
        if length == 0.0 or heard.number[place, station] < 0:
            continue
        age_ns = now_ns - heard.t_ns[place, station]
        if age_ns > REMEMBER_NS:
            continue
        x, y, cos, sin, speed = moved_on(heard.cams[place, station], 1e-9 * age_ns, length)
        at = heard.at[station]
        at[AT_X], at[AT_Y], at[AT_COS], at[AT_SIN], at[AT_SPEED] = x, y, cos, sin, speed
        floor[LARGEST] = max(floor[LARGEST], 0.5 * math.sqrt(length * length + width * width))
        row, column = cell_number(floor, y, LOW_Y, CELLS_Y), cell_number(floor, x, LOW_X, CELLS_X)
        heard.cell_of[station] = row * across + column
        first[row * across + column + 1] += 1
    for cell in range(len(first) - 1):
        first[cell + 1] += first[cell]
    total = first[-1]
    for station in range(len(heard.newest) - 1, -1, -1):
        cell = heard.cell_of[station]
        if cell >= 0:
            first[cell + 1] -= 1
            heard.in_cell[first[cell + 1]] = station
    for cell in range(len(first) - 1):  # each cell's start now stands one too far
        first[cell] = first[cell + 1]
    first[-1] = total


@law
def known_to(
    heard: Heard, station: int, receiver: int, now_ns: int, seed: int
) -> tuple[bool, float, float, float, float, float]:
    """Return whether a receiver knows of a station, and (x, y, cos, sin, speed) of it."""
    if heard.channel.numbers[IDEAL] > 0.0:
        at = heard.at[station]
        return True, at[AT_X], at[AT_Y], at[AT_COS], at[AT_SIN], at[AT_SPEED]
    kept = len(heard.number)
    for older in range(kept):
        place = (heard.newest[station] - older) % kept
        number = heard.number[place, station]
        age_ns = now_ns - heard.t_ns[place, station]
        if number < 0 or age_ns > BELIEVE_NS:
            break
        cam = heard.cams[place, station]
        x, y = cam[CAM_X], cam[CAM_Y]
        if has_arrived(heard.channel, seed, station, receiver, number, x, y, age_ns):
            length = heard.size[station, 0]
            x, y, cos, sin, speed = moved_on(cam, 1e-9 * age_ns, length)
            return True, x, y, cos, sin, speed
    return False, 0.0, 0.0, 1.0, 0.0, 0.0


@array_kernel
def hear_cams(heard: Heard, stations: Ints, now_ns: int, cams: Floats) -> None:
    """Keep CAMs (k, 5) that are on the air now, each as the newest of its station (k,)."""
    kept = len(heard.number)
    for row in range(len(stations)):
        station = stations[row]
        before = heard.number[heard.newest[station], station]
        place = (heard.newest[station] + 1) % kept
        heard.newest[station] = place
        heard.number[place, station] = before + 1
        heard.t_ns[place, station] = now_ns
        for column in range(5):
            heard.cams[place, station, column] = cams[row, column]
