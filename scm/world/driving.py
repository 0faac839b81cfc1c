"""Who moves a hosted car's pedals this tick: its leaseholder through the guard, or its driver.

While somebody else holds the lease the car obeys nothing but guarded commands. When that lease is
lost or given back the car stands, its trip over, until it is leased or sent again. All cars that
their own drivers drive are decided for in one call.
"""

import numpy as np

from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.vehicles.guard import Guard
from scm.world import lease as rules
from scm.world.hosted import HostedCar
from scm.world.slots import CODES, DRIVE, IDLE, STOP
from scm.world.world import World


def steer(world: World, now_ns: int) -> None:
    """Set the commands of all hosted cars for the time after `now_ns`."""
    stop = world.stop.engaged
    _stand(world, stop=stop)
    for car in list(world.leased.values()):
        lost = _loss(car, now_ns)
        if lost is not None:
            take_over(world, car, rules.sent_home(car.lease), now_ns)
            world.slots.hazard[car.slot] = True
            world.slots.mode[car.slot] = STOP
            text = f"{car.name} stands: {lost}"
            world.say("warning", "lease_lost", text, now_ns, car.name)
        else:
            _obey(world, car, now_ns, stop=stop)
    _drive(world, now_ns, stop=stop)
    world.garage.command(world.slots)


def take_over(world: World, car: HostedCar, lease: rules.Lease, now_ns: int) -> None:
    """Put a car under another lease; its trip is over, older commands are refused."""
    if lease.is_at_home:
        world.leased.pop(car.name, None)
        car.guard = None
        world.slots.throttle[car.slot] = 0.0
    else:
        world.leased[car.name] = car
        car.guard = car.guard or Guard(car.lease.epoch)
        car.guard.set_epoch(lease.epoch, now_ns)
    car.lease = lease
    world.keep(car)
    world.trips.end(car.slot, now_ns)
    world.slots.driven[car.slot] = False
    world.slots.hazard[car.slot] = False


def send(world: World, car: HostedCar, request: RouteRequest, now_ns: int) -> RouteReply:
    """Let a car's own driver take it along a route, from the lane it stands on.

    Raises:
        ScmError: when the lanes do not allow the route, or the car stands on none.
    """
    reply = world.trips.begin(car.slot, car.name, request, car.pose, now_ns)
    slots = world.slots
    slots.driven[car.slot] = not car.has_diverged
    slots.hazard[car.slot] = slots.arrived[car.slot] = False
    return reply


def _stand(world: World, *, stop: bool) -> None:
    """Let go of the pedals of those that nobody drives; their wheels stay as they are steered."""
    slots = world.slots
    standing = slots.hosted & ~slots.driven
    slots.throttle[standing] = 0.0
    slots.mode[standing] = STOP if stop else IDLE
    slots.mode[standing & slots.hazard] = STOP


def _loss(car: HostedCar, now_ns: int) -> str | None:
    if rules.is_expired(car.lease, now_ns):
        return f"{car.lease.owner} did not renew it within {car.lease.ttl_ms} ms"
    if car.guard is not None and car.guard.output(now_ns).mode == "lost":
        return f"{car.lease.owner} sent no commands for a second"
    return None


def _obey(world: World, car: HostedCar, now_ns: int, *, stop: bool) -> None:
    if car.guard is None:
        return
    car.guard.stop(stop)
    allowed = car.guard.output(now_ns)
    slots, slot = world.slots, car.slot
    slots.throttle[slot], slots.steering[slot] = allowed.throttle, allowed.steering
    slots.mode[slot] = STOP if allowed.mode == "lost" else CODES[allowed.mode]
    slots.hazard[slot] = allowed.hazard


def _drive(world: World, now_ns: int, *, stop: bool) -> None:
    """Let the drivers decide, and note who has arrived."""
    slots, drivers = world.slots, world.drivers
    driven = slots.driven
    if not driven.any():
        return
    drivers.decide(now_ns, slots.x, slots.y, slots.yaw, slots.speed, driven, stop=stop)
    np.copyto(slots.throttle, drivers.throttle, where=driven)
    np.copyto(slots.steering, drivers.steering, where=driven)
    if world.stuck.against:
        slots.throttle[driven & world.stuck.rests(now_ns - world.pace.lost_ns)] = 0.0
    world.trips.check_arrivals(now_ns)
    np.copyto(slots.arrived, drivers.arrived & driven)
    slots.mode[driven] = STOP if stop else DRIVE
    if not stop:
        slots.mode[slots.arrived] = IDLE
