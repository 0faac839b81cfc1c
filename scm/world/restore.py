"""Restore the state of the world that outlives its process: hosted cars, leases, emergency stop.

Changes leave a step as `PersistedState`, and return at the next start as `RestoredState`. A hosted
car comes back at its old place, or the first free one; its leaseholder keeps the lease, under the
same epoch and with the full time to live, since nobody could renew it meanwhile. Cars of agents
join again by themselves, under a newer epoch.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.store.records import CarRecord, EpochRecord, StopRecord, record, records
from scm.store.repository import Repository
from scm.v2x.exchange import Outgoing, PersistedState
from scm.world.alerts import NAME, city_event
from scm.world.border_state import ArrivalRecord, OutgoingRecord, leaving
from scm.world.cars import lease_record
from scm.world.driving import hand_over
from scm.world.hosted import HostedCar
from scm.world.lease import Lease
from scm.world.requests import is_free
from scm.world.world import World

PLACE_EVERY_M = 0.25  # between the places on lanes that are tried


@dataclass(frozen=True, slots=True)
class RestoredState:
    """What an earlier run of the world left behind.

    Attributes:
        is_first: Whether there was none.
        cars: By name.
        highest_epoch: No new lease may have one as low as this.
        stop: The city stop; None: it was never used.
        outgoing: Cars on their way to the next city, by name.
        arrivals: The last transfers from other cities, by `<city>/<car>`.
    """

    is_first: bool = True
    cars: Mapping[str, CarRecord] = field(default_factory=dict)
    highest_epoch: int = 0
    stop: StopRecord | None = None
    outgoing: Mapping[str, OutgoingRecord] = field(default_factory=dict)
    arrivals: Mapping[str, ArrivalRecord] = field(default_factory=dict)


def read_restored(store: Repository) -> RestoredState:
    """Read what earlier runs of the world left in a store.

    Raises:
        StoreError: when it cannot be read.
    """
    cars = records(store, "leases", NAME, CarRecord)
    epochs = record(store, "latches", NAME, "epochs", EpochRecord)
    stop = record(store, "latches", NAME, "stop", StopRecord)
    leavers = [car.epoch for car in cars.values() if not car.hosted]
    highest = max([0 if epochs is None else epochs.highest, *leavers])
    outgoing = records(store, "handovers", f"{NAME}/out", OutgoingRecord)
    arrivals = records(store, "handovers", f"{NAME}/in", ArrivalRecord)
    return RestoredState(epochs is None, cars, highest, stop, outgoing, arrivals)


def restore(world: World, restored: RestoredState, now_ns: int) -> list[Outgoing]:
    """Put the cars of an earlier run back, under the leases that they had."""
    out: list[Outgoing] = []
    world.identities.highest_epoch = max(world.identities.highest_epoch, restored.highest_epoch)
    out += _restore_border(world, restored, now_ns)
    for name, car in restored.cars.items():
        if car.hosted:
            out += _restore_car(world, name, car, now_ns)
        else:
            out.append(PersistedState("leases", name, None))
    return [*out, world.identities.epoch_record()]


def _restore_car(world: World, name: str, record: CarRecord, now_ns: int) -> list[Outgoing]:
    pose = _place(world, Pose2(record.x_m, record.y_m, record.yaw_rad))
    if pose is None:
        world.identities.highest_epoch = max(world.identities.highest_epoch, record.epoch)
        text = f"{name} could not be put back onto the map: no place is free"
        event = city_event("warning", "vehicle_removed", text, now_ns, name)
        return [PersistedState("leases", name, None), event]
    car = world.host(name, record.car_file, pose, now_ns, record.tag_id)
    out = world.arrival(car, now_ns, record.tag_id)
    car.lease = Lease(record.home, record.home, record.epoch)
    car.circulates = record.circulates
    if record.owner != record.home:
        out += _lease_again(world, car, record, now_ns)
    return [*out, lease_record(car)]


def _lease_again(world: World, car: HostedCar, record: CarRecord, now_ns: int) -> list[Outgoing]:
    """Renew the leaseholder's lease; the car stands until its first command."""
    before = record.epoch - 1
    car.lease = Lease(record.home, record.home, before)
    expires_ns = now_ns + record.ttl_ms * NS_PER_MS
    lease = Lease(record.home, record.owner, record.epoch, record.ttl_ms, expires_ns)
    handed_over = hand_over(world, car, lease, now_ns)
    text = f"{car.name} is still leased to {record.owner} after the world was started again"
    return [handed_over, city_event("info", "lease_kept", text, now_ns, car.name)]


def _place(world: World, preferred: Pose2) -> Pose2 | None:
    if is_free(world, preferred):
        return preferred
    spawns = (world.roads.spawn_pose(place.name) for place in world.city_map.spawns)
    pose = next((pose for pose in spawns if is_free(world, pose)), None)
    return pose or _place_on_lane(world, preferred)


def _place_on_lane(world: World, preferred: Pose2) -> Pose2 | None:
    """Return the free place on a lane that is nearest to one; None: all lanes are full."""
    poses = [
        path.at(s)
        for path in (world.roads.lanes[lane.name] for lane in world.city_map.lanes)
        for s in np.arange(0.5 * PLACE_EVERY_M, path.length_m, PLACE_EVERY_M)
    ]
    poses.sort(key=lambda pose: math.hypot(pose.x - preferred.x, pose.y - preferred.y))
    return next((pose for pose in poses if is_free(world, pose)), None)


def _restore_border(world: World, restored: RestoredState, now_ns: int) -> list[Outgoing]:
    """Send the transfers of an earlier run again, and remember whose were answered."""
    border = world.border
    for key, arrival in restored.arrivals.items():
        city, _, vehicle = key.partition("/")
        border.arrivals[city, vehicle] = arrival
    roads = {(road.city, road.to): road for road in border.exits.values()}
    out: list[Outgoing] = []
    for name, away in restored.outgoing.items():
        road = roads.get((away.city, away.request.lane))
        if road is None:  # the map has changed: the car stays in the store
            text = f"{name} cannot go on to {away.city}: no road of this map leads there"
            out.append(city_event("error", "handover_waits", text, now_ns, name))
        else:
            border.leaving[name] = leaving(road, away.request, now_ns)
    return out
