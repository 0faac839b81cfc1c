"""A car from its file: its effects, and each number with standard deviation, unit and source.

`types/<name>.toml` holds the shipped cars; those in the folder of the variable `SCM_CARS` have
names too; any other TOML file is loaded by its path.
"""

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from scm import registry
from scm.errors import CarError, TermError, nearest, reading
from scm.vehicles import body14
from scm.vehicles.car_file_schema import FileKey, file_keys
from scm.vehicles.car_files import OWN_CARS, TYPES_DIR, car_files, varied_values
from scm.vehicles.compiler.assemble import setters_of
from scm.vehicles.correlated import Correlated, read_correlated
from scm.vehicles.own_term import SUFFIX, load_own_term
from scm.vehicles.param import Param
from scm.vehicles.sensor_fault import AppliedFault, all_sensor_faults, read_faults
from scm.vehicles.term import Term, flat

TERMS = "scm.vehicles.terms"
STANDARD_TERMS = (
    "suspension_spring", "suspension_damper", "bump_stop", "tyre_contact", "tyre_longitudinal",
    "tyre_lateral", "motor_dc", "motor_damping", "motor_hold", "coulomb_friction",
    "reflected_inertia", "wheel_damping", "rolling_resistance", "steer_limit", "servo", "ackermann",
    "viscous_drag", "aero_drag", "yaw_drag",
)  # fmt: skip

Value = float | tuple[float, ...] | str


@dataclass(frozen=True, slots=True)
class Quantity:
    """One value of a car file; `std` is None if the file has none."""

    value: Value
    std: float | None
    unit: str
    source: str


@dataclass(frozen=True, slots=True)
class Car:
    """A car: its name, its effects in the file's order, and every value by `section.key`.

    Attributes:
        measures: Known sensor faults of its recordings, without numbers; see `faults`.
        correlated: Groups of numbers whose errors are correlated; all others are independent.
    """

    name: str
    scale: str
    path: Path
    terms: tuple[Term, ...]
    values: Mapping[str, Quantity]
    measures: tuple[AppliedFault, ...] = ()
    correlated: tuple[Correlated, ...] = ()

    @property
    def faults(self) -> tuple[AppliedFault, ...]:
        """Its sensor faults with the car's numbers, in the file's order."""
        return tuple(
            replace(fault, values={p.name: self.value(p.key) for p in fault.kind.params})
            for fault in self.measures
        )

    def has(self, key: str) -> bool:
        """Return whether the file, or an effect's default, has a value for this key."""
        return key in self.values

    def quantity(self, key: str) -> Quantity:
        """Return a value with its standard deviation, unit and source.

        Raises:
            CarError: when the car has no such key.
        """
        if key not in self.values:
            msg = f"{self.path}: {key}: not in this car{nearest(key, sorted(self.values))}"
            raise CarError(msg)
        return self.values[key]

    def with_terms(
        self, names: Sequence[str | Term], values: Mapping[str, float] | None = None
    ) -> "Car":
        """Return this car with further effects, and with other numbers by `section.key`.

        An effect, by name or as a term, replaces one that sets the same variable.

        Raises:
            CarError: naming every unknown effect and key, and every value outside its bounds.
        """
        known, problems = {**all_terms(), **{t.name: t for t in self.terms}}, list[str]()
        known |= {term.name: term for term in names if isinstance(term, Term)}
        wanted = [name.name if isinstance(name, Term) else name for name in names]
        problems += [f"no effect {n!r}{nearest(n, list(known))}" for n in wanted if n not in known]
        new = flat(known[name] for name in wanted if name in known)
        replaced = {term.sets for term in new if term.sets}
        others = [term for term in self.terms if term.sets not in replaced and term not in new]
        car = replace(self, terms=(*others, *new))
        numbers = _filled(car, {**_defaults(new), **self.values}, values or {}, problems)
        return replace(car, values=numbers)

    def with_measures(
        self, entries: Sequence[str], values: Mapping[str, float] | None = None
    ) -> "Car":
        """Return this car with further sensor faults, and with other numbers.

        Raises:
            CarError: naming every unknown fault and key, and every value outside its bounds.
        """
        problems: list[str] = []
        new = read_faults(list(entries), problems)
        others = [old for old in self.measures if old.kind not in [f.kind for f in new]]
        numbers = {**_fault_defaults(new), **self.values}
        numbers = _filled(self, numbers, values or {}, problems)
        return replace(self, measures=(*others, *new), values=numbers)

    def with_values(self, values: Mapping[str, Value]) -> "Car":
        """Return this car with other values by `section.key`: numbers, several, or words.

        Raises:
            CarError: naming every unknown key, and every value outside its bounds.
        """
        known, problems = _known_keys(self.terms), list[str]()
        new = dict(self.values)
        for key, value in values.items():
            kind = known.get(key)
            if kind is None or key not in new:
                problems.append(f"{key}: not in this car{nearest(key, sorted(new))}")
                continue
            plain = list(value) if isinstance(value, tuple) else value
            problems += _value_problems(key, plain, kind)
            number = float(value) if isinstance(value, int | float) else value
            new[key] = Quantity(number, None, kind.unit, "given")
        if problems:
            raise CarError("\n".join(f"{self.path}: {problem}" for problem in problems))
        return replace(self, values=new)

    def bounds(self, key: str) -> tuple[float, float]:
        """Return the lowest and highest number that a key may have.

        Raises:
            CarError: when the car has no such key.
        """
        self.quantity(key)
        return _known_keys(self.terms)[key].bounds

    def value(self, key: str) -> float:
        """Return a number such as `value("body.mass_kg")`, in the unit of its key."""
        value = self.quantity(key).value
        if not isinstance(value, float):
            msg = f"{self.path}: {key}: expected one number, got {value!r}"
            raise CarError(msg)
        return value

    def vector(self, key: str) -> tuple[float, ...]:
        """Return several numbers such as `vector("lidar.range_m")`."""
        value = self.quantity(key).value
        if not isinstance(value, tuple):
            msg = f"{self.path}: {key}: expected several numbers, got {value!r}"
            raise CarError(msg)
        return value

    def text(self, key: str) -> str:
        """Return a word such as `text("ips.tag_family")`."""
        value = self.quantity(key).value
        if not isinstance(value, str):
            msg = f"{self.path}: {key}: expected text, got {value!r}"
            raise CarError(msg)
        return value


