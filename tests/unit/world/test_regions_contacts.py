"""Cars that crash into each other on a cut: contacts have one owner, and equal one world."""

import math

from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.world.hosted import ELSEWHERE
from scm.world.part import WorldPart
from scm.world.regions.cut import cut_map
from scm.world.regions.part import RegionsPart
from scm.world.regions.transfer import digest

MAP, REGIONS, SEED = load_map("grid:3x3:6"), 4, 5
SPAN_S, THROTTLE = 4.0, 0.8
PLACES_M = (-1.1, -0.6, 0.6, 1.1)  # before and behind the cut, facing it


def crossings(regions):
    """Return the places where lanes cross a cut, heading across it."""
    cut, roads = cut_map(MAP, regions), roads_of(MAP)
    found = []
    for name in roads.lanes:
        length = roads.length_of(name)
        steps = [0.05 * k for k in range(int(length / 0.05))]
        poses = [roads.lanes[name].at(s) for s in steps]
        sides = [cut.region_of(pose.x, pose.y) for pose in poses]
        at = next((k for k in range(1, len(sides)) if sides[k] != sides[k - 1]), None)
        if at is not None and len(set(sides)) == 2 and 1.8 < steps[at] < length - 1.8:
            found.append(poses[at])
    return found


class Watched(BasePart):
    """A world; it notes all cars' states each tick, and pairs that touch over a cut."""

    def __init__(self, part, worlds, cut):
        self._part, self._worlds, self._cut = part, worlds, cut
        self.name, self.role, self.period_ns = part.name, part.role, part.period_ns
        self.services = part.services
        self.cars, self.over_cut = [], 0

    @property
    def subscriptions(self):
        return self._part.subscriptions

    def step(self, now_ns, inbox):
        out = self._part.step(now_ns, inbox)
        found = {}
        for world in self._worlds:
            for name, car in world.cars.hosted.items():
                if car.row != ELSEWHERE:
                    found[name] = digest(world, car, now_ns)
            for slots, pairs in world.alerts.stuck.touches(now_ns):
                for a, b in pairs.tolist():
                    if min(a, b) >= 0:
                        x, y = world.cars.arrays.x[slots], world.cars.arrays.y[slots]
                        sides = {self._cut.region_of(x[i], y[i]) for i in (a, b)}
                        self.over_cut += len(sides) == 2
        self.cars.append(found)
        return out


def crash(part, worlds, regions):
    """Drive cars into each other where a cut into so many regions is."""
    watched = Watched(part, worlds, cut_map(MAP, regions))
    names = []
    with Lockstep([watched]) as city:
        for place in crossings(regions)[:4]:
            for ahead in PLACES_M:
                x, y = place.apply(ahead, 0.03 * ahead)
                yaw = place.yaw if ahead < 0.0 else place.yaw + math.pi
                name = f"n{len(names) + 1}"
                spawn = f"{x:.3f},{y:.3f},{math.degrees(yaw):.1f}"
                assert isinstance(city.call(SpawnRequest(vehicle=name, spawn=spawn)), SpawnReply)
                names.append(name)
        epochs = {}
        for name in names:
            reply = city.call(LeaseRequest(vehicle=name, owner="me", verb="acquire", ttl_ms=60_000))
            assert isinstance(reply, LeaseReply)
            epochs[name] = reply.epoch
        for k in range(round(SPAN_S / 0.1)):
            for number, name in enumerate(names):
                throttle = THROTTLE * (1.0 + 0.1 * (number % 3)) * (-1.0 if k > 28 else 1.0)
                city.publish(
                    DriveCommand(
                        vehicle=name, t_ns=city.now_ns, seq=k, epoch=epochs[name],
                        throttle=throttle, steering=0.05 * (number % 5 - 2),
                    )
                )  # fmt: skip
            city.run_for(0.1)
    return watched


def test_crash_on_a_cut_equals_one_world_bit_by_bit():
    part = WorldPart(MAP, SEED, room=32)
    whole = crash(part, [part.world], REGIONS)
    assert whole.over_cut > 100
    cut = RegionsPart(MAP, REGIONS, SEED, room=32)
    got = crash(cut, [region.world for region in cut.regions], REGIONS)
    assert sum(region.ownership.moved for region in cut.regions) > 4
    for tick, (expected, found) in enumerate(zip(whole.cars, got.cars, strict=True)):
        wrong = [name for name in expected if found.get(name) != expected[name]]
        assert not wrong, f"tick {tick}: {wrong}"
    assert sum(region.ownership.missed for region in cut.regions) == 0
