"""Effects that no library holds: their files beside a car file that lists them."""

import inspect
from collections.abc import Sequence
from pathlib import Path

from scm.errors import CarError
from scm.vehicles.car import Car, all_terms
from scm.vehicles.jit import plain
from scm.vehicles.own_term import SUFFIX
from scm.vehicles.term import Term


def listed_terms(car: Car) -> list[str]:
    """Return what a car file's `terms` holds for this car, in its order."""
    return [
        term.name if term.name in all_terms() else term.name + SUFFIX for term in heads(car.terms)
    ]


def heads(terms: Sequence[Term]) -> list[Term]:
    """Return the effects without the further laws that come with them."""
    further = {part.name for term in terms for part in term.also}
    return [term for term in terms if term.name not in further]


def own_terms(car: Car) -> list[Term]:
    """Return the car's effects that the library does not hold."""
    return [term for term in heads(car.terms) if term.name not in all_terms()]


def write_own_terms(car: Car, folder: Path) -> list[str]:
    """Write the file of each of the car's own effects, and return the names.

    Raises:
        CarError: when an effect was never read from a file, so that none can be written.
    """
    written = []
    for term in own_terms(car):
        source = inspect.getsourcefile(plain(term.law))
        if source is None or Path(source).stem != term.name:
            msg = f"{term.name}: expected an effect read from its file, got one from {source}"
            raise CarError(msg)
        path, text = folder / (term.name + SUFFIX), Path(source).read_text(encoding="utf-8")
        path.write_text(text, encoding="utf-8")
        written.append(path.name)
    return written
