"""Who moves a hosted car's pedals this tick: its leaseholder through the guard, or its driver.

While somebody else holds the lease the car obeys nothing but guarded commands. When that lease is
lost or given back the car stands, its trip over, until it is leased or sent again.
"""

from scm.vehicles.driver import RouteView
from scm.vehicles.drivers.trips import Trips
from scm.world import lease as rules
from scm.world.hosted import HostedCar


def drive(car: HostedCar, now_ns: int, *, stop: bool) -> str | None:
    """Set a car's commands for the time after `now_ns`.

    Returns:
        Why its lease was lost just now, in words; None if it was not.
    """
    lost = _loss(car, now_ns)
    if lost is not None:
        take_over(car, rules.sent_home(car.lease), now_ns)
        car.hazard = True
    if not car.lease.is_at_home:
        _obey(car, now_ns, stop=stop)
    elif car.is_sent and car.trips is not None:
        _follow(car, car.trips, now_ns, stop=stop)
    else:
        car.command(0.0, float(car.fleet.steering[car.row]))
        car.mode = "stop" if stop or car.hazard else "idle"
    return lost


def take_over(car: HostedCar, lease: rules.Lease, now_ns: int) -> None:
    """Put a car under another lease; its trip is over, older commands are refused."""
    car.lease = lease
    car.guard.set_epoch(lease.epoch, now_ns)
    car.is_sent = False
    car.hazard = False


def _loss(car: HostedCar, now_ns: int) -> str | None:
    if car.lease.is_at_home:
        return None
    if rules.is_expired(car.lease, now_ns):
        return f"{car.lease.owner} did not renew it within {car.lease.ttl_ms} ms"
    if car.guard.output(now_ns).mode == "lost":
        return f"{car.lease.owner} sent no commands for a second"
    return None


def _obey(car: HostedCar, now_ns: int, *, stop: bool) -> None:
    car.guard.stop(stop)
    allowed = car.guard.output(now_ns)
    car.command(allowed.throttle, allowed.steering)
    car.mode = "stop" if allowed.mode == "lost" else allowed.mode
    car.hazard = allowed.hazard


def _follow(car: HostedCar, trips: Trips, now_ns: int, *, stop: bool) -> None:
    view = RouteView(
        now_ns=now_ns,
        pose=car.pose,
        speed=car.speed,
        signals=car.signals,
        others=car.others.others(now_ns, car.pose),
        stop=stop,
    )
    car.command(*trips.decide(view))
    car.mode = "stop" if stop else "idle" if trips.driver.arrived else "drive"
