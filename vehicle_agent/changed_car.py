"""What a car's driver and guard assume once another version of its car file is in force.

The driver brakes no harder than the car can by that version, by the worse end of its interval, so
it begins earlier and follows at a larger gap. A car that needs too long a way to stop, or no longer
gets round a bend of the map, does not drive.
"""

from dataclasses import dataclass, replace

from scm.maps.bends import misfit
from scm.records.city_map import CityMap
from scm.v2x.messages.twin_status import TwinStatus, ability_problem
from scm.vehicles.driver import CarLimits

LEAST_DECEL_MPS2 = 0.1  # a fifth of the usual: a car that brakes less is no part of traffic


@dataclass(frozen=True, slots=True)
class ChangedCar:
    """A car by its version in force.

    Attributes:
        limits: For its driver.
        decel_mps2: At zero throttle at least, for its guard; None: as before.
        unfit: Why it must not drive; empty: it may.
    """

    limits: CarLimits
    decel_mps2: float | None = None
    unfit: str = ""


def changed_car(status: TwinStatus, given: CarLimits, city_map: CityMap) -> ChangedCar:
    """Return what a version in force means for driving.

    Args:
        status: Of the car. Abilities that are no interval do not count.
        given: By the file that the car came with.
        city_map: Where it drives.
    """
    version = status.in_force
    abilities = {} if version is None else {one.name: one for one in version.abilities}
    known = {name: one for name, one in abilities.items() if not ability_problem(one)}
    limits, decel_mps2, unfit = given, None, ""
    if {"cruise_mps", "stopping_m"} <= known.keys() and known["stopping_m"].high > 0.0:
        speed_mps, way_m = known["cruise_mps"].value, known["stopping_m"].high
        decel_mps2 = speed_mps**2 / (2.0 * way_m)
        limits = replace(given, decel=min(given.decel, max(decel_mps2, LEAST_DECEL_MPS2)))
        if decel_mps2 < LEAST_DECEL_MPS2:
            unfit = f"it may need {way_m:.2g} m to stop from {speed_mps:.2g} m/s"
    turning = known.get("turning_radius_m")
    if not unfit and turning is not None and turning.before is not None:
        now, before = (misfit(city_map, m, given.width) for m in (turning.high, turning.before))
        unfit = "" if before else now
    by = f"version {status.version} of its car file: "
    return ChangedCar(limits, decel_mps2, unfit and by + unfit)