def _filled(
    car: Car, numbers: dict[str, Quantity], values: Mapping[str, float], problems: list[str]
) -> dict[str, Quantity]:
    """Return the numbers with some replaced; raise CarError for unknown ones."""
    known = _known_keys(car.terms)
    for key, number in values.items():
        kind = known.get(key)
        if kind is None or key not in numbers:
            problems.append(f"{key}: not in this car{nearest(key, sorted(numbers))}")
        else:
            problems += _value_problems(key, number, kind)
            numbers[key] = Quantity(float(number), None, kind.unit, "given")
    if problems:
        raise CarError("\n".join(f"{car.path}: {problem}" for problem in problems))
    return numbers


def car_names() -> list[str]:
    """Return the names of all cars, shipped ones and the user's, sorted."""
    return sorted(car_files())


@cache
def all_terms() -> Mapping[str, Term]:
    """Return every known effect, by name."""
    return {name: registry.load(TERMS, name, "TERM", Term) for name in registry.names(TERMS)}


@contextmanager
def varied_cars(cars: Mapping[str, Car]) -> Iterator[None]:
    """Let these cars be what `load_car` returns for their names, in this process, for a while.

    They look so, too (`scm.scenery.bodies.car_body`). A study's case runs alone in its process,
    with numbers of its own for a car of a known name. Afterwards those are back that were before.
    """
    cars_before, values_before = dict(_varied), dict(varied_values)
    _varied.update(cars)
    for name, car in cars.items():
        varied_values[name] = {key: quantity.value for key, quantity in car.values.items()}
    try:
        yield
    finally:
        _varied.clear()
        _varied.update(cars_before)
        varied_values.clear()
        varied_values.update(values_before)


