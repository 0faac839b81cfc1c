"""Watching over cars: who vanishes, whose lease or battery runs out, who is stuck or frozen."""

import math

import numpy as np

from scm.clock import NS_PER_S, seconds
from scm.vehicles.fleet import VehicleStatus
from scm.world import lease as rules
from scm.world.collide import WALL, touched_lately
from scm.world.remote import GONE_NS, STALE_NS, RemoteCar
from scm.world.world import World

FIRST_REPORT_NS = 10 * NS_PER_S


def watch(world: World, now_ns: int) -> None:
    """Mark who is gone, take off the map who has been gone for long, tell who is frozen."""
    for car in list(world.remote.values()):
        _watch_agent(world, car, now_ns)
        _watch_lease(world, car, now_ns)
    slots = world.slots
    for slot in world.garage.frozen().tolist():
        if not slots.diverged[slot]:
            slots.diverged[slot] = True
            slots.driven[slot] = False
            hosted = world.hosted[slots.names[slot]]
            status = VehicleStatus(int(hosted.fleet.status[hosted.row]))
            name = f"vehicle_{status.name.lower()}"
            world.say("error", name, status.sentence, now_ns, hosted.name)
    if world.every["battery"].is_due(now_ns):
        _watch_batteries(world, now_ns)
    if world.every["stuck"].is_due(now_ns):
        _watch_stuck(world, now_ns)


def _watch_batteries(world: World, now_ns: int) -> None:
    _, left = world.garage.batteries()
    hosted = {name: float(left[car.slot]) for name, car in world.hosted.items()}
    remote = {name: car.battery_charge for name, car in world.remote.items()}
    charges = {name: None if math.isnan(c) else c for name, c in hosted.items()} | remote
    for name in world.batteries.news(charges):
        text = f"the battery of {name} is low: {100.0 * (charges[name] or 0.0):.0f} % left"
        world.say("warning", "battery_low", text, now_ns, name)


def _watch_stuck(world: World, now_ns: int) -> None:
    slots, stuck = world.slots, world.stuck
    throttle = np.where(slots.hosted & ~slots.diverged, slots.throttle, 0.0)
    for car in world.remote.values():
        if car.alive and car.state is not None:
            throttle[car.slot] = car.state.throttle
    new, free = stuck.look(throttle, slots.x, slots.y, now_ns - world.pace.lost_ns)
    for slot in new.tolist():
        name, against = slots.names[slot], touched_lately(world, slot, now_ns)
        stuck.against[slot] = against
        others = ", ".join("a wall" if other == WALL else other for other in against)
        pushes = f"pushes against {others}" if against else "is told to drive, touches nothing"
        world.say("warning", "stuck", f"{name} is stuck: it {pushes} and stays", now_ns, name)
    for slot in free.tolist():
        name = slots.names[slot]
        world.say("info", "stuck", f"{name} is free again", now_ns, name)


def lose(world: World, car: RemoteCar, why: str, now_ns: int, *, dead: bool) -> None:
    """Mark a remote car as lost, once; it leaves the map a while later."""
    car.dead = car.dead or dead
    if car.alive:
        car.lost_ns = now_ns
        world.say("warning", "vehicle_lost", why, now_ns, car.name)


def _watch_agent(world: World, car: RemoteCar, now_ns: int) -> None:
    patience_ns = STALE_NS if car.state is not None else FIRST_REPORT_NS
    if car.alive and car.age_ns(now_ns) > patience_ns:
        why = f"{car.name} has been silent for {seconds(car.age_ns(now_ns)):.1f} s"
        lose(world, car, why, now_ns, dead=False)
    if car.lost_ns is not None and now_ns - car.lost_ns >= GONE_NS:
        world.remove(car.name)
        text = f"{car.name} was taken off the map: nobody drives it any more"
        world.say("info", "vehicle_removed", text, now_ns, car.name)


def _watch_lease(world: World, car: RemoteCar, now_ns: int) -> None:
    if rules.is_expired(car.lease, now_ns):
        text = f"{car.lease.owner} did not renew the lease of {car.name}: it is its agent's again"
        car.lease = rules.sent_home(car.lease)
        world.keep(car)
        world.say("warning", "lease_lost", text, now_ns, car.name)
