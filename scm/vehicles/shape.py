"""Mass and centre of gravity of a car, including what its effects add.

Payload and shifts of the centre of gravity are parameters of effects, not of the body: this module
gives the totals for masses and lever arms.
"""

from collections.abc import Callable
from dataclasses import dataclass

from scm.vehicles.car import Car
from scm.vehicles.jit import plain
from scm.vehicles.physics_variables import VARIABLES, Role
from scm.vehicles.term import reads

_ADDED = {
    "added_mass": "body.mass_kg",
    "added_cog_x": "body.cog_to_rear_axle_m",
    "added_cog_z": "body.cog_height_m",
}


@dataclass(frozen=True, slots=True)
class Shape:
    """Mass [kg] and centre of gravity [m] of one car, payload and shifts included."""

    mass: float
    cog_to_rear_axle: float
    cog_height: float


def shape_of(car: Car, number: Callable[[str], float] | None = None) -> Shape:
    """Return a car's mass properties.

    Args:
        car: Its effects may add to the body's values.
        number: Returns a number by its key; default: from the car file.
    """
    value = number or car.value
    totals = {key: value(key) for key in _ADDED.values()}
    for term in car.terms:
        if VARIABLES[term.target].role is Role.SHAPE:
            keys = {param.name: param.key for param in term.params}
            more = plain(term.function)(*(value(keys[name]) for name in reads(term.function)))
            totals[_ADDED[term.target]] += more
    return Shape(*totals.values())
