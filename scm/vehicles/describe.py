"""A car and its effects as text for people: `scm show car nigel`, `scm show terms`."""

from collections.abc import Iterator, Sequence

from scm.vehicles import body14
from scm.vehicles.car import Car, Quantity, all_terms
from scm.vehicles.facts import FACTS
from scm.vehicles.param import Param
from scm.vehicles.term import Term

_Row = tuple[str, str, str, str, str]


def describe_car(car: Car) -> str:
    """Return the assembled car: every effect with its equation, every number with its source."""
    title = f"{car.name}  {car.scale}".rstrip()
    lines = [
        title,
        "=" * len(title),
        f"{len(car.terms)} effects on 14 degrees of freedom: 6 of the body, 4 wheel hops, 4 spins",
        f"file  {car.path}",
        "",
        "body  masses and measures of the skeleton; no effect",
        *_table([_param_row(car, param) for param in body14.PARAMS]),
    ]
    for term in car.terms:
        lines += ["", *_term_head(term)]
        lines += _table([_param_row(car, param) for param in term.params])
    facts = [key for key in FACTS if car.has(key)]
    lines += ["", "outline, contacts, sensors"]
    lines += _table([_row(key, car.values[key], "") for key in facts])
    return "\n".join(lines) + "\n"


def describe_terms() -> str:
    """Return every effect known: equation, where it holds, what it shows in, its source."""
    lines: list[str] = []
    for term in all_terms().values():
        lines += [*_term_head(term)]
        lines += [
            f"    {heading.lower()}: {term.doc_line(heading)}"
            for heading in ("Holds", "Shows in", "Source")
        ]
        lines += _table(
            [
                (p.name, f"{p.default:g}", p.unit, f"{p.bounds[0]:g} to {p.bounds[1]:g}", p.about)
                for p in term.params
            ]
        )
        lines.append("")
    return "\n".join(lines)


def _term_head(term: Term) -> Iterator[str]:
    yield f"{term.name}  {term.about}"
    yield from (f"    {line}" for line in term.equation.split("; ") if line)


def _param_row(car: Car, param: Param) -> _Row:
    name, value, unit, source, _ = _row(param.name, car.values[param.key], "")
    return name, value, unit, source, param.about


def _row(name: str, quantity: Quantity, about: str) -> _Row:
    return name, _value(quantity), quantity.unit, quantity.source, about


def _value(quantity: Quantity) -> str:
    value = quantity.value
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        return ", ".join(f"{number:g}" for number in value)
    return f"{value:g}" + (f" ± {quantity.std:g}" if quantity.std is not None else "")


def _table(rows: Sequence[_Row]) -> Iterator[str]:
    widths = [max(9, *(min(len(row[i]), 34) for row in rows)) for i in range(3)] if rows else []
    for name, value, unit, source, about in rows:
        head = f"      {name:<{widths[0]}}  {value:<{widths[1]}}  {unit:<{widths[2]}}"
        yield f"{head}  {about}{'  ' if about else ''}[{source}]".rstrip()