_varied: dict[str, Car] = {}


def load_car(name_or_path: str | Path, *, trusted: bool = True) -> Car:
    """Read a car by its name, or by the path of any car file.

    Args:
        name_or_path: Of the car.
        trusted: False for a path from somebody else's data: a file with an effect of its own, which
            is code, is then refused.

    Raises:
        CarError: naming every problem of the file at once.
    """
    if str(name_or_path) in _varied:
        return _varied[str(name_or_path)]
    path = Path(name_or_path)
    if path.suffix != ".toml":
        path = car_files().get(str(name_or_path), TYPES_DIR / f"{name_or_path}.toml")
    if not path.is_file():
        hint = nearest(Path(name_or_path).stem, car_names())
        what = "file" if Path(name_or_path).suffix == ".toml" else "car"
        own = f"; cars of your own: {OWN_CARS}=FOLDER of their files" if what == "car" else ""
        msg = f"{name_or_path}: no such {what}; cars by name: {', '.join(car_names())}{hint}{own}"
        raise CarError(msg)
    with reading(path, "a TOML file", CarError):
        data = _parsed(path.read_text(encoding="utf-8"))
    return car_of(data, path, trusted=trusted)


@lru_cache(maxsize=64)
def _parsed(text: str) -> Mapping[str, Any]:
    """Parse a car file; the same few are loaded again and again."""
    return tomllib.loads(text)


def car_of_text(text: str, path: Path) -> Car:
    """Parse the text of an unwritten car file; `path` names it in errors.

    Raises:
        CarError: naming every problem at once.
    """
    with reading(path, "a TOML file", CarError):
        return car_of(tomllib.loads(text), path, trusted=False)


def car_of(data: Mapping[str, Any], path: Path, *, trusted: bool = True) -> Car:
    """Make a car from parsed TOML; `path` names it in errors, its own effects are files beside it.

    Raises:
        CarError: naming every problem at once.
    """
    problems: list[str] = []
    terms = _terms(data, path.parent if trusted else None, problems)
    faults = read_faults(data.get("measures", []), problems)
    values = _defaults(terms) | _fault_defaults(faults) | _key_defaults(data)
    values |= _values(data, terms, problems)
    problems += _contradictions(data, values)
    stds = {key: quantity.std for key, quantity in values.items()}
    correlated = read_correlated(data.get("correlated", []), stds, problems)
    try:
        setters_of(terms)
    except TermError as error:
        problems.append(f"terms: {error}")
    if problems:
        raise CarError("\n".join(f"{path}: {problem}" for problem in problems))
    if "drive.layout" in values and "drive.rear_driven" not in _flat(data):
        rear = 0.0 if values["drive.layout"].value == "front" else 1.0
        values["drive.rear_driven"] = Quantity(rear, None, "1", "drive.layout")
    name, scale = str(data.get("name", path.stem)), str(data.get("scale", ""))
    return Car(name, scale, path, terms, values, faults, correlated)


def _terms(data: Mapping[str, Any], folder: Path | None, problems: list[str]) -> tuple[Term, ...]:
    names = data.get("terms", list(STANDARD_TERMS))
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        problems.append(f"terms: expected a list of effect names, got {names!r}")
        return ()
    own = [name for name in names if name.endswith(SUFFIX)]
    known = {**all_terms(), **_own_terms(folder, own, problems)}
    for i, name in enumerate(names):
        if name not in known and name not in own:
            problems.append(f"terms: no effect {name!r}{nearest(name, list(known))}")
        elif name in names[:i]:
            problems.append(f"terms: {name!r} is listed twice")
    return flat(known[name] for name in dict.fromkeys(names) if name in known)


