"""Effects that hold a car at rest on a slope.

The nominal tyres are quasi-static: they produce force only while they slip, so a car creeps on a
slope. On level floor none of this is used.
"""

from scm.vehicles.car import Car, all_terms

MEMORY = ("tyre_relaxation", "tyre_windup")
LENGTH_M = 0.002  # the smallest that is stable with 1 ms substeps: it hardly affects driving


def standing(car: Car) -> Car:
    """Return the car with effects that hold it at rest; its own effects stay.

    Tyres get relaxation. Friction that is modelled as a force on the body is zero at rest, so it
    also becomes dry friction at the wheels. Motors without holding torque stay as they are.
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
