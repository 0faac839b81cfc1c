"""Cars that have every effect, all at rest that a test does not name: one kernel for all of them.

A kernel takes seconds to compile, and `tests/physics/test_neutral_terms.py` shows that an effect at
its neutral values changes no bit.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

from scm.vehicles.car import all_terms, load_car
from scm.vehicles.term import flat

GENESIS = str(Path(__file__).parents[1] / "recordings/cars/genesis.toml")
"""A full-size car whose throttle commands a speed."""


@cache
def at_rest(base="nigel"):
    """A car with every effect it lacks, at neutral values."""
    car = load_car(base)
    own = {term.name for term in car.terms}
    set_already = {term.sets for term in car.terms if term.sets}
    lacking = [
        term
        for term in all_terms().values()
        if term.neutral and term.name not in own and term.sets not in set_already
    ]
    numbers = {
        param.key: part.neutral[param.name]
        for term in lacking
        for part in flat([term])
        for param in part.params
        if param.name in part.neutral
    }
    return car.with_terms([term.name for term in lacking], numbers)


def car_with(names=(), numbers=None, base="nigel"):
    """A car with these effects at their default values, but for the numbers given."""
    car, own = at_rest(base), load_car(base).values
    defaults = {
        param.key: param.default
        for name in names
        for part in flat([all_terms()[name]])
        for param in part.params
        if param.key not in own
    }
    known = {term.name for term in car.terms}
    parts = [name for name in names if {t.name for t in flat([all_terms()[name]])} - known]
    return car.with_terms(parts, defaults | (numbers or {}))


def with_combined_slip(car):
    """The car with one curve for slip along and across in place of two."""
    pure = {"tyre_longitudinal", "tyre_lateral"}
    return replace(car, terms=tuple(t for t in car.terms if t.name not in pure)).with_terms(
        ["tyre_combined"]
    )