def _own_terms(folder: Path | None, names: list[str], problems: list[str]) -> dict[str, Term]:
    found: dict[str, Term] = {}
    for name in names:
        if folder is None:
            problems.append(f"terms: {name} is code; if you trust it, give this car file yourself")
            continue
        try:
            term = load_own_term(folder, name)
        except TermError as error:
            problems.append(f"terms: {error}")
            continue
        if term.name in all_terms():
            problems.append(f"terms: {name}: {term.name!r} is an effect already; use another name")
        found[name] = term
    return found


def _defaults(terms: tuple[Term, ...]) -> dict[str, Quantity]:
    own = [("skeleton", param) for param in body14.PARAMS if not param.required]
    own += [(term.name, param) for term in terms for param in term.params]
    return {p.key: Quantity(p.default, None, p.unit, f"default of {owner}") for owner, p in own}


def _fault_defaults(faults: Sequence[AppliedFault]) -> dict[str, Quantity]:
    return {
        p.key: Quantity(p.default, None, p.unit, f"default of {fault.kind.name}")
        for fault in faults
        for p in fault.kind.params
    }


def _key_defaults(data: Mapping[str, Any]) -> dict[str, Quantity]:
    return {
        key: Quantity(schema.default, None, schema.unit, "default")
        for key, schema in file_keys().items()
        if schema.default is not None and isinstance(data.get(key.partition(".")[0]), dict)
    }


def _flat(data: Mapping[str, Any]) -> dict[str, Any]:
    sections = {name: body for name, body in data.items() if isinstance(body, dict)}
    return {f"{s}.{key}": entry for s, body in sections.items() for key, entry in body.items()}


def _known_keys(terms: Sequence[Term]) -> dict[str, Param | FileKey]:
    known = flat([*all_terms().values(), *terms])
    params = [*body14.PARAMS, *(param for term in known for param in term.params)]
    params += [param for fault in all_sensor_faults().values() for param in fault.params]
    return {**file_keys(), **{param.key: param for param in params}}


def _values(
    data: Mapping[str, Any], terms: Sequence[Term], problems: list[str]
) -> dict[str, Quantity]:
    known = _known_keys(terms)
    sections = {key.partition(".")[0] for key in known}
    problems += _top_problems(data, sections | _unread(data, terms))
    values: dict[str, Quantity] = {}
    flat = _flat(data)
    for key, entry in flat.items():
        if key.partition(".")[0] not in sections:
            continue
        if key not in known:
            problems.append(f"{key}: no such key{_nearest_key(key, known)}")
            continue
        found = list(_entry_problems(key, entry, known[key]))
        problems += found
        if not found:
            values[key] = _quantity(entry, known[key])
    for param in body14.PARAMS:
        if param.required and param.key not in flat:
            problems.append(f"{param.key}: missing; expected {param.about} [{param.unit}]")
    return values


def _unread(data: Mapping[str, Any], terms: Sequence[Term]) -> set[str]:
    """Return the sections of own effects that could not be read: reported already."""
    entries = data.get("terms", [])
    own = {Path(n).stem for n in entries if isinstance(n, str) and n.endswith(SUFFIX)}
    return own - {term.name for term in terms}


def _nearest_key(key: str, known: Iterable[str]) -> str:
    name = key.partition(".")[2]
    return nearest(key, [valid for valid in known if nearest(name, [valid.partition(".")[2]])])


def _top_problems(data: Mapping[str, Any], sections: set[str]) -> Iterator[str]:
    for name, body in data.items():
        if name in {"name", "scale"}:
            if not isinstance(body, str):
                yield f"{name}: expected text, got {body!r}"
            elif name == "name" and not re.fullmatch(r"[A-Za-z0-9_-]{1,40}", body):
                yield f"name: expected up to 40 letters, digits, - and _, got {body!r}"
        elif name not in {"terms", "measures", "correlated"} and (
            name not in sections or not isinstance(body, dict)
        ):
            valid = [*sorted(sections), "correlated", "measures", "name", "scale", "terms"]
            yield f"[{name}]: no such section{nearest(name, valid)}"


