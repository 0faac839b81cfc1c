"""The scanner of an emulated Nigel: an RPLIDAR A1 behind a pseudo-terminal of its own.

Each beam looks from where the car truly is at that moment, one after the other and clockwise, as
the real one does. Between `SCAN` and `STOP`, it sends a node per beam; see `lidars/rplidar_a1.py`.
Holds: walls and boxes of the map that stay; it does not see other cars.
"""

import numpy as np

from scm.arrays import Floats, Ints
from scm.clock import NS_PER_S
from scm.geometry import TAU, Pose2
from scm.maps.segments import wall_segments
from scm.records.city_map import CityMap
from scm.vehicles.car import Car
from scm.vehicles.rays.cast import cast
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from vehicle_agent.emulate.pty import Cable
from vehicle_agent.lidars.rplidar_a1 import DESCRIPTOR, NODE_BYTES, SCAN, STOP

QUALITY = 15
NOBODY: Ints = np.array([-1])


class Scanner:
    """One scanner at the end of its cable.

    Args:
        cable: To the host.
        car: With its `[lidar]`.
        seed: Of the noise.
    """

    def __init__(self, cable: Cable, car: Car, seed: int) -> None:
        self._cable = cable
        self._beams = round(car.value("lidar.beams"))
        self._rate_hz = car.value("lidar.rate_hz")
        self._nearest, self._farthest = car.vector("lidar.range_m")
        self._noise_m = car.value("lidar.noise_m")
        x, y, _ = car.vector("lidar.position_m")
        self._mount = Pose2(x, y, 0.0)
        self._rng = np.random.default_rng(seed)
        self._scene: Scene | None = None
        self._received = b""
        self._began_ns: int | None = None
        self._sent = 0

    def learn(self, city_map: CityMap) -> None:
        """Receive the walls and boxes of a map."""
        nothing = np.empty((0, 4)), np.empty(0, np.int64)
        self._scene = Scene(WallGrid(wall_segments(city_map)), *nothing)

    def step(self, now_ns: int, pose: Pose2) -> None:
        """Obey the host, and send the nodes of the beams up to now; `pose` is the car's."""
        self._obey(now_ns)
        if self._began_ns is None or self._scene is None:
            return
        due = int((now_ns - self._began_ns) * self._rate_hz * self._beams / NS_PER_S)
        first, self._sent = max(self._sent, due - self._beams), due
        if due > first:
            self._cable.write(nodes(first, self._ranges(first, due, pose), self._beams))

    def close(self) -> None:
        """Remove the cable."""
        self._cable.pull()

    def _obey(self, now_ns: int) -> None:
        """Begin and end a scan as the host requests; it also ends when the host is gone."""
        if not self._cable.is_open:
            self._began_ns = None
            return
        self._received = (self._received + self._cable.read())[-64:]
        scan, stop = self._received.rfind(SCAN), self._received.rfind(STOP)
        if scan > stop:
            self._cable.write(DESCRIPTOR)
            self._began_ns, self._sent = now_ns, 0
        elif stop >= 0:
            self._began_ns = None
        if max(scan, stop) >= 0:
            self._received = b""

    def _ranges(self, first: int, end: int, pose: Pose2) -> Floats:
        """Return what beams see (n,) [m], clockwise from number `first` to `end`; 0: nothing."""
        if self._scene is None:
            return np.zeros(end - first)
        step = TAU / self._beams
        scanner = np.array([pose @ self._mount])
        bearings = (-step * (end - 1), step, end - first)
        seen = cast(self._scene, scanner, NOBODY, bearings, self._farthest)[0, ::-1]
        seen = seen + self._noise_m * self._rng.standard_normal(len(seen))
        return np.where((seen >= self._nearest) & (seen <= self._farthest), seen, 0.0)


def nodes(first: int, ranges: Floats, beams: int) -> bytes:
    """Return ranges (n,) [m] of the beams from number `first` on as the scanner sends them."""
    beam = np.arange(first, first + len(ranges)) % beams
    angle = np.rint(beam * (360.0 * 64.0 / beams)).astype(np.int64) << 1 | 1
    distance = np.rint(4000.0 * ranges).astype(np.int64)
    rows = np.empty((len(ranges), NODE_BYTES), np.uint8)
    rows[:, 0] = QUALITY << 2 | np.where(beam == 0, 1, 2)
    rows[:, 1], rows[:, 2] = angle & 0xFF, angle >> 8
    rows[:, 3], rows[:, 4] = distance & 0xFF, distance >> 8
    return rows.tobytes()
