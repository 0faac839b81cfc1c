"""A car's physics as values by name, to continue it in another city: what `Fleet` keeps of a row.

Values by name, since the floor of the other city may give the car other effects: those that both
know go over, the others start as in a new car.
"""

import hashlib
import math
from functools import cache

from scm.errors import RunError
from scm.geometry import Pose2, wrap_angle
from scm.v2x.messages.handover_request import CommandPast, HandedCar, NamedValues
from scm.vehicles.car import Car, load_car
from scm.vehicles.command_delay import CommandHistory
from scm.vehicles.fleet import Fleet

PLACES = (("x_cog", "y_cog"), ("x", "y"))
VECTORS = (("vx_world", "vy_world"), ("air_x", "air_y"), ("floor_slope_x", "floor_slope_y"))


@cache
def digest_of(car_file: str) -> str:
    """Return a hash of the effects and numbers of a car file: equal files, equal hash.

    Raises:
        CarError: when there is no such car file.
    """
    return digest_of_car(load_car(car_file))


def digest_of_car(car: Car) -> str:
    """Return likewise the hash of a car file that was read."""
    terms = " ".join(term.name for term in car.terms)
    values = "".join(f"{key}={car.values[key].value}\n" for key in sorted(car.values))
    return hashlib.blake2s(f"{terms}\n{values}".encode(), digest_size=8).hexdigest()


def variables_of(fleet: Fleet, row: int) -> tuple[NamedValues, ...]:
    """Return all that a fleet keeps of a car, in the world frame of its city."""
    variables = fleet.variables(row).items()
    return tuple(NamedValues(name=name, values=tuple(v.tolist())) for name, v in variables)


def parameters_of(fleet: Fleet, row: int) -> tuple[NamedValues, ...]:
    """Return the numbers of a car's physics."""
    numbers = zip(fleet.parameter_names, fleet.parameters[row].tolist(), strict=True)
    return tuple(NamedValues(name=name, values=(number,)) for name, number in numbers)


def past_of(fleet: Fleet, row: int) -> CommandPast | None:
    """Return a car's past commands; None: its actuators answer at once."""
    if fleet.history is None:
        return None
    knots, newest, before = fleet.history.memory(row)
    first, second = (None if math.isnan(value) else value for value in before.tolist())
    rows = tuple((t, a, b) for t, a, b in knots.tolist())
    return CommandPast(knots=rows, newest=int(newest[0]), before=(first, second))


def put_state(fleet: Fleet, row: int, state: HandedCar) -> None:
    """Continue a car from the state that it had in another city.

    Raises:
        RunError: when a variable has another number of values here, or a parameter is out of
            bounds.
    """
    _put_parameters(fleet, row, state.parameters)
    _put_variables(fleet, row, state.variables, Pose2(*state.origin))
    if fleet.history is not None and state.past is not None:
        _put_past(fleet.history, row, state.past)


def _put_variables(
    fleet: Fleet, row: int, variables: tuple[NamedValues, ...], origin: Pose2
) -> None:
    """Write variables; `origin` is that of the car's old map in the new one."""
    here = fleet.variables(row)
    for one in variables:
        view = here.get(one.name)
        if view is None:
            continue
        if len(one.values) != len(view):
            msg = f"variables: {one.name}: got {len(one.values)} values, expected {len(view)}"
            raise RunError(msg)
        view[:] = one.values
    c, s = math.cos(origin.yaw), math.sin(origin.yaw)
    for moved, pairs in ((1.0, PLACES), (0.0, VECTORS)):
        for x, y in pairs:
            ahead, left = here[x].copy(), here[y].copy()
            here[x][:] = moved * origin.x + (c * ahead - s * left)
            here[y][:] = moved * origin.y + (s * ahead + c * left)
    here["yaw"][:] = wrap_angle(float(here["yaw"][0]) + origin.yaw)
    fleet.push(row, 0.0, 0.0, 0.0)  # computes what follows from the state


def _put_parameters(fleet: Fleet, row: int, parameters: tuple[NamedValues, ...]) -> None:
    """Give a car the numbers of its physics, as far as its effects here have them."""
    places = {column.name: (at, column.param) for at, column in enumerate(fleet.columns)}
    for one in parameters:
        if len(one.values) != 1:
            raise RunError(f"parameters: {one.name}: got {len(one.values)} values, expected 1")
        if one.name not in places:
            continue
        at, param = places[one.name]
        (low, high), value = param.bounds, one.values[0]
        if not low <= value <= high:
            msg = f"parameters: {param.key} = {value:g}: expected {low:g} to {high:g} {param.unit}"
            raise RunError(msg)
        fleet.parameters[row, at] = value


def _put_past(history: CommandHistory, row: int, past: CommandPast) -> None:
    knots, newest, before = history.memory(row)
    if len(past.knots) != len(knots) or not 0 <= past.newest < 2**60:
        raise RunError(f"past.knots: got {len(past.knots)}, expected {len(knots)}")
    knots[:], newest[:] = past.knots, past.newest
    before[:] = [math.nan if value is None else value for value in past.before]
