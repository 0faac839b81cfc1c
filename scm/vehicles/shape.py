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


def shape_of(car: Car) -> Shape:
    """Return the mass properties of a car as its file says; its effects may add to the body's."""
    return shape_function(car)(car.value)


def shape_function(car: Car) -> Callable[[Callable[[str], float]], Shape]:
    """Return what gives a car's mass properties for numbers by their keys."""
    added = list[tuple[str, Callable[..., float], list[str]]]()
    for term in car.terms:
        if VARIABLES[term.target].role is Role.SHAPE:
            keys = {param.name: param.key for param in term.params}
            arguments = [keys[name] for name in reads(term.function)]
            added.append((_ADDED[term.target], plain(term.function), arguments))

    def shape(value: Callable[[str], float]) -> Shape:
        totals = {key: value(key) for key in _ADDED.values()}
        for key, function, arguments in added:
            totals[key] += function(*map(value, arguments))
        return Shape(*totals.values())

    return shape