def _entry_problems(key: str, entry: Any, kind: Param | FileKey) -> Iterator[str]:
    fields = ["value", "std", "unit", "source"]
    for name in entry if isinstance(entry, dict) else ():
        if name not in fields:
            yield f"{key}: no such field {name!r}{nearest(name, fields)}"
    if not isinstance(entry, dict) or "value" not in entry:
        yield f"{key}: expected {{ value = ..., source = ... }}, got {entry!r}"
        return
    if not isinstance(entry.get("source", ""), str):
        yield f"{key}.source: expected text, got {entry['source']!r}"
    if entry.get("unit", kind.unit) != kind.unit:
        yield f"{key}.unit: expected {kind.unit!r}, got {entry['unit']!r}"
    if "std" in entry and not (_is_number(entry["std"]) and entry["std"] >= 0):
        yield f"{key}.std: expected a number >= 0, got {entry['std']!r}"
    yield from _value_problems(key, entry["value"], kind)


def _value_problems(key: str, value: Any, kind: Param | FileKey) -> Iterator[str]:
    count = kind.count if isinstance(kind, FileKey) else 1
    if isinstance(kind, FileKey) and count == 0:
        if not isinstance(value, str) or (kind.words and value not in kind.words):
            expected = " or ".join(map(repr, kind.words)) or "text"
            yield f"{key}: expected {expected}, got {value!r}"
        return
    low, high = kind.bounds
    numbers = value if isinstance(value, list) else [value]
    if (isinstance(value, list) != (count > 1)) or not all(map(_is_number, numbers)):
        yield f"{key}: expected {count} number{'s' * (count > 1)} [{kind.unit}], got {value!r}"
    elif len(numbers) != count:
        yield f"{key}: expected {count} numbers [{kind.unit}], got {len(numbers)}"
    elif not all(low <= number <= high for number in numbers):
        yield f"{key}: expected {low:g} to {high:g} {kind.unit}, got {value!r}"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _quantity(entry: Mapping[str, Any], kind: Param | FileKey) -> Quantity:
    raw = entry["value"]
    value: Value
    if isinstance(raw, list):
        value = tuple(float(number) for number in raw)
    else:
        value = raw if isinstance(raw, str) else float(raw)
    std = float(entry["std"]) if "std" in entry else None
    return Quantity(value, std, kind.unit, entry.get("source", ""))


def _contradictions(data: Mapping[str, Any], values: Mapping[str, Quantity]) -> Iterator[str]:
    flat = _flat(data)

    def number(key: str) -> float | None:
        value = values[key].value if key in flat and key in values else None
        return value if isinstance(value, float) else None

    mass, wheel = number("body.mass_kg"), number("wheel.mass_kg")
    if mass is not None and wheel is not None and 4.0 * wheel >= mass:
        yield f"wheel.mass_kg: four wheels of {wheel} kg outweigh body.mass_kg = {mass}"
    cog, base = number("body.cog_to_rear_axle_m"), number("body.wheelbase_m")
    if cog is not None and base is not None and cog >= base:
        yield f"body.cog_to_rear_axle_m: expected less than body.wheelbase_m = {base}, got {cog}"
    shift = number("com_shift.shift_m")
    if cog is not None and base is not None and shift is not None and not 0 < cog + shift < base:
        yield f"com_shift.shift_m: {shift:g} puts the centre of gravity outside the axles"
    height, raised = number("body.cog_height_m"), number("load_transfer.height_m")
    if height is not None and raised is not None and height + raised <= 0.0:
        yield f"load_transfer.height_m: {raised:g} puts the centre of gravity below the floor"
    for kind in ("slip", "lateral_slip"):
        peak, slides = number(f"tyre.{kind}_extremum"), number(f"tyre.{kind}_asymptote")
        if peak is not None and slides is not None and slides <= peak:
            yield f"tyre.{kind}_asymptote: expected above the extremum at {peak:g}, got {slides:g}"
    front = number("drive.front_driven")
    layout = values["drive.layout"].value if "drive.layout" in values else None
    if front is not None and layout is not None and (front > 0.0) != (layout != "rear"):
        yield f"drive.front_driven: {front:g} contradicts drive.layout = {layout!r}"
