"""The world: everything that one tick moves, and how cars come into it and leave it.

`step.tick` moves it. Nothing here knows a bus or a clock: time comes with every call, and what is
to be sent waits in `outbox`.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Literal

import numpy as np

from scm import registry
from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.maps.model import CityMap, Point
from scm.maps.route import Roads
from scm.maps.segments import wall_segments
from scm.v2x.exchange import Outgoing
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.vehicles.car import Car
from scm.vehicles.ground import Ground
from scm.vehicles.guard import Guard
from scm.vehicles.sensor import Around, Sampler, Sensor
from scm.vehicles.sensors.lidar import scan
from scm.vehicles.signal_view import SignalView
from scm.world import lease as rules
from scm.world.contacts import Contacts
from scm.world.garage import Garage
from scm.world.hosted import HostedCar
from scm.world.hull import hull_of
from scm.world.impacts import Impacts
from scm.world.pace import Every, Pace
from scm.world.radio import Radio, roadside_places
from scm.world.remote import RemoteCar
from scm.world.seeds import generator
from scm.world.solids import Hull

NAME = "world"
PERIOD_NS = 20 * NS_PER_MS
SENSORS = "scm.vehicles.sensors"
SCANNER = "lidar"
DEFAULT_CAR = "nigel"

AnyCar = HostedCar | RemoteCar


class World:
    """The shared state of one city.

    Args:
        city_map: The city.
        seed: Of all noise and of lost radio frames.
        capacity: Most hosted cars of one car file.
        loss: Share of radio frames that get lost.
        prepare: Car files whose kernels are compiled now and not when their first car comes.

    Attributes:
        hosted: Cars simulated here, by name, in the order they came; likewise `remote`.
        walls: (m, 4) faces of everything that never moves.
        ground: The floor under the wheels, and the wind.
        impacts: What contacts add to the cars' accelerations in this tick.
        sensors: All kinds of sensors, by name.
        scanners: One LIDAR a remote car, by its name: only the world can see for it.
        stop: The red button as it stands.
        outbox: What the tick under way sends.
        ignored: Messages that fitted nothing: unknown cars, commands without the lease.
        last_hit_ns: When a car's contact was last told.
        verdicts: The monitors' newest, by junction.
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
        self.walls = wall_segments(city_map)
        self.garage = Garage(capacity)
        self.ground = Ground(city_map, seed)
        self.contacts = Contacts(city_map)
        self.impacts = Impacts()
        self.radio = Radio(city_map.radio_range_m, generator(seed, NAME, "radio"), loss)
        self.roadside = roadside_places(city_map)
        self.sensors: Mapping[str, Sensor] = {
            name: registry.load(SENSORS, name, "SENSOR", Sensor) for name in registry.names(SENSORS)
        }
        self.hosted: dict[str, HostedCar] = {}
        self.remote: dict[str, RemoteCar] = {}
        self.scanners: dict[str, Sampler] = {}
        self.pace = Pace(PERIOD_NS)
        self.every = {"snapshot": Every(20.0), "second": Every(1.0)}
        self.stop = CityStop(t_ns=0, engaged=False)
        self.outbox: list[Outgoing] = []
        self.tick = 0
        self.ignored = 0
        self.last_hit_ns: dict[str, int] = {}
        self.verdicts: dict[str, MonitorStatus] = {}
        self._came = 0
        for name in prepare:
            self.ground.warm(self.garage.prepare(name))
        self.contacts.warm()
        self._warm_scanner()
        self._slots: set[int] = set()

    def cars(self) -> Iterator[AnyCar]:
        """Yield all cars, hosted ones first."""
        yield from self.hosted.values()
        yield from self.remote.values()

    def car(self, name: str) -> AnyCar | None:
        """Return a car by name."""
        return self.hosted.get(name) or self.remote.get(name)

    def places(self) -> dict[str, Point]:
        """Return where the antennas of all stations are, map frame [m]."""
        cars = {car.name: (car.pose.x, car.pose.y) for car in self.cars()}
        return {**self.roadside, **cars}

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

    def host(self, name: str, car_name: str, pose: Pose2, now_ns: int) -> HostedCar:
        """Put a car onto the map that the world simulates; it stands until it is sent.

        Raises:
            CarError: when there is no such car file.
            RunError: when no room is left for cars of this file.
        """
        model = self.garage.car(car_name)
        hull = hull_of(model)
        slot = self._free_slot()
        fleet, row = self.garage.park(car_name, pose, slot)
        self.ground.settle(fleet, row)
        self._take_slot(slot, hull)
        lease = rules.grant(NAME, first_epoch(now_ns))
        car = HostedCar(
            name=name,
            car=model,
            car_file=car_name,
            tag_id=self.free_tag(),
            slot=slot,
            fleet=fleet,
            row=row,
            lease=lease,
            signals=SignalView(self.city_map),
            guard=Guard(lease.epoch),
            samplers={
                kind: self._sampler(sensor, name, model)
                for kind, sensor in self.sensors.items()
                if sensor.is_fitted(model)
            },
        )
        for verdict in self.verdicts.values():
            car.signals.hear_monitor(verdict)
        self.hosted[name] = car
        return car

    def admit(
        self, name: str, kind: str, session: str, car_name: str, pose: Pose2, now_ns: int
    ) -> RemoteCar:
        """Take a car with dynamics of its own into the city.

        Raises:
            CarError: when there is no such car file.
        """
        model = self.garage.car(car_name)
        hull = hull_of(model, movable=kind != "real")
        slot = self._free_slot()
        self._take_slot(slot, hull)
        car = RemoteCar(
            name=name,
            kind=kind,
            session=session,
            car=model,
            car_file=car_name,
            tag_id=self.free_tag(),
            slot=slot,
            lease=rules.grant(name, first_epoch(now_ns)),
            pose=pose,
            heard_ns=now_ns,
        )
        self.remote[name] = car
        if kind != "real" and self.sensors[SCANNER].is_fitted(model):
            self.scanners[name] = self._sampler(self.sensors[SCANNER], name, model)
        return car

    def remove(self, name: str) -> None:
        """Take a car off the map; nothing happens when there is none of that name."""
        if name in self.hosted:
            car = self.hosted.pop(name)
            self.garage.scrap(car.car_file, car.row)
            self._forget(car.slot)
        elif name in self.remote:
            self._forget(self.remote.pop(name).slot)
            self.scanners.pop(name, None)

    def free_tag(self) -> int:
        """Return the lowest tag id that no car wears."""
        worn = {car.tag_id for car in self.cars()} | {self.city_map.tag.tag_id}
        first = self.city_map.first_vehicle_tag_id
        return next(i for i in range(first, first + len(worn) + 1) if i not in worn)

    def free_name(self) -> str:
        """Return a name for a car that has none."""
        taken = {car.name for car in self.cars()}
        return next(f"n{i}" for i in range(1, len(taken) + 2) if f"n{i}" not in taken)

    def _warm_scanner(self) -> None:
        """Scan once for nobody, so that the kernel is compiled before the first car scans."""
        nowhere = Around(np.zeros((1, 4)), np.zeros(1, np.int64), np.zeros(1, np.int64))
        scan(self.garage.car(DEFAULT_CAR), np.zeros((1, 3)), nowhere)

    def _take_slot(self, slot: int, hull: Hull) -> None:
        self.contacts.add(slot, hull)
        self._slots.add(slot)

    def _forget(self, slot: int) -> None:
        self.contacts.remove(slot)
        self._slots.remove(slot)

    def _free_slot(self) -> int:
        return next(i for i in range(len(self._slots) + 1) if i not in self._slots)

    def _sampler(self, sensor: Sensor, name: str, model: Car) -> Sampler:
        # The golden ratio spreads the cars' first scans evenly over a period, however many come.
        self._came += 1
        offset = self._came * 0.618034 % 1.0 if sensor.name == SCANNER else 0.0
        rng = generator(self.seed, name, sensor.name)
        return Sampler(sensor.facts(model), rng, offset)


def first_epoch(now_ns: int) -> int:
    """Return an epoch above all that an earlier run of this city can have given out."""
    return max(1, now_ns // NS_PER_MS)
