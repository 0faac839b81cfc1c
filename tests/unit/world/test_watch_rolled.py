"""A car on its roof is told as such, once, with its own sentence."""

from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.v2x.messages.city_event import CityEvent
from scm.vehicles.vehicle_status import VehicleStatus
from scm.world.step import tick
from scm.world.world import PERIOD_NS, World


def test_a_car_that_rolled_over_is_reported_once():
    world = World(load_map("parking_school"), capacity=4)
    car = world.host("a", "nigel", Pose2(0.0, 0.0, 0.0), 0)
    tick(world, 0, [])
    car.fleet.status[car.row] = VehicleStatus.ROLLED
    events = []
    for i in range(1, 4):
        sent = tick(world, i * PERIOD_NS, [])
        events += [m for m in sent if isinstance(m, CityEvent) and m.name == "vehicle_rolled"]
    assert [event.text for event in events] == [VehicleStatus.ROLLED.sentence]
