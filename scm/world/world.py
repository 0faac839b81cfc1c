"""The world: everything that one tick moves, and how cars enter and leave it.

`step.tick` moves it. Nothing here knows a bus or a clock: time comes with every call, and stages
return what is to be sent.
"""

import hashlib
from collections.abc import Iterable
from functools import partial

import numpy as np
from msgspec.structs import replace

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.maps.border import with_roads_beyond
from scm.maps.route import roads_of
from scm.maps.segments import wall_segments
from scm.maps.vehicle_tags import bound_tag, reserved_tags
from scm.records.city_map import CityMap
from scm.v2x.exchange import Outgoing, PersistedState
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
from scm.vehicles.fleet import Fleet
from scm.vehicles.ground import Ground
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor import Sensor, all_sensors
from scm.world import lease as rules
from scm.world.alerts import NAME, Alerts, city_event
from scm.world.border_state import border_of
from scm.world.cam_triggers import CamTriggers
from scm.world.cars import AnyCar, Cars, Identities, lease_record
from scm.world.channel_load import ChannelLoad
from scm.world.collide import ContactImpulses
from scm.world.contacts import Contacts
from scm.world.garage import Garage
from scm.world.hosted import ELSEWHERE, HostedCar
from scm.world.pace import Every, Pace
from scm.world.radio import Radio, RadioState, Receivers, roadside_places
from scm.world.regions.ownership import Ownership
from scm.world.remote import RemoteCar
from scm.world.sensing import SCANNER, SensorState
from scm.world.solids import outline
from scm.world.stuck import Stuck
from scm.world.subscribers import Subscribers
from scm.world.vehicle_arrays import Numbers, VehicleArrays

PERIOD_NS = 20 * NS_PER_MS
DEFAULT_CAR = "nigel"
RATES_HZ = {
    "snapshot": 20.0,
    "second": 1.0,
    "radio": 1.0,
    "denm": 10.0,
    "border": 10.0,
    "battery": 1.0,
    "stuck": 5.0,
}


def generator(seed: int, *names: str) -> np.random.Generator:
    """Return the generator of one component of a run; equal seed and names, equal numbers."""
    digest = hashlib.blake2s("/".join(names).encode()).digest()
    return np.random.default_rng([seed, *digest])


def number(seed: int, *names: str) -> int:
    """Return 31 bits that belong to one component of a run."""
    digest = hashlib.blake2s("/".join((str(seed), *names)).encode(), digest_size=4).digest()
    return int.from_bytes(digest, "big") >> 1


