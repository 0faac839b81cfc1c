"""The given car's file with the effects found: `scm replay --car car.toml` and fleets load it.

Comments stay, and so does every number that was not moved. A number that was moved states by which
recording, its 90 % interval, and what the file stated before.
"""

import inspect
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from textwrap import wrap

from msgspec import structs

from scm.errors import CarError
from scm.mismatch.evidence import Evidence
from scm.mismatch.findings import Course, Diagnosis, Effect, Estimate
from scm.mismatch.report.wording import moment
from scm.vehicles.car import Car, Quantity, Value, all_terms, load_car
from scm.vehicles.car_text import (
    number,
    quoted,
    set_entry,
    set_list,
    term_names,
    without_further,
)
from scm.vehicles.describe_effects import all_effects, params_of
from scm.vehicles.jit import plain
from scm.vehicles.own_term import SUFFIX
from scm.vehicles.sensor_fault import AppliedFault, all_sensor_faults
from scm.vehicles.term import Term

_SAME_SHARE = 0.01  # two numbers that differ by less than this share are one
FILE = "car.toml"
FOUND_DIGITS = 6  # of a number found: far more than any interval allows
COMMENT = "found by scm mismatch"
_COMMENT_WIDTH = 96
_INTERVAL_STDS = 3.29  # of a normal distribution, from end to end of a 90 % interval
_Entries = Mapping[str, Mapping[str, object]]


def write_car(
    diagnosis: Diagnosis, evidence: Evidence, car: Car, patched: Car, folder: Path
) -> list[str]:
    """Write `car.toml` and its own effects into the folder, and return the names of the files.

    Raises:
        CarError: when what was found cannot be written so that it loads again.
    """
    try:
        own = write_own_terms(patched, folder)
    except OSError as error:
        msg = f"{FILE}: the file of an effect of its own is gone: {error}"
        raise CarError(msg) from error
    entries = dict(_entries(diagnosis, evidence, car, patched))
    path, note = folder / FILE, _note(diagnosis) + _changes(diagnosis.effects)
    path.write_text(note + _edited(car, patched, entries, evidence), encoding="utf-8")
    if not _loads_as(path, patched):
        path.write_text(note + _anew(patched, entries, evidence), encoding="utf-8")
        load_car(path)
    return [FILE, *own]


def _loads_as(path: Path, patched: Car) -> bool:
    """Return whether the file loads as this car."""
    try:
        read = load_car(path)
    except CarError:
        return False
    same = sorted(term_names(read)) == sorted(term_names(patched))
    same = same and list(map(_measure_entry, read.measures)) == list(
        map(_measure_entry, patched.measures)
    )
    same = same and read.correlated == patched.correlated
    return same and all(
        key in read.values and _equal(read.values[key].value, quantity.value, rel_tol=1e-5)
        for key, quantity in patched.values.items()
    )


def _equal(a: Value, b: Value, rel_tol: float = 1e-8) -> bool:
    if isinstance(a, float) and isinstance(b, float):
        return math.isclose(a, b, rel_tol=rel_tol, abs_tol=1e-12)
    return a == b


def _measure_entry(fault: AppliedFault) -> str:
    """Return a fault as a car file's `measures` list names it."""
    where = f" on {', '.join(fault.channels)}" if fault.channels else ""
    return fault.kind.name + where


def _entries(
    diagnosis: Diagnosis, evidence: Evidence, car: Car, patched: Car
) -> Iterator[tuple[str, str]]:
    """Yield key and new text of each number that the given car's file does not state."""
    stands = _file_entries(car.path)
    estimates = _estimates_by_key(diagnosis, evidence, car, patched)
    stds = {one.key: one.found_std for one in evidence.refitted}
    for key, quantity in patched.values.items():
        old = stands.get(key)
        is_stated = old is not None and _equal(_value_of(old), quantity.value)
        is_default = old is None and quantity.source.startswith(("default", "drive.layout"))
        if not is_stated and not is_default:
            moved = key not in car.values or car.values[key].value != quantity.value
            yield (
                key,
                _entry(quantity, estimates.get(key), stds.get(key), old, evidence, moved=moved),
            )


def _file_entries(path: Path) -> _Entries:
    if not path.is_file():
        return {}
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    sections = {name: body for name, body in data.items() if isinstance(body, dict)}
    return {f"{s}.{k}": entry for s, body in sections.items() for k, entry in body.items()}


