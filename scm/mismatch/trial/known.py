"""What the library says of an effect's parameters: their keys in a car file, and neutral values."""

from dataclasses import dataclass
from functools import cache

from scm.vehicles.car import all_terms
from scm.vehicles.param import Param
from scm.vehicles.sensor_fault import all_sensor_faults
from scm.vehicles.term import flat


@dataclass(frozen=True, slots=True)
class Known:
    """One parameter: its key in a car file, and the value at which its effect does nothing."""

    key: str
    neutral: float


@cache
def parameters_of(name: str) -> dict[str, Known]:
    """Return the parameters of an effect by public name; empty for one that is not listed."""
    if name in all_sensor_faults():
        measure = all_sensor_faults()[name]
        return _known(measure.params, dict(measure.neutral))
    if name not in all_terms():
        return {}
    found: dict[str, Known] = {}
    for term in flat([all_terms()[name]]):
        found = _known(term.params, dict(term.neutral or {})) | found
    return found


def _known(params: tuple[Param, ...], neutral: dict[str, float]) -> dict[str, Known]:
    return {
        param.report or param.name: Known(param.key, neutral.get(param.name, param.default))
        for param in params
    }


def is_measure(name: str) -> bool:
    """Say whether an effect is a fault of measurement."""
    return name in all_sensor_faults()