class World:
    """The shared state of one city.

    Args:
        city_map: The city.
        seed: Of all noise and of lost radio frames.
        capacity: Most cars at a time.
        loss: Share of radio frames that get lost; 0: as the map says.
        prepare: Car files whose kernels are compiled now and not when their first car comes.
        city: Its name on the bus, by which the cities next to it know it.

    Attributes:
        ground: The floor under the wheels, and the wind.
        cars: All cars.
        contacts: The contact solver.
        impulses: What contacts did in this tick.
        drivers: The drivers of the hosted cars, and the radio frames that they receive.
        trips: Where these were sent.
        radio: The radio to everybody else.
        sensors: The sensors of all cars.
        subscribers: Who subscribes to what.
        sessions: Of agents that are on the bus: the station of each.
        stop: The state of the emergency stop.
        ignored: Messages without effect: unknown cars, commands without the lease.
        alerts: What is wrong with cars and was reported.
        identities: What tells cars apart.
        border: Cars that come to the border, and those just behind it.
        ownership: Which region of a city that is cut owns which car; None: it is not cut.
    """

    def __init__(
        self,
        city_map: CityMap,
        seed: int = 0,
        capacity: int = 256,
        loss: float = 0.0,
        prepare: Iterable[str] = (DEFAULT_CAR,),
        city: str = "city",
    ) -> None:
        self.city_map = city_map
        self.seed = seed
        self.roads = roads_of(with_roads_beyond(city_map))
        self.ground = Ground(city_map, seed)
        self.cars = Cars(VehicleArrays(capacity), Garage(capacity, self.ground.fit))
        self.contacts = Contacts(city_map)
        self.impulses = ContactImpulses()
        radio = replace(city_map.radio, loss=loss) if loss else city_map.radio
        self.drivers = DriverBatch(lane_graph_of(self.roads), capacity, seed=seed, radio=radio)
        self.border = border_of(city_map, city, self.drivers.lane_graph.numbers)
        self.trips = Trips(self.drivers, spread=True)
        channel, roadside = self.drivers.channel, roadside_places(city_map)
        self.radio = RadioState(
            Radio(channel, seed),
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
        self.ownership: Ownership | None = None
        self.subscribers = Subscribers()
        self.sessions: dict[str, str] = {}
        self.pace = Pace(PERIOD_NS)
        self.every = {name: Every(rate_hz) for name, rate_hz in RATES_HZ.items()}
        self.stop = CityStop(t_ns=0, engaged=False)
        self.tick = self.ignored = 0
        self.alerts = Alerts(Stuck(capacity))
        first_tag = city_map.first_vehicle_tag_id
        self.identities = Identities(Numbers(first_tag, never=reserved_tags(city_map)))

    @property
    def leads(self) -> bool:
        """Whether it sends what is about no car: a whole city does, or its first region."""
        return self.ownership is None or self.ownership.number == 0

    def use_threads(self, count: int) -> None:
        """Use several threads for dynamics and drivers: for lockstep, on otherwise idle cores.

        It changes no number. Live, with the processors shared, threads wait for each other: there
        one is better.
        """
        self.cars.garage.use_threads(count)
        self.drivers.threads = count

    def host(
        self, name: str, car_name: str, pose: Pose2, now_ns: int, tag_id: int | None = None
    ) -> HostedCar:
        """Put a car onto the map that the world simulates; it stands until it is sent.

        `tag_id` is the tag that it had before, if it had one.

        Raises:
            CarError: when there is no such car file.
            RunError: when no room is left for cars of this file.
        """
        model = self.cars.garage.car(car_name)
        index = self._add(name, car_name, pose, hosted=True)
        offset = self.identities.scan_offset()
        fleet, row = self._park(car_name, pose, index)
        self.drivers.enter(index, limits_of(model), number(self.seed, name, "driver"))
        for kind, bank in self.sensors.banks.items():
            bank.fit(index, name, model, fleet, row, now_ns, offset if kind == SCANNER else 0.0)
        car = self.cars.hosted[name] = HostedCar(
            name=name,
            car=model,
            car_file=car_name,
            tag_id=self.identities.tag_for(self.city_map, name, tag_id),
            index=index,
            vehicles=self.cars.arrays,
            fleet=fleet,
            row=row,
            lease=rules.grant(NAME, self.identities.first_epoch(now_ns)),
        )
        return car

    def _park(self, car_name: str, pose: Pose2, index: int) -> tuple[Fleet, int]:
        """Put a car on the floor, unless another region does; return its fleet and row."""
        if self.ownership is not None and not self.ownership.enter(index, pose):
            self.cars.arrays.elsewhere[index] = True
            self.cars.garage.note_elsewhere(car_name, index)
            return self.cars.garage.prepare(car_name), ELSEWHERE
        fleet, row = self.cars.garage.park(car_name, pose, index)
        self.ground.place_at_rest(fleet, row)
        return fleet, row

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
        model = self.cars.garage.car(car_name)
        index = self._add(name, car_name, pose, hosted=False, movable=kind != "real")
        if kind != "real":
            bank, offset = self.sensors.banks[SCANNER], self.identities.scan_offset()
            bank.fit(index, name, model, self.sensors.external, index, now_ns, offset)
        car = self.cars.remote[name] = RemoteCar(
            name=name,
            kind=kind,
            session=session,
            car=model,
            car_file=car_name,
            tag_id=self.identities.tag_for(self.city_map, name, tag_id),
            index=index,
            lease=rules.grant(name, self.identities.first_epoch(now_ns)),
            pose=pose,
            received_ns=now_ns,
        )
        return car

    def arrival(self, car: AnyCar, now_ns: int, worn: int | None = None) -> list[Outgoing]:
        """Return what follows from a car that has just come; `worn` is the tag that it has."""
        bound = None if worn is not None else bound_tag(self.city_map, car.name)
        if bound is None or bound == car.tag_id:
            return [lease_record(car)]
        wearer = next((one.name for one in self.cars.all() if one.tag_id == bound), "another car")
        text = (
            f"{car.name} has tag {car.tag_id}: {wearer} wears tag {bound}, which is printed for it"
        )
        return [city_event("warning", "other_tag", text, now_ns, car.name), lease_record(car)]

    def remove(self, name: str) -> list[Outgoing]:
        """Remove a car from the map, if there is one of that name; return what must be stored."""
        if name in self.cars.hosted:
            car = self.cars.hosted.pop(name)
            self.cars.leased.pop(name, None)
            self.cars.garage.scrap(car.car_file, car.row, car.index)
            return self._forget(car)
        if name in self.cars.remote:
            return self._forget(self.cars.remote.pop(name))
        return []

    def _compile(self, car_names: Iterable[str], scanner: Sensor, walls: WallGrid) -> None:
        """Compile or load now all that a tick calls, so that no car waits for it later."""
        others = all_car_names() if is_first_start() else ()
        names = tuple(dict.fromkeys((*car_names, *others)))
        for name in (DEFAULT_CAR, *names):
            self.cars.garage.car(name)  # read once, and not in each process
        compile_together(
            {
                "drivers": self.drivers.warm_up,
                "LIDAR": lambda: self._warm_scanner(scanner, walls),
                **{name: partial(self._warm_car, name) for name in names},
                "contacts": self.contacts.warm,
            }
        )

    def _warm_car(self, name: str) -> None:
        self.ground.warm(self.cars.garage.prepare(name))

    def _warm_scanner(self, scanner: Sensor, walls: WallGrid) -> None:
        """Scan once for nobody, so that the kernels are there before the first car scans."""
        bank, model = Bank(scanner, self.seed, 1), self.cars.garage.car(DEFAULT_CAR)
        bank.fit(0, "nobody", model, ExternalVehicles(1), 0, 0)
        nowhere = Scene(walls, np.zeros((0, 4)), np.zeros(0, np.int64))
        bank.step(0, lambda: nowhere)

    def has_room(self, car_name: str, pose: Pose2) -> bool:
        """Return whether a car would stand there on the floor and touch no wall and no box.

        Raises:
            CarError: when there is no such car file.
        """
        car, hull = self.cars.garage.car(car_name), self.cars.garage.hull(car_name)
        floor = self.city_map.floor
        corners = outline(car, np.array([[*pose]]))[:, :2]
        low, high = zip(floor.x_m, floor.y_m, strict=True)
        if (corners < low).any() or (corners > high).any():
            return False
        ahead = car.vector("body.footprint_x_m")[1] - hull.front
        return self.contacts.is_free(hull, Pose2(*pose.apply(ahead, 0.0), pose.yaw))

    def _add(
        self, name: str, car_name: str, pose: Pose2, *, hosted: bool, movable: bool = True
    ) -> int:
        hull = self.cars.garage.hull(car_name, movable=movable)
        index = self.cars.add(name, car_name, pose, hosted=hosted)
        self.contacts.add(index, hull)
        return index

    def _forget(self, car: AnyCar) -> list[Outgoing]:
        index = car.index
        self.identities.highest_epoch = max(self.identities.highest_epoch, car.lease.epoch)
        self.contacts.remove(index)
        self.trips.forget(index)
        self.drivers.leave(index)
        self.radio.cams.forget(index)
        self.border.approaching.pop(car.name, None)
        if self.ownership is not None:
            self.ownership.leave(index)
        self.alerts.stuck.forget(index)
        self.sensors.remove(index)
        self.impulses.event_ns.pop(car.name, None)
        self.impulses.touched_ns.pop(car.name, None)
        self.identities.tags.release(car.tag_id)
        self.cars.arrays.remove(index)
        return [PersistedState("leases", car.name, None), self.identities.epoch_record()]
