"""Without a bus everything has subscribers; with one only what somebody subscribed to."""

from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.subscribers import REFRESH_CLASSES_EVERY_TICKS, REFRESH_EVERY_TICKS, Subscribers


class BusStub:
    """Answers as a bus does: for a part of the key left out, whether any is wanted."""

    def __init__(self, **wanted):
        self.wanted = {kind: set(names) for kind, names in wanted.items()}
        self.requests = 0

    def __call__(self, kind, where):
        self.requests += 1
        wanted = self.wanted.get(kind.__name__, set())
        return bool(wanted) if not where else bool(wanted & {*where.values(), "*"})


def attached_to(bus):
    subscribers = Subscribers()
    subscribers.attach(bus)
    return subscribers


def test_without_a_bus_everything_is_wanted():
    subscribers = Subscribers()
    assert subscribers.any(VehicleState)
    assert subscribers.of(LidarScan, "vehicle", ["n1", "n2"]) == [True, True]


def test_only_the_car_that_somebody_listens_to_is_wanted():
    subscribers = attached_to(BusStub(LidarScan=["n2"]))
    assert subscribers.of(LidarScan, "vehicle", ["n1", "n2", "n3"]) == [False, True, False]
    assert not subscribers.any(VehicleState)


def test_who_listens_to_all_is_asked_for_once_and_not_car_by_car():
    bus = BusStub(LidarScan=["*"])
    subscribers = attached_to(bus)
    assert subscribers.of(LidarScan, "vehicle", [f"n{i}" for i in range(1000)]) == [True] * 1000
    assert bus.requests == 1


def test_a_new_listener_is_noticed_within_a_second():
    bus = BusStub(LidarScan=["n1"])
    subscribers = attached_to(bus)
    subscribers.of(LidarScan, "vehicle", ["n1", "n2"])
    bus.wanted["LidarScan"] = {"n2"}
    for _ in range(REFRESH_EVERY_TICKS):
        subscribers.begin_tick()
    assert subscribers.of(LidarScan, "vehicle", ["n1", "n2"]) == [False, True]


def test_for_whole_classes_the_bus_is_asked_ten_times_a_second():
    bus = BusStub()
    subscribers = attached_to(bus)
    assert not subscribers.any(VehicleState)
    bus.wanted["VehicleState"] = {"n1"}
    assert not subscribers.any(VehicleState)
    assert bus.requests == 1
    for _ in range(REFRESH_CLASSES_EVERY_TICKS):
        subscribers.begin_tick()
    assert subscribers.any(VehicleState)
    assert subscribers.any(VehicleState)
    assert bus.requests == 2


def test_who_learns_of_a_bus_late_asks_it():
    subscribers = Subscribers()
    assert subscribers.any(VehicleState)
    subscribers.attach(BusStub())
    assert not subscribers.any(VehicleState)
