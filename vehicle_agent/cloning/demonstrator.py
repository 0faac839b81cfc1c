"""What the built-in driver would do while another one drives.

A network that drives comes to places that no demonstration has. The commands that lead back from
there are recorded with its frames, and it is trained again (dataset aggregation).
Source: Ross, Gordon and Bagnell, 2011 (DAgger).
"""

import math

from scm.geometry import Pose2
from scm.maps.route import roads_of
from scm.records.city_map import CityMap
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.vehicles.driver import RouteView
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.drivers.signal_table import SignalTable
from scm.vehicles.drivers.single_car import TripDriver

JUMP_M = 0.1  # between two reports: somebody put the car elsewhere
BESIDE_M = 0.2  # from its lane's middle, the car is lost


class Demonstrator:
    """The driver: it knows the car's pose and the lanes, but no lights and no other cars.

    Args:
        city_map: The city.
    """

    def __init__(self, city_map: CityMap) -> None:
        self._roads = roads_of(city_map)
        self._signals = SignalTable(city_map)
        self._driver: TripDriver | None = None
        self._pose = Pose2(math.inf, math.inf, 0.0)

    def commands(self, state: VehicleState) -> tuple[float, float] | None:
        """Return its throttle and steering, -1 to 1; None: the car is beside all lanes."""
        before, self._pose = self._pose, Pose2(state.x_m, state.y_m, state.yaw_rad)
        driver = self._driver
        if (
            driver is None
            or driver.off_lane
            or math.dist(before[:2], self._pose[:2]) > JUMP_M
            or abs(driver.driver.cross_track) > BESIDE_M
        ):
            limits = limits_of(load_car(state.car))
            driver = TripDriver(state.vehicle, self._roads, limits, self._pose, state.t_ns)
            self._driver = driver
        if driver.off_lane:
            return None
        commands = driver.decide(RouteView(state.t_ns, self._pose, state.speed_mps, self._signals))
        return None if abs(driver.driver.cross_track) > BESIDE_M else commands
