"""What a car weighs and where its centre of gravity lies, with all that its effects add.

Payload, a shifted or a raised centre of gravity are numbers of effects, not of the body: whoever
needs the mass or a lever arm about the centre of gravity asks here.
"""

from collections.abc import Callable
from dataclasses import dataclass

from scm.vehicles.car import Car
from scm.vehicles.jit import plain
from scm.vehicles.physics_variables import SIGNALS, Role
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
        car: Its effects say what they add.
        number: Gives a number by its key; without one, the car file does.
    """
    value = number or car.value
    totals = {key: value(key) for key in _ADDED.values()}
    for term in car.terms:
        if SIGNALS[term.target].role is Role.SHAPE:
            keys = {param.name: param.key for param in term.params}
            more = plain(term.law)(*(value(keys[name]) for name in reads(term.law)))
            totals[_ADDED[term.target]] += more
    return Shape(*totals.values())
