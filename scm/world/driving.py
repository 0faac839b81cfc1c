"""Who moves a hosted car's pedals this tick: its leaseholder through the guard, or its driver.

While somebody else holds the lease the car obeys nothing but guarded commands. When that lease is
lost or given back the car stands, with its errand forgotten, until it is leased or sent again.
"""

from scm.maps.route import Path, Roads
from scm.vehicles.car import Car
from scm.vehicles.driver import CarLimits, RouteView
from scm.vehicles.drivers.route import RouteDriver
from scm.world import lease as rules
from scm.world.hosted import Errand, HostedCar


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
    elif car.errand is not None:
        _follow(car, car.errand, now_ns, stop=stop)
    else:
        car.command(0.0, float(car.fleet.steering[car.row]))
        car.mode = "stop" if stop or car.hazard else "idle"
    return lost


def take_over(car: HostedCar, lease: rules.Lease, now_ns: int) -> None:
    """Put a car under another lease; its errand is forgotten, older commands are refused."""
    car.lease = lease
    car.guard.set_epoch(lease.epoch, now_ns)
    car.errand = None
    car.hazard = False


def driver_for(
    roads: Roads, car: Car, lane: str, via: tuple[str, ...], laps: int, speed: float | None
) -> RouteDriver:
    """Return a driver from a lane through others, or round and round.

    Raises:
        MapError: when the lanes do not allow it.
    """
    path = Path(roads, roads.route(lane, via, laps)) if via else Path.circulation(roads, lane)
    return RouteDriver(path, limits_of(car), speed=speed)


def limits_of(car: Car) -> CarLimits:
    """Return what a driver must know of a car, from its file."""
    rear, front = car.vector("body.footprint_x_m")
    right, left = car.vector("body.footprint_y_m")
    table = "drive.throttle_speed_m_s"
    return CarLimits(
        wheelbase=car.value("body.wheelbase_m"),
        steer_limit=car.value("steering.limit_rad"),
        steer_rate=car.value("steering.rate_rad_s"),
        front=front,
        rear=-rear,
        width=left - right,
        speeds=car.vector(table) if car.has(table) else (),
    )


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


def _follow(car: HostedCar, errand: Errand, now_ns: int, *, stop: bool) -> None:
    view = RouteView(
        now_ns=now_ns,
        pose=car.pose,
        speed=car.speed,
        signals=car.signals,
        others=car.ears.others(now_ns),
        stop=stop,
    )
    car.command(*errand.driver.decide(view))
    if errand.driver.arrived and errand.arrived_ns is None:
        errand.arrived_ns = now_ns
    car.mode = "stop" if stop else "drive" if errand.arrived_ns is None else "idle"
