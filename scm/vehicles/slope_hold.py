"""What a car is given where the floor slopes, so that it stands there instead of creeping.

The nominal tyres are quasi-static: they push only while they slip, so on a slope they creep. Where
the floor is level nothing of this is used, and nothing is computed.
"""

from scm.vehicles.car import Car, all_terms

MEMORY = ("tyre_relaxation", "tyre_windup")
LENGTH_M = 0.002  # the least that 1 ms substeps carry well: driving hardly feels it


def standing(car: Car) -> Car:
    """Return the car with what holds it at rest; what its file lists itself stays as it is.

    Tyres get memory. A drive line that is a force on the body gets dry friction of that size at
    rest, for the force alone is none there. Motors that do not hold are not made to.
    """
    own = {term.sets for term in car.terms} | {term.name for term in car.terms}
    new = [name for name in MEMORY if own.isdisjoint({name, all_terms()[name].sets})]
    values = {f"{name}.length_m": LENGTH_M for name in new}
    if "body_friction" in own and not any(term.adds == "dry_torque" for term in car.terms):
        new.append("stiction")
        values["drive.stiction_torque_nm"] = _friction_at_rest(car)
    chosen = {key: number for key, number in values.items() if not car.has(key)}
    return car.with_terms(new, chosen) if new else car


def _friction_at_rest(car: Car) -> float:
    """Dry friction of the whole car as a torque on each driven wheel [N*m]."""
    driven = 2.0 * (car.value("drive.front_driven") + car.value("drive.rear_driven"))
    force = car.value("body.friction_static_n")
    return force * car.value("wheel.radius_m") / driven if driven else 0.0