def _value_of(entry: Mapping[str, object]) -> Value:
    value = entry["value"]
    if isinstance(value, list):
        return tuple(float(item) for item in value)
    return value if isinstance(value, str) else float(value)  # type: ignore[arg-type]


def _entry(
    quantity: Quantity,
    estimate: Estimate | None,
    found_std: float | None,
    old: Mapping[str, object] | None,
    evidence: Evidence,
    *,
    moved: bool,
) -> str:
    if not moved:
        return _inline(quantity.value, quantity.std, quantity.source)
    std, source = quantity.std, f"mismatch: {_recording(evidence)}"
    if estimate is not None and math.isfinite(estimate.high - estimate.low):
        source += f", 90 % {estimate.low:.4g}..{estimate.high:.4g}"
        std = found_std or max(0.0, estimate.high - estimate.low) / _INTERVAL_STDS
    if old is not None:
        source += f"; before: {_before(old)}"
    return _inline(quantity.value, std, source, FOUND_DIGITS)


def _before(old: Mapping[str, object]) -> str:
    spread = f" +- {old['std']}" if "std" in old else ""
    source = f" ({old['source']})" if old.get("source") else ""
    return f"{old['value']}{spread}{source}"


def _recording(evidence: Evidence) -> str:
    first, *more = evidence.recordings or ("a recording",)
    return f"{first} and {len(more)} more" if more else first


def _inline(value: Value, std: float | None, source: str, digits: int = 9) -> str:
    fields = [f"value = {_written(value, digits)}"]
    fields += [f"std = {std:.3g}"] if std is not None else []
    return "{ " + ", ".join([*fields, f"source = {quoted(source)}"]) + " }"


def _written(value: Value, digits: int) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(number(item, digits) for item in value) + "]"
    return quoted(value) if isinstance(value, str) else number(value, digits)


def _edited(car: Car, patched: Car, entries: Mapping[str, str], evidence: Evidence) -> str:
    """Return the given car's own text, changed where it has to be."""
    if not car.path.is_file():
        return _anew(patched, entries, evidence)
    text = car.path.read_text(encoding="utf-8")
    data = tomllib.loads(text)
    if term_names(load_car(car.path)) != term_names(patched):
        text = set_list(text, "terms", term_names(patched), COMMENT)
    measures = list(map(_measure_entry, patched.measures))
    if data.get("measures", []) != measures:
        text = set_list(text, "measures", measures, COMMENT)
    for key, entry in entries.items():
        section, _, name = key.partition(".")
        text = set_entry(text, section, name, entry)
    return _headline(evidence) + _with_correlated(text, patched)


def _changes(effects: Sequence[Effect]) -> str:
    """Return comments that say what changed during the recording, and when."""
    lines = list[str]()
    for effect in effects:
        if effect.is_of_recording:
            lines.append(f"# {effect.name}: only recorded.toml has it, for it is of that time.\n")
        elif effect.since_s is not None and effect.until_s is not None:
            when = f"from {moment(effect.since_s)} to {moment(effect.until_s)}"
            lines.append(
                f"# {effect.name} was there {when} of it:\n# during.toml is the car with it, "
                "car.toml the car without.\n"
            )
        elif effect.since_s is not None:
            when = f"since {moment(effect.since_s)}"
            lines.append(f"# {effect.name} is so {when} of it; before.toml is the car before.\n")
        elif effect.course is Course.RAMP:
            lines.append(
                f"# {effect.name} grew over it and is as it was at its end; before.toml is the "
                "car as it was at its begin.\n"
            )
    return "".join(lines)


def given_text(car: Car) -> str:
    """Return the text of a car's file; of a car that has none, one that says the same."""
    if car.path.is_file():
        return car.path.read_text(encoding="utf-8")
    return _anew(car, {}, None)


def _headline(evidence: Evidence) -> str:
    """Return a comment that says what this file is."""
    return (
        f"# With what `scm mismatch` found in {_plain(_recording(evidence))}: numbers that it "
        'moved have a\n# source that begins with "mismatch"; all else is the file that was given.\n'
    )


def _note(diagnosis: Diagnosis) -> str:
    """Return a comment that says why the file does not hold what was found; empty if it does."""
    failure = diagnosis.failure
    texts = () if failure is None else (failure.text, *failure.reasons)
    return "".join(f"# {line}\n" for text in texts for line in wrap(_plain(text), _COMMENT_WIDTH))


