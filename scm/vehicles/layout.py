"""Where everything of a car stands: columns of its numbers, rows of its state."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from scm.errors import TermError, nearest
from scm.vehicles import body14
from scm.vehicles.param import Param
from scm.vehicles.physics_variables import VARIABLES, Per
from scm.vehicles.term import Term


@dataclass(frozen=True, slots=True)
class Column:
    """One number of a car: `name` is the parameter's, with its term's where that is ambiguous."""

    name: str
    term: str
    param: Param

    @property
    def variable(self) -> str:
        """What the generated kernel calls it: with its term's name, so that nothing collides."""
        return f"{self.term}_{self.param.name}" if self.term else self.name


def columns_of(terms: Sequence[Term]) -> tuple[Column, ...]:
    """Return the skeleton's numbers, then the terms' in order; a shared key stands once."""
    found = {param.key: ("", param) for param in body14.PARAMS}
    for term in terms:
        for param in term.params:
            found.setdefault(param.key, (term.name, param))
    uses = Counter(param.name for _, param in found.values())
    uses.update(VARIABLES.keys())
    return tuple(
        Column(f"{term}.{param.name}" if term and uses[param.name] > 1 else param.name, term, param)
        for term, param in found.values()
    )


def find_column(columns: Sequence[Column], name: str) -> int:
    """Return the index of a column by its name or by its key in the car file.

    Raises:
        TermError: when no column, or more than one, is meant.
    """
    for i, column in enumerate(columns):
        if name in {column.name, column.param.key}:
            return i
    names = [column.name for column in columns]
    msg = f"no parameter {name!r} in this car{nearest(name, names)}"
    raise TermError(msg)


def rows_of(terms: Sequence[Term]) -> dict[str, tuple[int, int]]:
    """Return first row and width of everything in a fleet's block.

    Once a car, then once a wheel; each time inputs, states with those of terms, results: so what a
    call loads stands together, and so does what it stores.
    """
    rows: dict[str, tuple[int, int]] = {}
    offset = 0
    for per, width in ((Per.BODY, 1), (Per.WHEEL, 4)):
        for name in [*body14.INPUTS[per], *states_of(terms, per), *body14.OUTPUTS[per]]:
            rows[name] = (offset, width)
            offset += width
    return rows


def states_of(terms: Sequence[Term], per: Per) -> tuple[str, ...]:
    """Return what outlives a call: the skeleton's states, and what the terms keep."""
    from_terms = {term.target for term in terms if term.keeps is not None and term.per is per}
    return (*body14.STATES[per], *sorted(from_terms - set(body14.STATES[per])))
