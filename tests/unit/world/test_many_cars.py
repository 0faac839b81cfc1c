"""Many cars: the same on any number of threads, told in turns, and told to listeners alone."""

from collections import Counter

import pytest

from scm.maps.load import load_map
from scm.v2x.exchange import PersistedState
from scm.v2x.message import Message
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.radio_status import RadioStatus
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.vehicles import fleet
from scm.world import publish
from scm.world.part import WorldPart

TICK_NS = 20_000_000
GRID = load_map("grid:3x3")


def cars(count):
    return tuple((f"n{i + 1}", "nigel") for i in range(count))


def run(ticks, hosted, threads=1, is_wanted=None, seed=3):
    """Return a world after some ticks, and the messages of each tick."""
    part = WorldPart(GRID, seed, hosted)
    part.world.use_threads(threads)
    if is_wanted is not None:
        part.attach(is_wanted)
    said = [part.step(i * TICK_NS, []) for i in range(ticks)]
    return part.world, said


def messages(said, kind):
    return [message for tick in said for message in tick if isinstance(message, kind)]


@pytest.mark.parametrize("threads", [1, 2])
def test_a_city_runs_the_same_again_on_any_number_of_threads(threads, monkeypatch):
    monkeypatch.setattr(fleet, "_TILES_A_THREAD", 1)
    first, _ = run(100, cars(40))
    again, _ = run(100, cars(40), threads)
    for name in ("x", "y", "yaw", "speed", "throttle", "steering"):
        assert (getattr(first.cars.arrays, name) == getattr(again.cars.arrays, name)).all()
    assert (first.cars.arrays.speed[first.cars.arrays.hosted] > 0.05).any()


def test_another_car_far_away_changes_nobodys_noise():
    _, alone = run(30, cars(1))
    _, together = run(30, cars(2))

    def of_first(said, kind):
        return [m for m in messages(said, kind) if m.vehicle == "n1"]

    assert of_first(alone, VehicleSensors) == of_first(together, VehicleSensors)
    ranges = [[scan.payload for scan in of_first(said, LidarScan)] for said in (alone, together)]
    assert len(ranges[0]) == len(ranges[1]) > 2


def test_beyond_the_most_states_of_a_tick_cars_report_in_turns(monkeypatch):
    monkeypatch.setattr(publish, "STATES_A_TICK", 4)
    _, said = run(50, cars(10))
    states = messages(said, VehicleState)
    assert [len(messages([tick], VehicleState)) for tick in said] == [4] * 50
    assert set(Counter(state.vehicle for state in states).values()) == {20}
    assert sorted(s.seq for s in states if s.vehicle == "n7") == list(range(1, 21))


def test_what_nobody_hears_is_not_made():
    asked = []

    def nobody(kind, where):
        asked.append(kind)
        return False

    _, said = run(60, cars(5), is_wanted=nobody)
    made = {type(item) for tick in said for item in tick}
    assert made - {PersistedState} <= {CityEvent, PartStatus, RadioStatus, Trip, WorldDefinition}
    assert {VehicleState, WorldSnapshot, LidarScan} <= set(asked)


def test_only_the_car_that_somebody_listens_to_is_measured():
    def hears_third(kind: type[Message], where):
        return kind is LidarScan and where.get("vehicle", "n3") == "n3"

    _, said = run(60, cars(5), is_wanted=hears_third)
    assert {scan.vehicle for scan in messages(said, LidarScan)} == {"n3"}
    assert messages(said, VehicleSensors) == []
