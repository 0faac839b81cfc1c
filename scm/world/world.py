"""The world: everything that one tick moves, and how cars come into it and leave it.

`step.tick` moves it. Nothing here knows a bus or a clock: time comes with every call, and what is
to be sent waits in `outbox`.
"""

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
from scm.v2x.exchange import Keep, Outgoing
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.vehicles.bank import Bank
from scm.vehicles.cold_start import compile_together
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
from scm.world.batteries import Batteries
from scm.world.blows import Blows
from scm.world.cams import CamTriggers
from scm.world.channel_load import Busy
from scm.world.contacts import Contacts
from scm.world.dangers import Dangers
from scm.world.delay_queue import Late
from scm.world.garage import Garage
from scm.world.hosted import HostedCar
from scm.world.hull import outline
from scm.world.impacts import Impacts
from scm.world.pace import Every, Pace
from scm.world.radio import Radio, RadioCounts, Receivers, roadside_places
from scm.world.remote import RemoteCar
from scm.world.seeds import generator, number
from scm.world.slots import Numbers, Slots
from scm.world.stuck import Stuck
from scm.world.wishes import Wishes

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


class World:
    """The shared state of one city.

    Args:
        city_map: The city.
        seed: Of all noise and of lost radio frames.
        capacity: Most cars at a time.
        loss: Share of radio frames that get lost; 0: as the map says.
        prepare: Car files whose kernels are compiled now and not when their first car comes.

    Attributes:
        slots: What every car has, as arrays.
        ground: The floor under the wheels, and the wind.
        impacts: What contacts add to the cars' accelerations in this tick.
        blows: What contacts did to hosted cars in this tick, for who watches.
        hosted: Cars simulated here, by name, in the order they came; likewise `remote`.
        sessions: Of agents that are on the bus: the station of each.
        leased: Those of the hosted that somebody else drives.
        drivers: The drivers of the hosted cars, and the radio frames that they receive.
        trips: Where these were sent.
        front: By slot, from the rear axle to the front bumper [m].
        placed: Where the remote cars are, for their LIDARs: only the world can see for them.
        banks: The devices of all cars, by kind of sensor.
        readings: By kind and slot the newest reading, NaN before the first; not of LIDARs.
        radio: How frames come to everybody but the drivers of hosted cars.
        radio_before: What had become of frames when that was last told.
        busy: How full the channel is.
        late: Frames on their way.
        wishes: What anybody would hear.
        stop: The red button as it stands.
        outbox: What the tick under way sends.
        ignored: Messages that fitted nothing: unknown cars, commands without the lease.
        last_hit_ns: When a car's contact was last told.
        touched_ns: When anything last pushed a car.
        dangers: What is known of warnings on the air.
        batteries: Which of them were told to be low.
        stuck: Which cars push in vain.
        highest_epoch: Of any car that left: a newcomer's is higher, whatever its name.
        warned_of_bends: Car files of which it was said whether they fit the lanes.
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
        self.wall_grid = WallGrid(wall_segments(city_map))
        self.slots = Slots(capacity)
        self.garage = Garage(capacity, self.ground.fit)
        self.contacts = Contacts(city_map)
        self.impacts = Impacts()
        self.blows = Blows()
        radio = replace(city_map.radio, loss=loss) if loss else city_map.radio
        self.drivers = DriverBatch(lane_graph_of(self.roads), capacity, seed=seed, radio=radio)
        self.trips = Trips(self.drivers, spread=True)
        channel = self.drivers.channel
        self.radio = Radio(channel, generator(seed, NAME, "radio"))
        self.radio_before = RadioCounts()
        self.busy = Busy(radio, float(channel.numbers[RANGE]), channel.load)
        self.late = Late()
        self.roadside = roadside_places(city_map)
        self.cams = CamTriggers(capacity)
        self.front = np.zeros(capacity)
        self.placed = ExternalVehicles(capacity)
        sensors = all_sensors()
        self._compile(prepare, sensors[SCANNER])
        self.banks = {name: Bank(sensor, seed, capacity) for name, sensor in sensors.items()}
        self.readings = {
            name: np.full((capacity, len(sensor.values)), np.nan)
            for name, sensor in sensors.items()
            if name != SCANNER
        }
        self.wishes = Wishes()
        self.hosted: dict[str, HostedCar] = {}
        self.remote: dict[str, RemoteCar] = {}
        self.sessions: dict[str, str] = {}
        self.leased: dict[str, HostedCar] = {}
        self.pace = Pace(PERIOD_NS)
        self.every = {name: Every(rate_hz) for name, rate_hz in RATES_HZ.items()}
        self.stop = CityStop(t_ns=0, engaged=False)
        self.outbox: list[Outgoing] = []
        self.tick = 0
        self.ignored = self.highest_epoch = 0
        self.warned_of_bends: set[str] = set()
        self.last_hit_ns, self.touched_ns = dict[str, int](), dict[str, int]()
        self.dangers = Dangers()
        self.batteries = Batteries()
        self.stuck = Stuck(capacity)
        self._tags = Numbers(city_map.first_vehicle_tag_id, never=reserved_tags(city_map))
        self._unnamed = 0
        self._came = 0
        self._receivers = Receivers(self.roadside)

    def cars(self) -> Iterator[AnyCar]:
        """Yield all cars, hosted ones first."""
        yield from self.hosted.values()
        yield from self.remote.values()

    def car(self, name: str) -> AnyCar | None:
        """Return a car by name."""
        return self.hosted.get(name) or self.remote.get(name)

    def use_threads(self, count: int) -> None:
        """Let dynamics and drivers use several threads: for lockstep, on cores that would idle.

        It changes no number. Live, with the processors shared, threads wait for each other: there
        one is better.
        """
        self.garage.use_threads(count)
        self.drivers.threads = count

    def receivers(self) -> Receivers:
        """Return all stations that frames are brought to, but for the hosted cars."""
        if not self.remote:
            return self._receivers
        cars = {car.name: (car.pose.x, car.pose.y) for car in self.remote.values()}
        return Receivers({**self.roadside, **cars})

    def antenna(self, station: str) -> Point | None:
        """Return where a station that is no hosted car sends from; None: nobody knows."""
        if (car := self.remote.get(station)) is not None:
            return car.pose.x, car.pose.y
        if station == EYE or station.startswith(f"{EYE}-"):
            (left, right), (low, high) = self.city_map.floor.x_m, self.city_map.floor.y_m
            return 0.5 * (left + right), 0.5 * (low + high)
        return self.roadside.get(station)

    def lost_ns(self, station: str) -> int:
        """Return the time that passed without a station's car being moved, since it came [ns]."""
        car = self.remote.get(station)
        return self.pace.lost_ns if car is None else car.missed_ns

    def locate(self) -> None:
        """Note where all cars are and how they move."""
        slots, placed = self.slots, self.placed
        self.garage.locate(slots)
        for car in self.remote.values():
            slots.put(car.slot, car.pose)
            placed.x[car.slot], placed.y[car.slot], placed.yaw[car.slot] = car.pose
            if car.state is not None:
                placed.speed[car.slot] = car.state.speed_mps
                placed.lateral_speed[car.slot] = car.state.lateral_speed_mps
                placed.yaw_rate[car.slot] = car.state.yaw_rate_radps

    def say(
        self,
        severity: Literal["info", "warning", "error"],
        name: str,
        text: str,
        now_ns: int,
        vehicle: str | None = None,
    ) -> None:
        """Put an event into the log of the city."""
        self.outbox.append(
            CityEvent(
                severity=severity, source=NAME, t_ns=now_ns, name=name, text=text, vehicle=vehicle
            )
        )

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
        slot = self._take(name, car_name, pose, hosted=True)
        fleet, row = self.garage.park(car_name, pose, slot)
        self.ground.place_at_rest(fleet, row)
        self.drivers.enter(slot, limits_of(model), number(self.seed, name, "driver"))
        for kind, bank in self.banks.items():
            bank.fit(slot, name, model, fleet, row, now_ns, self._offset(kind))
        self.hosted[name] = HostedCar(
            name=name,
            car=model,
            car_file=car_name,
            tag_id=self._tag(name, tag_id, now_ns),
            slot=slot,
            slots=self.slots,
            fleet=fleet,
            row=row,
            lease=rules.grant(NAME, self._first_epoch(now_ns)),
        )
        self.keep(self.hosted[name])
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
        """Take a car with dynamics of its own into the city; `tag_id`: that it wears, if any.

        Raises:
            CarError: when there is no such car file.
        """
        model = self.garage.car(car_name)
        slot = self._take(name, car_name, pose, hosted=False, movable=kind != "real")
        if kind != "real":
            placed, offset = self.placed, self._offset(SCANNER)
            self.banks[SCANNER].fit(slot, name, model, placed, slot, now_ns, offset)
        self.remote[name] = RemoteCar(
            name=name,
            kind=kind,
            session=session,
            car=model,
            car_file=car_name,
            tag_id=self._tag(name, tag_id, now_ns),
            slot=slot,
            lease=rules.grant(name, self._first_epoch(now_ns)),
            pose=pose,
            heard_ns=now_ns,
        )
        self.keep(self.remote[name])
        return self.remote[name]

    def remove(self, name: str) -> None:
        """Take a car off the map; nothing happens when there is none of that name."""
        if name in self.hosted:
            car = self.hosted.pop(name)
            self.leased.pop(name, None)
            self.garage.scrap(car.car_file, car.row)
            self._forget(car)
        elif name in self.remote:
            self._forget(self.remote.pop(name))

    def keep(self, car: AnyCar) -> None:
        """Have a car and its lease stored."""
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
        self.outbox.append(Keep("leases", car.name, record))

    def free_name(self) -> str:
        """Return a name for a car that has none."""
        while self.car(f"n{self._unnamed + 1}") is not None:
            self._unnamed += 1
        return f"n{self._unnamed + 1}"

    def _compile(self, car_names: Iterable[str], scanner: Sensor) -> None:
        """Compile or load now all that a tick calls, so that no car waits for it later."""
        names = tuple(car_names)
        for name in (DEFAULT_CAR, *names):
            self.garage.car(name)  # read once, and not in each process
        compile_together(
            {
                "drivers": self.drivers.warm_up_controller,
                "LIDAR": lambda: self._warm_scanner(scanner),
                **{name: partial(self._warm_car, name) for name in names},
                "contacts": self.contacts.warm,
                "reception": self.drivers.warm_up_rest,
            }
        )

    def _warm_car(self, name: str) -> None:
        self.ground.warm(self.garage.prepare(name))

    def _warm_scanner(self, scanner: Sensor) -> None:
        """Scan once for nobody, so that the kernels are there before the first car scans."""
        bank, model = Bank(scanner, self.seed, 1), self.garage.car(DEFAULT_CAR)
        bank.fit(0, "nobody", model, ExternalVehicles(1), 0, 0)
        nowhere = Scene(self.wall_grid, np.zeros((0, 4)), np.zeros(0, np.int64))
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

    def _take(
        self, name: str, car_name: str, pose: Pose2, *, hosted: bool, movable: bool = True
    ) -> int:
        hull = self.garage.hull(car_name, movable=movable)
        slot = self.slots.take(name, pose, hosted=hosted)
        self.contacts.add(slot, hull)
        _, self.front[slot] = self.garage.car(car_name).vector("body.footprint_x_m")
        return slot

    def _tag(self, name: str, worn: int | None, now_ns: int) -> int:
        """Return the tag on a new car's roof: the one that it wears, its name's, or a free one."""
        if worn is not None:
            return self._tags.claim(worn)
        bound = bound_tag(self.city_map, name)
        if bound is not None and self._tags.is_free(bound):
            return self._tags.claim(bound)
        given = self._tags.take()
        if bound is not None:
            wearer = next((car.name for car in self.cars() if car.tag_id == bound), "another car")
            text = f"{name} has tag {given}: {wearer} wears tag {bound}, which is printed for it"
            self.say("warning", "other_tag", text, now_ns, name)
        return given

    def _first_epoch(self, now_ns: int) -> int:
        """Return an epoch above all that any car of this city has had so far."""
        return max(now_ns // NS_PER_MS, self.highest_epoch + 1)

    def _forget(self, car: AnyCar) -> None:
        slot = car.slot
        self.highest_epoch = max(self.highest_epoch, car.lease.epoch)
        self.outbox += [
            Keep("leases", car.name, None),
            Keep("latches", "epochs", EpochRecord(highest=self.highest_epoch)),
        ]
        self.contacts.remove(slot)
        self.trips.forget(slot)
        self.drivers.leave(slot)
        self.cams.forget(slot)
        self.stuck.forget(slot)
        for bank in self.banks.values():
            bank.unfit(slot)
        for values in self.readings.values():
            values[slot] = np.nan
        self.last_hit_ns.pop(car.name, None)
        self.touched_ns.pop(car.name, None)
        self._tags.give_back(car.tag_id)
        self._unnamed = 0
        self.slots.free(slot)

    def _offset(self, kind: str) -> float:
        # The golden ratio spreads the cars' first scans evenly over a period, however many come.
        self._came += kind == SCANNER
        return self._came * 0.618034 % 1.0 if kind == SCANNER else 0.0
