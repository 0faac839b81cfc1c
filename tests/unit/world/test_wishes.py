"""Wishes: without a bus all is wanted; with one only what somebody subscribed to."""

from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.wishes import ASK_EVERY_TICKS, ASK_FOR_ANY_EVERY_TICKS, Wishes


class Subscribers:
    """Answers as a bus does: for a part of the key left out, whether any is wanted."""

    def __init__(self, **wanted):
        self.wanted = {kind: set(names) for kind, names in wanted.items()}
        self.asked = 0

    def __call__(self, kind, where):
        self.asked += 1
        wanted = self.wanted.get(kind.__name__, set())
        return bool(wanted) if not where else bool(wanted & {*where.values(), "*"})


def wishes_with(subscribers):
    wishes = Wishes()
    wishes.learn(subscribers)
    return wishes


def test_without_a_bus_everything_is_wanted():
    wishes = Wishes()
    assert wishes.any(VehicleState)
    assert wishes.of(LidarScan, "vehicle", ["n1", "n2"]) == [True, True]


def test_only_the_car_that_somebody_listens_to_is_wanted():
    wishes = wishes_with(Subscribers(LidarScan=["n2"]))
    assert wishes.of(LidarScan, "vehicle", ["n1", "n2", "n3"]) == [False, True, False]
    assert not wishes.any(VehicleState)


def test_who_listens_to_all_is_asked_for_once_and_not_car_by_car():
    subscribers = Subscribers(LidarScan=["*"])
    wishes = wishes_with(subscribers)
    assert wishes.of(LidarScan, "vehicle", [f"n{i}" for i in range(1000)]) == [True] * 1000
    assert subscribers.asked == 1


def test_a_new_listener_is_noticed_within_a_second():
    subscribers = Subscribers(LidarScan=["n1"])
    wishes = wishes_with(subscribers)
    wishes.of(LidarScan, "vehicle", ["n1", "n2"])
    subscribers.wanted["LidarScan"] = {"n2"}
    for _ in range(ASK_EVERY_TICKS):
        wishes.begin_tick()
    assert wishes.of(LidarScan, "vehicle", ["n1", "n2"]) == [False, True]


def test_for_whole_classes_the_bus_is_asked_ten_times_a_second():
    subscribers = Subscribers()
    wishes = wishes_with(subscribers)
    assert not wishes.any(VehicleState)
    subscribers.wanted["VehicleState"] = {"n1"}
    assert not wishes.any(VehicleState)
    assert subscribers.asked == 1
    for _ in range(ASK_FOR_ANY_EVERY_TICKS):
        wishes.begin_tick()
    assert wishes.any(VehicleState)
    assert wishes.any(VehicleState)
    assert subscribers.asked == 2


def test_who_learns_of_a_bus_late_asks_it():
    wishes = Wishes()
    assert wishes.any(VehicleState)
    wishes.learn(Subscribers())
    assert not wishes.any(VehicleState)
