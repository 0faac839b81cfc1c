"""The last received CAMs of every station, and a grid of cells to find cars by place.

A car is extrapolated from its CAM at constant speed and yaw rate for at most one second, and
dropped after three. On a lossy channel a driver uses the last received CAM for longer, since a
missing CAM does not mean a missing car.
"""

import math

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.records.city_map import CityMap
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.drivers.channel import IDEAL, Channel, has_arrived
from scm.vehicles.jit import array_kernel, kernel_function

MAX_CAM_AGE_NS = 3 * NS_PER_S  # every station sends at least once a second
MAX_CAM_AGE_LOSSY_NS = 16 * NS_PER_S
MAX_EXTRAPOLATION_S = 1.0
CELL_M = 1.0
MARGIN_M = 1.0  # of the grid beyond the floor

# Columns of a CAM: middle of the front bumper, heading, speed along it, yaw rate.
CAM_X, CAM_Y, CAM_YAW, CAM_SPEED, CAM_YAW_RATE = range(5)
# Columns of a station's estimated place: centre of its outline, heading, speed.
AT_X, AT_Y, AT_COS, AT_SIN, AT_SPEED = range(5)
# Columns of the grid: its corner, cells along x and y, half the largest diagonal of a car.
LOW_X, LOW_Y, CELLS_X, CELLS_Y, LARGEST = range(5)


class ReceivedCams(ArrayStruct):
    """The arrays, by station; m stored CAMs per station.

    Attributes:
        newest: Row of the newest CAM.
        number: (m, capacity) sequence number of each CAM; -1: none.
        t_ns: (m, capacity) time of sending.
        cams: (m, capacity, 5).
        size: (capacity, 2) length and width [m]; 0: no car.
        near: (capacity,) whether any driver here may have to look at the car.
        at: (capacity, 5) estimated place now, from the newest CAM.
        cell_first: Start of each cell's stations in `in_cell`, and the end.
        in_cell: Stations, cell by cell.
        cell_of: (capacity,) cell of each station; -1: not received lately.
        floor: See the columns above.
        channel: The radio channel of CAMs.
    """

    newest: Ints
    number: Ints
    t_ns: Ints
    cams: Floats
    size: Floats
    near: Bools
    at: Floats
    cell_first: Ints
    in_cell: Ints
    cell_of: Ints
    floor: Floats
    channel: Channel


def no_cams(city_map: CityMap, capacity: int, history: int, channel: Channel) -> ReceivedCams:
    """Return the arrays of a map before the first CAM."""
    (x0, x1), (y0, y1) = city_map.floor.x_m, city_map.floor.y_m
    across = max(1, math.ceil((x1 - x0 + 2.0 * MARGIN_M) / CELL_M))
    up = max(1, math.ceil((y1 - y0 + 2.0 * MARGIN_M) / CELL_M))
    return ReceivedCams(
        newest=np.zeros(capacity, np.int64),
        number=np.full((history, capacity), -1, np.int64),
        t_ns=np.zeros((history, capacity), np.int64),
        cams=np.zeros((history, capacity, 5)),
        size=np.zeros((capacity, 2)),
        near=np.ones(capacity, np.bool_),
        at=np.zeros((capacity, 5)),
        cell_first=np.zeros(across * up + 1, np.int64),
        in_cell=np.zeros(capacity, np.int64),
        cell_of=np.full(capacity, -1, np.int64),
        floor=np.array([x0 - MARGIN_M, y0 - MARGIN_M, across, up, 0.0]),
        channel=channel,
    )


@kernel_function
def extrapolate(cam: Floats, age: float, length: float) -> tuple[float, float, float, float, float]:
    """Return (x, y, cos, sin, speed) of a car's centre, some time [s] after its CAM."""
    age = min(max(age, 0.0), MAX_EXTRAPOLATION_S)
    ahead = cam[CAM_SPEED] * age - 0.5 * length
    turned = cam[CAM_YAW_RATE] * age
    way = cam[CAM_YAW] + 0.5 * turned
    yaw = cam[CAM_YAW] + turned
    x, y = cam[CAM_X] + ahead * math.cos(way), cam[CAM_Y] + ahead * math.sin(way)
    return x, y, math.cos(yaw), math.sin(yaw), cam[CAM_SPEED]


