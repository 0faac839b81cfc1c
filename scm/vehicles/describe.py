"""A car as text, `scm show car nigel`: its effects, its numbers, and warnings."""

from collections.abc import Iterator, Mapping, Sequence

from scm.vehicles import body14
from scm.vehicles.car import Car, Quantity, all_terms
from scm.vehicles.car_file_schema import file_keys
from scm.vehicles.drivers.limits import turning_radius_m
from scm.vehicles.param import Param
from scm.vehicles.term import Term, flat

_Row = tuple[str, str, str, str, str]


def describe_car(car: Car) -> str:
    """Return the car: its effects in a line each, every number of its file, and warnings."""
    title = f"{car.name}  {car.scale}".rstrip()
    effects = _effects(car)
    lines = [
        title,
        "=" * len(title),
        f"file     {car.path}",
        f"turns    on a radius of {turning_radius_m(car):.3f} m at best, middle of the rear axle",
        "skeleton 14 degrees of freedom: body 6, wheel hops 4, wheel spins 4",
        f"effects  {len(effects)} of the {len(all_terms())} known; "
        "`scm show terms NAME` shows an equation",
        "",
        "EFFECTS, in the file's order",
        *_columns([(f"  {term.name}", _without_name(term)) for term in effects]),
        "",
        "NUMBERS, by the car file's sections: value ± one standard deviation, unit, source",
    ]
    for section, rows in _sections(car).items():
        lines += ["", f"  [{section}]", *_table(rows)]
    warnings = list(warnings_of(car))
    lines += ["", f"WARNINGS  {len(warnings) or 'none'}", *(f"  ! {text}" for text in warnings)]
    return "\n".join(lines) + "\n"


def warnings_of(car: Car) -> Iterator[str]:
    """Yield warnings: defaults in use, numbers without effect or source, implausible values."""
    params = _params(car)
    defaults = [key for key in params if car.values[key].source.startswith("default of")]
    if defaults:
        yield f"not in the file, so at their defaults: {', '.join(defaults)}"
    for reader, keys in _idle(car, {*params, *file_keys()}).items():
        yield f"{reader} is not listed, so nothing reads {', '.join(keys)}"
    for key, quantity in car.values.items():
        if not quantity.source:
            yield f"{key}: {_value(quantity)} has no source; add source = ..."
    for target in ("tyre_x", "tyre_y"):
        names = [term.name for term in car.terms if term.adds == target]
        if len(names) > 1:
            yield f"{' and '.join(names)} add up in {target}: list one tyre"
    yield from _at_bounds(car, params)
    yield from _tips_over(car)


def _idle(car: Car, used: set[str]) -> dict[str, list[str]]:
    """Return keys that no listed effect reads, by the first effect that would."""
    found: dict[str, list[str]] = {}
    for key in car.values:
        if key not in used:
            reader = next(term.name for term in all_terms().values() if key in _keys(term))
            found.setdefault(reader, []).append(key)
    return found


def _at_bounds(car: Car, params: Mapping[str, Param]) -> Iterator[str]:
    for key, param in params.items():
        quantity, (low, high) = car.values[key], param.bounds
        if quantity.std is not None and isinstance(quantity.value, float) and param.fit:
            least, most = quantity.value - quantity.std, quantity.value + quantity.std
            if least < low < quantity.value or quantity.value < high < most:
                yield f"{key}: {_value(quantity)} reaches past its bounds {low:g} to {high:g}"


def _tips_over(car: Car) -> Iterator[str]:
    grip = next(
        (car.value(k) for k in ("tyre.lateral_force_extremum", "tyre.front_d") if car.has(k)), None
    )
    tipping_ratio = 0.5 * car.value("body.track_m") / car.value("body.cog_height_m")
    if grip is not None and grip > tipping_ratio:
        yield f"its tyres hold {grip:.2g} times the load, but it rolls over at {tipping_ratio:.2g}"


def _effects(car: Car) -> list[Term]:
    known = all_terms()
    further = {part.name for term in car.terms for part in term.also}
    return [term for term in car.terms if term.name in known or term.name not in further]


def _without_name(term: Term) -> str:
    """Return the effect's sentence without its own name at the start."""
    head, colon, rest = term.about.partition(": ")
    same = head.lower().replace("-", "").split() == term.name.split("_")
    return rest[:1].upper() + rest[1:] if colon and same else term.about


def _keys(term: Term) -> set[str]:
    return {param.key for part in flat([term]) for param in part.params}


def _params(car: Car) -> dict[str, Param]:
    own = [*body14.PARAMS, *(param for term in car.terms for param in term.params)]
    return {param.key: param for param in own}


def _sections(car: Car) -> dict[str, list[_Row]]:
    params = _params(car)
    sections: dict[str, list[_Row]] = {}
    for key in dict.fromkeys([*params, *car.values]):
        quantity = car.values[key]
        section, _, name = key.partition(".")
        about = params[key].about if key in params else ""
        unit = "" if quantity.unit == "1" else quantity.unit
        row = (name, _value(quantity), unit, about, quantity.source)
        sections.setdefault(section, []).append(row)
    return sections


def _value(quantity: Quantity) -> str:
    value = quantity.value
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        return ", ".join(f"{number:g}" for number in value)
    return f"{value:g}" + (f" ± {quantity.std:g}" if quantity.std is not None else "")


def _table(rows: Sequence[_Row]) -> Iterator[str]:
    widths = [max(min(len(row[i]), most) for row in rows) for i, most in enumerate((28, 24, 12))]
    meaning = max(len(row[3]) for row in rows)
    for name, value, unit, about, source in rows:
        head = f"    {name:<{widths[0]}}  {value:<{widths[1]}}  {unit:<{widths[2]}}"
        if len(value) > widths[1]:  # a long list takes a line of its own
            yield f"    {name:<{widths[0]}}  {value}"
            head = f"    {'':<{widths[0]}}  {'':<{widths[1]}}  {unit:<{widths[2]}}"
        yield f"{head}  {about:<{meaning}}  {source}".rstrip()


def _columns(rows: Sequence[tuple[str, str]]) -> Iterator[str]:
    width = max(len(name) for name, _ in rows)
    yield from (f"{name:<{width}}  {text}" for name, text in rows)
