"""The world: everything that one tick moves, and how cars enter and leave it.

`step.tick` moves it. Nothing here knows a bus or a clock: time comes with every call, and stages
return what is to be sent.
"""

import hashlib
from collections.abc import Iterable, Iterator
from functools import partial
from typing import Literal

import numpy as np
from msgspec.structs import replace

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.maps.route import Roads
from scm.maps.segments import wall_segments
from scm.maps.vehicle_tags import bound_tag, reserved_tags
from scm.records.city_map import CityMap, Point
from scm.store.records import CarRecord, EpochRecord
from scm.v2x.exchange import Outgoing, PersistedState
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.vehicles.bank import Bank
from scm.vehicles.car import car_names as all_car_names
from scm.vehicles.cold_start import compile_together, is_first_start
from scm.vehicles.drivers.channel import RANGE
from scm.vehicles.drivers.driver_batch import DriverBatch
from scm.vehicles.drivers.lane_graph import lane_graph_of
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.drivers.trips import Trips
from scm.vehicles.external_vehicles import ExternalVehicles
from scm.vehicles.ground import Ground
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor import Sensor, all_sensors
from scm.world import lease as rules
from scm.world.alerts import Alerts
from scm.world.cam_triggers import CamTriggers
from scm.world.channel_load import ChannelLoad
from scm.world.contact_impulses import ContactImpulses
from scm.world.contacts import Contacts
from scm.world.garage import Garage
from scm.world.hosted import HostedCar
from scm.world.pace import Every, Pace
from scm.world.radio import Radio, Receivers, roadside_places
from scm.world.remote import RemoteCar
from scm.world.solids import outline
from scm.world.state import Identities, RadioState, SensorState
from scm.world.stuck import Stuck
from scm.world.subscribers import Subscribers
from scm.world.vehicle_arrays import Numbers, VehicleArrays

NAME = "world"
PERIOD_NS = 20 * NS_PER_MS
SENSORS = "scm.vehicles.sensors"
SCANNER = "lidar"
DEFAULT_CAR = "nigel"
EYE = "eye"
RATES_HZ = {
    "snapshot": 20.0,
    "second": 1.0,
    "radio": 1.0,
    "denm": 10.0,
    "battery": 1.0,
    "stuck": 5.0,
}

AnyCar = HostedCar | RemoteCar


def generator(seed: int, *names: str) -> np.random.Generator:
    """Return the generator of one component of a run; equal seed and names, equal numbers."""
    digest = hashlib.blake2s("/".join(names).encode()).digest()
    return np.random.default_rng([seed, *digest])


def number(seed: int, *names: str) -> int:
    """Return 31 bits that belong to one component of a run."""
    digest = hashlib.blake2s("/".join((str(seed), *names)).encode(), digest_size=4).digest()
    return int.from_bytes(digest, "big") >> 1


def city_event(
    severity: Literal["info", "warning", "error"],
    name: str,
    text: str,
    now_ns: int,
    vehicle: str | None = None,
) -> CityEvent:
    """Return an event of the world."""
    return CityEvent(
        severity=severity, source=NAME, t_ns=now_ns, name=name, text=text, vehicle=vehicle
    )


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
    )
    return PersistedState("leases", car.name, record)