@kernel_function
def cell_number(floor: Floats, x: float, low: int, cells: int) -> int:
    """Return the row or column of cells at a coordinate, clamped to the grid."""
    at = (x - floor[low]) / CELL_M
    return int(min(max(at, 0.0), floor[cells] - 1.0))


@array_kernel
def update_cells(received: ReceivedCams, now_ns: int) -> None:
    """Extrapolate all stations to now and sort them into cells."""
    first, floor = received.cell_first, received.floor
    across = int(floor[CELLS_X])
    for cell in range(len(first)):
        first[cell] = 0
    floor[LARGEST] = 0.0
    for station in range(len(received.newest)):
        received.cell_of[station] = -1
        length, width = received.size[station, 0], received.size[station, 1]
        place = received.newest[station]
        if length == 0.0 or received.number[place, station] < 0:
            continue
        age_ns = now_ns - received.t_ns[place, station]
        if age_ns > MAX_CAM_AGE_NS:
            continue
        floor[LARGEST] = max(floor[LARGEST], 0.5 * math.sqrt(length * length + width * width))
        if not received.near[station]:
            continue
        x, y, cos, sin, speed = extrapolate(received.cams[place, station], 1e-9 * age_ns, length)
        at = received.at[station]
        at[AT_X], at[AT_Y], at[AT_COS], at[AT_SIN], at[AT_SPEED] = x, y, cos, sin, speed
        row, column = cell_number(floor, y, LOW_Y, CELLS_Y), cell_number(floor, x, LOW_X, CELLS_X)
        received.cell_of[station] = row * across + column
        first[row * across + column + 1] += 1
    for cell in range(len(first) - 1):
        first[cell + 1] += first[cell]
    total = first[-1]
    for station in range(len(received.newest) - 1, -1, -1):
        cell = received.cell_of[station]
        if cell >= 0:
            first[cell + 1] -= 1
            received.in_cell[first[cell + 1]] = station
    for cell in range(len(first) - 1):  # each cell's start is now one place too far
        first[cell] = first[cell + 1]
    first[-1] = total


@kernel_function
def estimate_for(
    received: ReceivedCams, station: int, receiver: int, now_ns: int, seed: int
) -> tuple[bool, float, float, float, float, float]:
    """Return whether a receiver knows a station, and its (x, y, cos, sin, speed)."""
    if received.channel.numbers[IDEAL] > 0.0:
        at = received.at[station]
        return True, at[AT_X], at[AT_Y], at[AT_COS], at[AT_SIN], at[AT_SPEED]
    history = len(received.number)
    for older in range(history):
        place = (received.newest[station] - older) % history
        number = received.number[place, station]
        age_ns = now_ns - received.t_ns[place, station]
        if number < 0 or age_ns > MAX_CAM_AGE_LOSSY_NS:
            break
        cam = received.cams[place, station]
        x, y = cam[CAM_X], cam[CAM_Y]
        if has_arrived(received.channel, seed, station, receiver, number, x, y, age_ns):
            length = received.size[station, 0]
            x, y, cos, sin, speed = extrapolate(cam, 1e-9 * age_ns, length)
            return True, x, y, cos, sin, speed
    return False, 0.0, 0.0, 1.0, 0.0, 0.0


@array_kernel
def store_cams(received: ReceivedCams, stations: Ints, now_ns: int, cams: Floats) -> None:
    """Store CAMs (k, 5) sent now, each as the newest of its station (k,)."""
    history = len(received.number)
    for row in range(len(stations)):
        station = stations[row]
        before = received.number[received.newest[station], station]
        place = (received.newest[station] + 1) % history
        received.newest[station] = place
        received.number[place, station] = before + 1
        received.t_ns[place, station] = now_ns
        for column in range(5):
            received.cams[place, station, column] = cams[row, column]