def _plain(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


def _anew(patched: Car, entries: Mapping[str, str], evidence: Evidence | None) -> str:
    """Return the car as a file of its own, where the given text cannot be changed in place."""
    lines = [f"name = {quoted(patched.name)}"]
    lines += [f"scale = {quoted(patched.scale)}"] if patched.scale else []
    for key, names in (
        ("terms", term_names(patched)),
        ("measures", list(map(_measure_entry, patched.measures))),
    ):
        lines += [f"{key} = [", *(f"    {quoted(name)}," for name in names), "]"]
    sections: dict[str, list[str]] = {}
    for key, quantity in patched.values.items():
        section, _, name = key.partition(".")
        if key in entries or not quantity.source.startswith(("default", "drive.layout")):
            same = _inline(quantity.value, quantity.std, quantity.source)
            sections.setdefault(section, []).append(f"{name} = {entries.get(key, same)}")
    for section, rows in sections.items():
        lines += ["", f"[{section}]", *rows]
    head = "" if evidence is None else _headline(evidence)
    return head + _with_correlated("\n".join(lines) + "\n", patched)


def _with_correlated(text: str, patched: Car) -> str:
    """Return a car file's text with the correlations of this car, in place of what it had."""
    others = re.sub(r"^\[\[correlated\]\][^\n]*\n(?:(?!\[).*\n?)*", "", text, flags=re.MULTILINE)
    blocks = []
    for group in patched.correlated:
        rows = ",\n".join(f"    [{', '.join(f'{v:g}' for v in row)}]" for row in group.matrix)
        names = ", ".join(quoted(name) for name in group.numbers)
        blocks.append(f"\n[[correlated]]\nnumbers = [{names}]\nmatrix = [\n{rows},\n]\n")
    return others.rstrip() + "\n" + "".join(blocks)


def _estimates_by_key(
    diagnosis: Diagnosis, evidence: Evidence, car: Car, patched: Car
) -> dict[str, Estimate]:
    """Return every estimate by the `section.key` at which a car file holds its number."""
    found = {one.key: one.found for one in evidence.refitted}
    there = [one for one in diagnosis.effects if one.course is not Course.INTERMITTENT]
    for effect in there:
        for key, estimate in _of_effect(effect, car, patched):
            found[key] = _in_place(estimate, key, car, patched)
    return found


def _of_effect(effect: Effect, car: Car, patched: Car) -> Iterator[tuple[str, Estimate]]:
    measure = all_sensor_faults().get(effect.name)
    if measure and measure.stands_for and measure not in [f.kind for f in patched.measures]:
        share = effect.parameters.get(measure.params[0].reported)
        if share is not None and car.has(measure.stands_for):
            yield measure.stands_for, _times(share, car.value(measure.stands_for))
        return
    known = all_effects()
    own = [
        param
        for term in _own_terms(patched)
        for param in params_of(term)
        if param.key.startswith(f"{term.name}.")  # and not one of a library's that it calls
    ]
    for param in params_of(known[effect.name]) if effect.name in known else own:
        if param.reported in effect.parameters:
            yield param.key, effect.parameters[param.reported]


def _in_place(estimate: Estimate, key: str, car: Car, patched: Car) -> Estimate:
    """Return an estimate of what is added to a car's own number as one of the sum."""
    if not (car.has(key) and patched.has(key)):
        return estimate
    given, now = car.value(key), patched.value(key)
    near = _SAME_SHARE * abs(now)
    if abs(now - estimate.value) <= near or abs(now - given - estimate.value) > near:
        return estimate
    return structs.replace(
        estimate,
        value=estimate.value + given,
        low=estimate.low + given,
        high=estimate.high + given,
    )


def _times(share: Estimate, number: float) -> Estimate:
    return structs.replace(
        share, value=share.value * number, low=share.low * number, high=share.high * number
    )


def _own_terms(car: Car) -> list[Term]:
    """Return the car's effects that the library does not have."""
    return [term for term in without_further(car.terms) if term.name not in all_terms()]


def write_own_terms(car: Car, folder: Path) -> list[str]:
    """Write the file of each of the car's own effects, and return the names.

    Raises:
        CarError: when an effect was never read from a file, so that none can be written.
    """
    written = []
    for term in _own_terms(car):
        source = inspect.getsourcefile(plain(term.function))
        if source is None or Path(source).stem != term.name:
            msg = f"{term.name}: expected an effect read from its file, got one from {source}"
            raise CarError(msg)
        path, text = folder / (term.name + SUFFIX), Path(source).read_text(encoding="utf-8")
        path.write_text(text, encoding="utf-8")
        written.append(path.name)
    return written
