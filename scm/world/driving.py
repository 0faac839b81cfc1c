"""Who drives a hosted car in this tick: its leaseholder through the guard, or its own driver.

While somebody else holds the lease the car obeys nothing but guarded commands. When that lease is
lost or given back the car stands, its trip over, until it is leased or sent again. All cars that
their own drivers drive are decided for in one call.
"""

import numpy as np

from scm.v2x.exchange import Outgoing, PersistedState
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.vehicles.guard import Guard
from scm.world import lease as rules
from scm.world.alerts import city_event
from scm.world.cars import lease_record
from scm.world.hosted import HostedCar
from scm.world.vehicle_arrays import CODES, DRIVE, IDLE, STOP, VehicleArrays
from scm.world.world import World


def steer(world: World, now_ns: int) -> list[Outgoing]:
    """Set the commands of all hosted cars for the time after `now_ns`; return lost leases."""
    out: list[Outgoing] = []
    stop = world.stop.engaged
    _stand(world.cars.arrays, stop=stop)
    for car in list(world.cars.leased.values()):
        lost = _loss(car, now_ns)
        if lost is not None:
            out.append(hand_over(world, car, rules.returned(car.lease), now_ns))
            world.cars.arrays.hazard[car.index] = True
            world.cars.arrays.mode[car.index] = STOP
            text = f"{car.name} stands: {lost}"
            out.append(city_event("warning", "lease_lost", text, now_ns, car.name))
        else:
            _obey(world.cars.arrays, car, now_ns, stop=stop)
    _drive(world, now_ns, stop=stop)
    world.cars.garage.command(world.cars.arrays)
    return out


def hand_over(world: World, car: HostedCar, lease: rules.Lease, now_ns: int) -> PersistedState:
    """Put a car under another lease, and return its record.

    Its trip is over, and older commands are refused.
    """
    if not lease.is_leased:
        world.cars.leased.pop(car.name, None)
        car.guard = None
        world.cars.arrays.throttle[car.index] = 0.0
    else:
        world.cars.leased[car.name] = car
        car.guard = car.guard or Guard(car.lease.epoch)
        car.guard.set_epoch(lease.epoch, now_ns)
    car.lease = lease
    record = lease_record(car)
    world.trips.end(car.index, now_ns)
    world.cars.arrays.driven[car.index] = False
    world.cars.arrays.hazard[car.index] = False
    return record


def send(world: World, car: HostedCar, request: RouteRequest, now_ns: int) -> RouteReply:
    """Send a car with its own driver along a route, from the lane it stands on.

    Raises:
        ScmError: when the lanes do not allow the route, or the car stands on none.
    """
    reply = world.trips.begin(car.index, car.name, request, car.pose, now_ns)
    vehicles = world.cars.arrays
    vehicles.driven[car.index] = not car.has_diverged
    vehicles.hazard[car.index] = vehicles.arrived[car.index] = False
    return reply


def _stand(vehicles: VehicleArrays, *, stop: bool) -> None:
    """Set zero throttle for cars that nobody drives; their steering stays as it is."""
    standing = vehicles.hosted & ~vehicles.driven
    vehicles.throttle[standing] = 0.0
    vehicles.mode[standing] = STOP if stop else IDLE
    vehicles.mode[standing & vehicles.hazard] = STOP


def _loss(car: HostedCar, now_ns: int) -> str | None:
    if rules.is_expired(car.lease, now_ns):
        return f"{car.lease.owner} did not renew it within {car.lease.ttl_ms} ms"
    if car.guard is not None and car.guard.output(now_ns).mode == "lost":
        return f"{car.lease.owner} sent no commands for a second"
    return None


def _obey(vehicles: VehicleArrays, car: HostedCar, now_ns: int, *, stop: bool) -> None:
    if car.guard is None:
        return
    car.guard.stop(stop)
    allowed = car.guard.output(now_ns)
    index = car.index
    vehicles.throttle[index], vehicles.steering[index] = allowed.throttle, allowed.steering
    vehicles.mode[index] = STOP if allowed.mode == "lost" else CODES[allowed.mode]
    vehicles.hazard[index] = allowed.hazard


def _drive(world: World, now_ns: int, *, stop: bool) -> None:
    """Apply the drivers' decisions, and note which cars have arrived."""
    vehicles, drivers = world.cars.arrays, world.drivers
    driven = vehicles.driven
    if not driven.any():
        return
    drivers.decide(now_ns, vehicles.x, vehicles.y, vehicles.yaw, vehicles.speed, driven, stop=stop)
    np.copyto(vehicles.throttle, drivers.throttle, where=driven)
    np.copyto(vehicles.steering, drivers.steering, where=driven)
    if world.alerts.stuck.against:
        vehicles.throttle[driven & world.alerts.stuck.rests(now_ns - world.pace.lost_ns)] = 0.0
    world.trips.check_arrivals(now_ns)
    np.copyto(vehicles.arrived, drivers.arrived & driven)
    vehicles.mode[driven] = STOP if stop else DRIVE
    if not stop:
        vehicles.mode[vehicles.arrived] = IDLE
