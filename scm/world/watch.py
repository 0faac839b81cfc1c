"""Monitor all cars: lost agents, expired leases, low batteries, stuck and diverged cars."""

import math

import numpy as np

from scm.clock import NS_PER_S, seconds
from scm.v2x.exchange import Outgoing
from scm.v2x.messages.city_event import CityEvent
from scm.vehicles.vehicle_status import VehicleStatus
from scm.world import lease as rules
from scm.world.alerts import city_event
from scm.world.cars import lease_record
from scm.world.collide import WALL, touched_lately
from scm.world.remote import GONE_NS, STALE_NS, RemoteCar
from scm.world.world import World

FIRST_REPORT_NS = 10 * NS_PER_S  # an agent may compile its car before its first report


def watch(world: World, now_ns: int) -> list[Outgoing]:
    """Mark lost cars, remove those lost for long, and report frozen, stuck and low cars."""
    out: list[Outgoing] = []
    for car in list(world.cars.remote.values()):
        out += _watch_agent(world, car, now_ns)
        out += _watch_lease(car, now_ns)
    vehicles = world.cars.arrays
    for index in world.cars.garage.frozen().tolist():
        if not vehicles.diverged[index]:
            vehicles.diverged[index] = True
            vehicles.driven[index] = False
            hosted = world.cars.hosted[vehicles.names[index]]
            status = VehicleStatus(int(hosted.fleet.status[hosted.row]))
            name = f"vehicle_{status.name.lower()}"
            out.append(city_event("error", name, status.sentence, now_ns, hosted.name))
    if world.every["battery"].is_due(now_ns):
        out += _watch_batteries(world, now_ns)
    if world.every["stuck"].is_due(now_ns):
        out += _watch_stuck(world, now_ns)
    return out


def _watch_batteries(world: World, now_ns: int) -> list[CityEvent]:
    _, left = world.cars.garage.batteries()
    hosted = {name: float(left[car.index]) for name, car in world.cars.hosted.items()}
    remote = {name: car.battery_charge for name, car in world.cars.remote.items()}
    charges = {name: None if math.isnan(c) else c for name, c in hosted.items()} | remote
    texts = {
        name: f"the battery of {name} is low: {100.0 * (charges[name] or 0.0):.0f} % left"
        for name in world.alerts.low_batteries.news(charges)
    }
    return [city_event("warning", "battery_low", t, now_ns, name) for name, t in texts.items()]


def _watch_stuck(world: World, now_ns: int) -> list[CityEvent]:
    out: list[CityEvent] = []
    vehicles, stuck = world.cars.arrays, world.alerts.stuck
    pushes = vehicles.hosted & ~vehicles.elsewhere & ~vehicles.diverged
    throttle = np.where(pushes, vehicles.throttle, 0.0)
    for car in world.cars.remote.values():
        if car.alive and car.state is not None:
            throttle[car.index] = car.state.throttle
    new, free = stuck.look(throttle, vehicles.x, vehicles.y, now_ns - world.pace.lost_ns)
    for index in new.tolist():
        name, against = (
            vehicles.names[index],
            touched_lately(world.cars, world.contacts, stuck, index, now_ns),
        )
        stuck.against[index] = against
        others = ", ".join("a wall" if other == WALL else other for other in against)
        does = f"pushes against {others}" if against else "is commanded to drive, touches nothing"
        text = f"{name} is stuck: it {does} and stays"
        out.append(city_event("warning", "stuck", text, now_ns, name))
    for index in free.tolist():
        name = vehicles.names[index]
        out.append(city_event("info", "stuck", f"{name} is free again", now_ns, name))
    return out


def lose(car: RemoteCar, why: str, now_ns: int, *, dead: bool) -> list[CityEvent]:
    """Mark a remote car as lost, once; it leaves the map a while later."""
    car.dead = car.dead or dead
    if not car.alive:
        return []
    car.lost_ns = now_ns
    return [city_event("warning", "vehicle_lost", why, now_ns, car.name)]


def _watch_agent(world: World, car: RemoteCar, now_ns: int) -> list[Outgoing]:
    out: list[Outgoing] = []
    patience_ns = STALE_NS if car.state is not None else FIRST_REPORT_NS
    if car.alive and car.age_ns(now_ns) > patience_ns:
        why = f"{car.name} has been silent for {seconds(car.age_ns(now_ns)):.1f} s"
        out += lose(car, why, now_ns, dead=False)
    if car.lost_ns is not None and now_ns - car.lost_ns >= GONE_NS:
        out += world.remove(car.name)
        text = f"{car.name} was removed from the map: nobody drives it any more"
        out.append(city_event("info", "vehicle_removed", text, now_ns, car.name))
    return out


def _watch_lease(car: RemoteCar, now_ns: int) -> list[Outgoing]:
    if not rules.is_expired(car.lease, now_ns):
        return []
    text = f"{car.lease.owner} did not renew the lease of {car.name}: it is its agent's again"
    car.lease = rules.returned(car.lease)
    return [lease_record(car), city_event("warning", "lease_lost", text, now_ns, car.name)]
