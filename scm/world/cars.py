"""All cars of the city: as arrays, by their dynamics, and by name; and what tells them apart."""

from collections.abc import Container, Iterator
from dataclasses import dataclass, field

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.maps.vehicle_tags import bound_tag
from scm.records.city_map import CityMap
from scm.store.records import CarRecord, EpochRecord
from scm.v2x.exchange import PersistedState
from scm.vehicles.external_vehicles import ExternalVehicles
from scm.world.garage import Garage
from scm.world.hosted import HostedCar
from scm.world.remote import RemoteCar
from scm.world.vehicle_arrays import Numbers, VehicleArrays

AnyCar = HostedCar | RemoteCar
GOLDEN_RATIO = 0.618034


@dataclass(slots=True)
class Cars:
    """All cars of the city.

    Attributes:
        arrays: What every car has, by vehicle index.
        garage: The dynamics of the hosted cars.
        hosted: Cars simulated here, by name, in the order they came; likewise `remote`.
        leased: Hosted cars that somebody else drives.
    """

    arrays: VehicleArrays
    garage: Garage
    hosted: dict[str, HostedCar] = field(default_factory=dict)
    remote: dict[str, RemoteCar] = field(default_factory=dict)
    leased: dict[str, HostedCar] = field(default_factory=dict)

    def all(self) -> Iterator[AnyCar]:
        """Yield all cars, hosted ones first."""
        yield from self.hosted.values()
        yield from self.remote.values()

    def get(self, name: str) -> AnyCar | None:
        """Return a car by name."""
        return self.hosted.get(name) or self.remote.get(name)

    def locate(self, external: ExternalVehicles) -> None:
        """Write where all cars are and how they move into the arrays and `external`."""
        self.garage.locate(self.arrays)
        for car in self.remote.values():
            index, state = car.index, car.state
            self.arrays.put(index, car.pose)
            external.x[index], external.y[index], external.yaw[index] = car.pose
            if state is not None:
                external.speed[index] = state.speed_mps
                external.lateral_speed[index] = state.lateral_speed_mps
                external.yaw_rate[index] = state.yaw_rate_radps

    def add(self, name: str, car_name: str, pose: Pose2, *, hosted: bool) -> int:
        """Give a new car a vehicle index, and return it.

        Raises:
            RunError: when the city is full.
        """
        index = self.arrays.add(name, pose, hosted=hosted)
        _, self.arrays.front[index] = self.garage.car(car_name).vector("body.footprint_x_m")
        return index

    def free_name(self, others: Container[str] = ()) -> str:
        """Return the first name of the form `n1` that no car has, nor any of `others`."""
        number = 1
        while self.get(f"n{number}") is not None or f"n{number}" in others:
            number += 1
        return f"n{number}"


@dataclass(slots=True)
class Identities:
    """What tells cars apart.

    Attributes:
        tags: The numbers of the tags on their roofs.
        highest_epoch: Of any car that left: a newcomer's is higher, whatever its name.
        lidars: How many LIDARs have come.
    """

    tags: Numbers
    highest_epoch: int = 0
    lidars: int = 0

    def tag_for(self, city_map: CityMap, name: str, worn: int | None) -> int:
        """Return the tag on a new car's roof: the one that it wears, its name's, or a free one."""
        if worn is not None:
            return self.tags.claim(worn)
        bound = bound_tag(city_map, name)
        if bound is not None and self.tags.is_free(bound):
            return self.tags.claim(bound)
        return self.tags.acquire()

    def first_epoch(self, now_ns: int) -> int:
        """Return an epoch above all that any car of this city has had so far."""
        return max(now_ns // NS_PER_MS, self.highest_epoch + 1)

    def scan_offset(self) -> float:
        """Return when in a period a new LIDAR scans first: spread evenly, however many come."""
        self.lidars += 1
        return self.lidars * GOLDEN_RATIO % 1.0

    def epoch_record(self) -> PersistedState:
        """Return the highest epoch, to be stored."""
        return PersistedState("latches", "epochs", EpochRecord(highest=self.highest_epoch))


def lease_record(car: AnyCar) -> PersistedState:
    """Return a car and its lease, to be stored."""
    x, y, yaw = car.pose
    lease = car.lease
    record = CarRecord(
        car_file=car.car_file,
        hosted=isinstance(car, HostedCar),
        x_m=x,
        y_m=y,
        yaw_rad=yaw,
        home=lease.home,
        owner=lease.owner,
        epoch=lease.epoch,
        ttl_ms=lease.ttl_ms,
        tag_id=car.tag_id,
        circulates=isinstance(car, HostedCar) and car.circulates,
    )
    return PersistedState("leases", car.name, record)