class World:
    """The shared state of one city.

    Args:
        city_map: The city.
        seed: Of all noise and of lost radio frames.
        capacity: Most cars at a time.
        loss: Share of radio frames that get lost; 0: as the map says.
        prepare: Car files whose kernels are compiled now and not when their first car comes.

    Attributes:
        ground: The floor under the wheels, and the wind.
        vehicles: What every car has, as arrays by vehicle index.
        garage: The dynamics of the hosted cars.
        contacts: The contact solver.
        impulses: What contacts did in this tick.
        drivers: The drivers of the hosted cars, and the radio frames that they receive.
        trips: Where these were sent.
        radio: The radio to everybody else.
        sensors: The sensors of all cars.
        subscribers: Who subscribes to what.
        hosted: Cars simulated here, by name, in the order they came; likewise `remote`.
        sessions: Of agents that are on the bus: the station of each.
        leased: Hosted cars that somebody else drives.
        stop: The state of the emergency stop.
        ignored: Messages without effect: unknown cars, commands without the lease.
        alerts: What is wrong with cars and was reported.
        identities: What tells cars apart.
    """

    def __init__(
        self,
        city_map: CityMap,
        seed: int = 0,
        capacity: int = 256,
        loss: float = 0.0,
        prepare: Iterable[str] = (DEFAULT_CAR,),
    ) -> None:
        self.city_map = city_map
        self.seed = seed
        self.roads = Roads(city_map)
        self.ground = Ground(city_map, seed)
        self.vehicles = VehicleArrays(capacity)
        self.garage = Garage(capacity, self.ground.fit)
        self.contacts = Contacts(city_map)
        self.impulses = ContactImpulses()
        radio = replace(city_map.radio, loss=loss) if loss else city_map.radio
        self.drivers = DriverBatch(lane_graph_of(self.roads), capacity, seed=seed, radio=radio)
        self.trips = Trips(self.drivers, spread=True)
        channel, roadside = self.drivers.channel, roadside_places(city_map)
        self.radio = RadioState(
            Radio(channel, generator(seed, NAME, "radio")),
            ChannelLoad(radio, float(channel.numbers[RANGE]), channel.load),
            CamTriggers(capacity),
            roadside,
            Receivers(roadside),
        )
        walls = WallGrid(wall_segments(city_map))
        sensors = all_sensors()
        self._compile(prepare, sensors[SCANNER], walls)
        self.sensors = SensorState(
            {name: Bank(sensor, seed, capacity) for name, sensor in sensors.items()},
            {
                name: np.full((capacity, len(sensor.values)), np.nan)
                for name, sensor in sensors.items()
                if name != SCANNER
            },
            ExternalVehicles(capacity),
            walls,
        )
        self.subscribers = Subscribers()
        self.hosted: dict[str, HostedCar] = {}
        self.remote: dict[str, RemoteCar] = {}
        self.sessions: dict[str, str] = {}
        self.leased: dict[str, HostedCar] = {}
        self.pace = Pace(PERIOD_NS)
        self.every = {name: Every(rate_hz) for name, rate_hz in RATES_HZ.items()}
        self.stop = CityStop(t_ns=0, engaged=False)
        self.tick = self.ignored = 0
        self.alerts = Alerts(Stuck(capacity))
        first_tag = city_map.first_vehicle_tag_id
        self.identities = Identities(Numbers(first_tag, never=reserved_tags(city_map)))

    def cars(self) -> Iterator[AnyCar]:
        """Yield all cars, hosted ones first."""
        yield from self.hosted.values()
        yield from self.remote.values()

    def car(self, name: str) -> AnyCar | None:
        """Return a car by name."""
        return self.hosted.get(name) or self.remote.get(name)

    def use_threads(self, count: int) -> None:
        """Use several threads for dynamics and drivers: for lockstep, on otherwise idle cores.

        It changes no number. Live, with the processors shared, threads wait for each other: there
        one is better.
        """
        self.garage.use_threads(count)
        self.drivers.threads = count

    def receivers(self) -> Receivers:
        """Return all stations that frames are brought to, but for the hosted cars."""
        if not self.remote:
            return self.radio.units
        cars = {car.name: (car.pose.x, car.pose.y) for car in self.remote.values()}
        return Receivers({**self.radio.roadside, **cars})

    def antenna(self, station: str) -> Point | None:
        """Return where a station that is no hosted car sends from; None: nobody knows."""
        if (car := self.remote.get(station)) is not None:
            return car.pose.x, car.pose.y
        if station == EYE or station.startswith(f"{EYE}-"):
            (left, right), (low, high) = self.city_map.floor.x_m, self.city_map.floor.y_m
            return 0.5 * (left + right), 0.5 * (low + high)
        return self.radio.roadside.get(station)

    def lost_ns(self, station: str) -> int:
        """Return the time that passed without a station's car being moved, since it came [ns]."""
        car = self.remote.get(station)
        return self.pace.lost_ns if car is None else car.missed_ns

    def locate(self) -> None:
        """Note where all cars are and how they move."""
        vehicles, placed = self.vehicles, self.sensors.external
        self.garage.locate(vehicles)
        for car in self.remote.values():
            vehicles.put(car.index, car.pose)
            placed.x[car.index], placed.y[car.index], placed.yaw[car.index] = car.pose
            if car.state is not None:
                placed.speed[car.index] = car.state.speed_mps
                placed.lateral_speed[car.index] = car.state.lateral_speed_mps
                placed.yaw_rate[car.index] = car.state.yaw_rate_radps

    def host(
        self, name: str, car_name: str, pose: Pose2, now_ns: int, tag_id: int | None = None
    ) -> HostedCar:
        """Put a car onto the map that the world simulates; it stands until it is sent.

        `tag_id` is the tag that it had before, if it had one.

        Raises:
            CarError: when there is no such car file.
            RunError: when no room is left for cars of this file.
        """
        model = self.garage.car(car_name)
        index = self._add(name, car_name, pose, hosted=True)
        fleet, row = self.garage.park(car_name, pose, index)
        self.ground.place_at_rest(fleet, row)
        self.drivers.enter(index, limits_of(model), number(self.seed, name, "driver"))
        for kind, bank in self.sensors.banks.items():
            bank.fit(index, name, model, fleet, row, now_ns, self._offset(kind))
        self.hosted[name] = HostedCar(
            name=name,
            car=model,
            car_file=car_name,
            tag_id=self._tag(name, tag_id),
            index=index,
            vehicles=self.vehicles,
            fleet=fleet,
            row=row,
            lease=rules.grant(NAME, self._first_epoch(now_ns)),
        )
        return self.hosted[name]

    def admit(
        self,
        name: str,
        kind: str,
        session: str,
        car_name: str,
        pose: Pose2,
        now_ns: int,
        tag_id: int | None = None,
    ) -> RemoteCar:
        """Add a car with its own dynamics to the city; `tag_id` is the tag on its roof, if any.

        Raises:
            CarError: when there is no such car file.
        """
        model = self.garage.car(car_name)
        index = self._add(name, car_name, pose, hosted=False, movable=kind != "real")
        if kind != "real":
            placed, offset = self.sensors.external, self._offset(SCANNER)
            self.sensors.banks[SCANNER].fit(index, name, model, placed, index, now_ns, offset)
        self.remote[name] = RemoteCar(
            name=name,
            kind=kind,
            session=session,
            car=model,
            car_file=car_name,
            tag_id=self._tag(name, tag_id),
            index=index,
            lease=rules.grant(name, self._first_epoch(now_ns)),
            pose=pose,
            received_ns=now_ns,
        )
        return self.remote[name]

    def arrival(self, car: AnyCar, now_ns: int, worn: int | None = None) -> list[Outgoing]:
        """Return what follows from a car that has just come; `worn` is the tag that it has."""
        bound = None if worn is not None else bound_tag(self.city_map, car.name)
        if bound is None or bound == car.tag_id:
            return [lease_record(car)]
        wearer = next((one.name for one in self.cars() if one.tag_id == bound), "another car")
        text = (
            f"{car.name} has tag {car.tag_id}: {wearer} wears tag {bound}, which is printed for it"
        )
        return [city_event("warning", "other_tag", text, now_ns, car.name), lease_record(car)]

    def remove(self, name: str) -> list[Outgoing]:
        """Remove a car from the map, if there is one of that name; return what must be stored."""
        if name in self.hosted:
            car = self.hosted.pop(name)
            self.leased.pop(name, None)
            self.garage.scrap(car.car_file, car.row)
            return self._forget(car)
        if name in self.remote:
            return self._forget(self.remote.pop(name))
        return []

    def free_name(self) -> str:
        """Return a name for a car that has none."""
        while self.car(f"n{self.identities.unnamed + 1}") is not None:
            self.identities.unnamed += 1
        return f"n{self.identities.unnamed + 1}"

    def _compile(self, car_names: Iterable[str], scanner: Sensor, walls: WallGrid) -> None:
        """Compile or load now all that a tick calls, so that no car waits for it later."""
        others = all_car_names() if is_first_start() else ()
        names = tuple(dict.fromkeys((*car_names, *others)))
        for name in (DEFAULT_CAR, *names):
            self.garage.car(name)  # read once, and not in each process
        compile_together(
            {
                "drivers": self.drivers.warm_up,
                "LIDAR": lambda: self._warm_scanner(scanner, walls),
                **{name: partial(self._warm_car, name) for name in names},
                "contacts": self.contacts.warm,
            }
        )

    def _warm_car(self, name: str) -> None:
        self.ground.warm(self.garage.prepare(name))

    def _warm_scanner(self, scanner: Sensor, walls: WallGrid) -> None:
        """Scan once for nobody, so that the kernels are there before the first car scans."""
        bank, model = Bank(scanner, self.seed, 1), self.garage.car(DEFAULT_CAR)
        bank.fit(0, "nobody", model, ExternalVehicles(1), 0, 0)
        nowhere = Scene(walls, np.zeros((0, 4)), np.zeros(0, np.int64))
        bank.step(0, lambda: nowhere)

    def has_room(self, car_name: str, pose: Pose2) -> bool:
        """Return whether a car would stand there on the floor and touch no wall and no box.

        Raises:
            CarError: when there is no such car file.
        """
        car, hull, floor = (
            self.garage.car(car_name),
            self.garage.hull(car_name),
            self.city_map.floor,
        )
        corners = outline(car, np.array([[*pose]]))[:, :2]
        low, high = zip(floor.x_m, floor.y_m, strict=True)
        if (corners < low).any() or (corners > high).any():
            return False
        ahead = car.vector("body.footprint_x_m")[1] - hull.front
        return self.contacts.is_free(hull, Pose2(*pose.apply(ahead, 0.0), pose.yaw))

    def _add(
        self, name: str, car_name: str, pose: Pose2, *, hosted: bool, movable: bool = True
    ) -> int:
        hull = self.garage.hull(car_name, movable=movable)
        index = self.vehicles.add(name, pose, hosted=hosted)
        self.contacts.add(index, hull)
        _, self.vehicles.front[index] = self.garage.car(car_name).vector("body.footprint_x_m")
        return index

    def _tag(self, name: str, worn: int | None) -> int:
        """Return the tag on a new car's roof: the one that it wears, its name's, or a free one."""
        tags = self.identities.tags
        if worn is not None:
            return tags.claim(worn)
        bound = bound_tag(self.city_map, name)
        if bound is not None and tags.is_free(bound):
            return tags.claim(bound)
        return tags.acquire()

    def _first_epoch(self, now_ns: int) -> int:
        """Return an epoch above all that any car of this city has had so far."""
        return max(now_ns // NS_PER_MS, self.identities.highest_epoch + 1)

    def _forget(self, car: AnyCar) -> list[Outgoing]:
        index = car.index
        self.identities.highest_epoch = max(self.identities.highest_epoch, car.lease.epoch)
        self.contacts.remove(index)
        self.trips.forget(index)
        self.drivers.leave(index)
        self.radio.cams.forget(index)
        self.alerts.stuck.forget(index)
        self.sensors.remove(index)
        self.impulses.event_ns.pop(car.name, None)
        self.impulses.touched_ns.pop(car.name, None)
        self.identities.tags.release(car.tag_id)
        self.identities.unnamed = 0
        self.vehicles.remove(index)
        return [
            PersistedState("leases", car.name, None),
            PersistedState("latches", "epochs", EpochRecord(highest=self.identities.highest_epoch)),
        ]

    def _offset(self, kind: str) -> float:
        # The golden ratio spreads the cars' first scans evenly over a period, however many come.
        self.identities.scanners += kind == SCANNER
        return self.identities.scanners * 0.618034 % 1.0 if kind == SCANNER else 0.0
