"""What the world leaves behind, and how the next run takes it up."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.store.memory import MemoryStore
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.join_request import JoinRequest
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.world.part import WorldPart
from scm.world.restore import read_restored

MAP = load_map("driving_school")


class Reborn:
    """A world that is killed and started again from its store."""

    def __init__(self, hosted=("n1", "n2")):
        self.store, self.hosted = MemoryStore(), hosted
        self.city = Lockstep([])
        self.part = None
        self.start()

    def start(self):
        hosted = tuple((name, "nigel") for name in self.hosted)
        self.part = WorldPart(MAP, hosted=hosted, restored=read_restored(self.store))
        self.city.add(self.part, self.store)
        self.city.run_for(0.1)

    def kill(self):
        self.city.kill(self.part)
        self.start()

    @property
    def world(self):
        return self.part.world

    def lease(self, verb, owner="ann", vehicle="n1", **more):
        return self.city.call(LeaseRequest(vehicle=vehicle, owner=owner, verb=verb, **more))


@pytest.fixture
def reborn():
    reborn = Reborn()
    yield reborn
    reborn.city.close()


def test_cars_that_came_and_went_by_request_are_there_and_gone_after_a_kill(reborn):
    reborn.city.call(SpawnRequest(vehicle="van"))
    reborn.city.call(RemoveRequest(vehicle="n2"))
    reborn.kill()
    assert sorted(reborn.world.cars.hosted) == ["n1", "van"]
    assert reborn.world.cars.hosted["n1"].is_sent
    assert not reborn.world.cars.hosted["van"].is_sent


def test_a_lease_is_its_holders_after_a_kill_and_its_commands_are_obeyed(reborn):
    held = reborn.lease("acquire", ttl_ms=5000)
    reborn.kill()
    lease = reborn.world.cars.hosted["n1"].lease
    assert (lease.owner, lease.epoch, lease.ttl_ms) == ("ann", held.epoch, 5000)
    command = DriveCommand(
        vehicle="n1", t_ns=0, epoch=held.epoch, seq=1, throttle=0.5, steering=0.0
    )
    reborn.city.publish(command)
    reborn.city.run_for(0.06)
    assert reborn.world.cars.hosted["n1"].mode == "drive"
    assert reborn.lease("renew", epoch=held.epoch).epoch == held.epoch


def test_until_its_holder_speaks_a_leased_car_stands_after_a_kill_and_then_it_is_lost(reborn):
    held = reborn.lease("acquire", ttl_ms=5000)
    reborn.kill()
    assert reborn.world.cars.hosted["n1"].mode == "hold"
    reborn.city.run_for(1.0)
    lease = reborn.world.cars.hosted["n1"].lease
    assert (lease.owner, lease.epoch) == ("world", held.epoch + 1)


def test_a_lease_that_was_lost_is_not_taken_up_again(reborn):
    held = reborn.lease("acquire", ttl_ms=100)
    reborn.city.run_for(0.3)
    reborn.kill()
    lease = reborn.world.cars.hosted["n1"].lease
    assert lease.owner == "world"
    assert lease.epoch > held.epoch


def test_a_name_that_is_used_again_has_a_higher_epoch_than_ever_before(reborn):
    stolen = [
        reborn.lease("steal", owner=f"o{n}", reason="wants it", ttl_ms=60_000).epoch
        for n in range(40)
    ]
    assert stolen == sorted(set(stolen))
    car = reborn.world.cars.hosted["n1"]
    far = stolen[-1] + 10**9  # more changes than milliseconds pass
    car.lease = replace(car.lease, epoch=far)
    reborn.city.call(RemoveRequest(vehicle="n1"))
    reborn.kill()
    reborn.city.call(SpawnRequest(vehicle="n1"))
    assert reborn.world.cars.hosted["n1"].lease.epoch > far


def test_the_epoch_grows_across_a_kill_though_the_clock_was_set_back():
    reborn = Reborn()
    joined = reborn.city.call(JoinRequest(vehicle="r1", session="s1"))
    stolen = reborn.lease("steal", vehicle="r1", owner="ann", reason="test")
    assert stolen.epoch > joined.epoch
    city = Lockstep([])  # a clock that begins at 0 again
    part = WorldPart(MAP, restored=read_restored(reborn.store))
    city.add(part, reborn.store)
    city.run_for(0.1)
    again = city.call(JoinRequest(vehicle="r1", session="s2"))
    assert again.epoch > stolen.epoch
    reborn.city.close()
    city.close()


def test_a_car_that_comes_back_has_its_tag_so_that_a_real_one_keeps_its_own(reborn):
    before = reborn.world.cars.hosted["n1"].tag_id
    reborn.city.call(RemoveRequest(vehicle="n1"))
    reborn.city.call(JoinRequest(vehicle="r1", session="s1", tag_id=before))
    reborn.city.call(SpawnRequest(vehicle="n2"))
    worn = reborn.world.cars.hosted["n2"].tag_id
    reborn.kill()
    assert reborn.world.cars.hosted["n2"].tag_id == worn != before
    assert reborn.city.call(JoinRequest(vehicle="r1", session="s2", tag_id=before)).tag_id == before


def test_the_red_button_stays_pressed_over_a_kill_and_released_once_released(reborn):
    reborn.city.call(StopRequest(engaged=True, by="ann"))
    reborn.kill()
    assert (reborn.world.stop.engaged, reborn.world.stop.by) == (True, "ann")
    reborn.city.run_for(1.0)
    assert max(abs(car.speed) for car in reborn.world.cars.hosted.values()) < 1e-3
    reborn.city.call(StopRequest(engaged=False, by="bob"))
    reborn.kill()
    assert not reborn.world.stop.engaged


def test_a_retry_after_a_kill_gets_the_answer_and_no_second_car(reborn):
    request = SpawnRequest(request_id="r1")
    first = reborn.city.call(request)
    reborn.kill()
    assert reborn.city.call(request) == first
    assert sorted(reborn.world.cars.hosted) == ["n1", "n2", first.vehicle]


def test_car_whose_place_and_all_spawns_are_occupied_comes_back_on_a_lane():
    reborn = Reborn(hosted=())
    for _ in MAP.spawns:
        reborn.city.call(SpawnRequest())
    car = next(iter(reborn.world.cars.hosted.values()))
    record = read_restored(reborn.store).cars[car.name]
    reborn.store.put("leases", "world/zz", msgspec.json.encode(record))
    reborn.kill()
    pose = reborn.world.cars.hosted["zz"].pose
    assert 0.4 < np.hypot(pose.x - record.x_m, pose.y - record.y_m) < 1.0
    assert reborn.world.roads.nearest(pose).lateral == pytest.approx(0.0, abs=0.01)
    reborn.city.close()


def test_cars_for_which_no_place_is_left_are_reported_and_forgotten():
    reborn = Reborn(hosted=())
    reborn.city.call(SpawnRequest(vehicle="n1"))
    record = read_restored(reborn.store).cars["n1"]
    for number in range(80):
        reborn.store.put("leases", f"world/z{number}", msgspec.json.encode(record))
    reborn.kill()
    there = len(reborn.world.cars.hosted)
    assert len(MAP.spawns) < there < 80
    assert len(read_restored(reborn.store).cars) == there
    reborn.city.close()


def test_without_a_store_the_world_is_the_same_to_the_bit():
    def poses(state):
        city = Lockstep([])
        part = WorldPart(MAP, hosted=(("n1", "nigel"), ("n2", "nigel")))
        city.add(part, state)
        city.run_for(2.0)
        poses = [tuple(car.pose) for car in part.world.cars.hosted.values()]
        city.close()
        return poses

    assert poses(None) == poses(MemoryStore())
