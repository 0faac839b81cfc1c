"""Where everything of a car stands: columns of its numbers, slots of its state."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from scm.errors import TermError, nearest
from scm.vehicles import body14
from scm.vehicles.param import Param
from scm.vehicles.signals import Per
from scm.vehicles.term import Term


@dataclass(frozen=True, slots=True)
class Column:
    """One number of a car: `name` is the parameter's, with its term's where that is ambiguous."""

    name: str
    term: str
    param: Param

    @property
    def variable(self) -> str:
        """What the generated kernel calls it."""
        return self.name.replace(".", "_")


def columns_of(terms: Sequence[Term]) -> tuple[Column, ...]:
    """Return the skeleton's numbers, then the terms' in order; a shared key stands once."""
    found = {param.key: ("", param) for param in body14.PARAMS}
    for term in terms:
        for param in term.params:
            found.setdefault(param.key, (term.name, param))
    uses = Counter(param.name for _, param in found.values())
    return tuple(
        Column(param.name if uses[param.name] == 1 else f"{term}.{param.name}", term, param)
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


def slots_of(terms: Sequence[Term]) -> dict[str, tuple[int, int]]:
    """Return offset and width of everything in a fleet row, what the terms keep at the end."""
    entries = dict(body14.STATES + body14.INPUTS + body14.OUTPUTS)
    for term in terms:
        if term.keeps is not None:
            entries.setdefault(term.target, 4 if term.per is Per.WHEEL else 1)
    slots: dict[str, tuple[int, int]] = {}
    offset = 0
    for name, width in entries.items():
        slots[name] = (offset, width)
        offset += width
    return slots
