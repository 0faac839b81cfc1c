"""What of the world outlives its process: its hosted cars, all leases, the red button.

What changes goes out with the step as `Keep`, and comes back at the next start as `Kept`. A hosted
car comes back at the place where it was put, or the first free one; its lease is its holder's as
before, under the same epoch and with the whole of its time to live, for nobody could renew it
meanwhile. Cars of agents join again by themselves, under a newer epoch.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.store.records import CarRecord, EpochRecord, StopRecord, record, records
from scm.store.repository import Repository
from scm.v2x.exchange import Keep
from scm.world.driving import take_over
from scm.world.hosted import HostedCar
from scm.world.lease import Lease
from scm.world.requests import is_free
from scm.world.world import NAME, World


@dataclass(frozen=True, slots=True)
class Kept:
    """What an earlier run of the world left behind.

    Attributes:
        is_first: Whether there was none.
        cars: By name.
        highest_epoch: No new lease may have one as low as this.
        stop: The red button; None: it was never touched.
    """

    is_first: bool = True
    cars: Mapping[str, CarRecord] = field(default_factory=dict)
    highest_epoch: int = 0
    stop: StopRecord | None = None


def read_kept(store: Repository) -> Kept:
    """Read what earlier runs of the world left in a store.

    Raises:
        StoreError: when it cannot be read.
    """
    cars = records(store, "leases", NAME, CarRecord)
    epochs = record(store, "latches", NAME, "epochs", EpochRecord)
    stop = record(store, "latches", NAME, "stop", StopRecord)
    leavers = [car.epoch for car in cars.values() if not car.hosted]
    highest = max([0 if epochs is None else epochs.highest, *leavers])
    return Kept(epochs is None, cars, highest, stop)


def bring_back(world: World, kept: Kept, now_ns: int) -> None:
    """Put the cars of an earlier run back, under the leases that they had."""
    world.highest_epoch = max(world.highest_epoch, kept.highest_epoch)
    for name, car in kept.cars.items():
        if car.hosted:
            _bring_back(world, name, car, now_ns)
        else:
            world.outbox.append(Keep("leases", name, None))
    world.outbox.append(Keep("latches", "epochs", EpochRecord(highest=world.highest_epoch)))


def _bring_back(world: World, name: str, record: CarRecord, now_ns: int) -> None:
    pose = _place(world, Pose2(record.x_m, record.y_m, record.yaw_rad))
    if pose is None:
        world.highest_epoch = max(world.highest_epoch, record.epoch)
        world.outbox.append(Keep("leases", name, None))
        text = f"{name} could not be put back onto the map: no place is free"
        world.say("warning", "vehicle_removed", text, now_ns, name)
        return
    car = world.host(name, record.car_file, pose, now_ns, record.tag_id)
    car.lease = Lease(record.home, record.home, record.epoch)
    if record.owner != record.home:
        _lease_again(world, car, record, now_ns)
    world.keep(car)


def _lease_again(world: World, car: HostedCar, record: CarRecord, now_ns: int) -> None:
    """Let the holder go on; until a command of its own comes the car stands."""
    before = record.epoch - 1
    car.lease = Lease(record.home, record.home, before)
    expires_ns = now_ns + record.ttl_ms * NS_PER_MS
    lease = Lease(record.home, record.owner, record.epoch, record.ttl_ms, expires_ns)
    take_over(world, car, lease, now_ns)
    text = f"{car.name} is still leased to {record.owner} after the world was started again"
    world.say("info", "lease_kept", text, now_ns, car.name)


def _place(world: World, wished: Pose2) -> Pose2 | None:
    if is_free(world, wished):
        return wished
    poses = (world.roads.spawn_pose(place.name) for place in world.city_map.spawns)
    return next((pose for pose in poses if is_free(world, pose)), None)
