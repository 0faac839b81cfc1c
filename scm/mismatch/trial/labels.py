"""Labels: what was concealed in each case, and the seals that show nobody changed them since."""

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scm.errors import RecordingError
from scm.mismatch.effect_catalogue import params_of

SEALED = "sealed.txt"
CONTROLS = ("shuffled", "other_car")
COURSES = ("step", "ramp", "intermittent")


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """What was concealed in one case.

    Attributes:
        kind: `single`, `none`, `pair`, `unlisted`; a single effect that changes: `step`, `ramp`
            or `intermittent`; or a control: `shuffled` commands of another drive, or the file of an
            `other_car`.
        names: Of the effects.
        parameters: Of each effect, by public name.
        equations: That are a right answer for a law outside the library.
        needs: Variables it depends on; `allows` are as good, or harmless beside them.
        strength: Of each effect, in multiples of what can be shown at all; empty: not known.
        nominal: Numbers in which this car differs from its file, by car file key.
        since_s: When a step was, on the recording's clock, or the effect came.
        until_s: When it went again; None: it stayed.
        family: Value of each aspect in which the case's equations and sensors were drawn.
    """

    case: str
    kind: str
    names: tuple[str, ...]
    car: str
    parameters: tuple[Mapping[str, float], ...]
    equations: frozenset[str]
    needs: frozenset[str]
    allows: frozenset[str] = frozenset()
    strength: tuple[float, ...] = ()
    nominal: Mapping[str, float] = field(default_factory=dict)
    since_s: float | None = None
    until_s: float | None = None
    family: Mapping[str, str | float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Case:
    """Where one case lies: its recording for diagnosis, and another drive of the same car."""

    name: str
    drive: Path
    again: Path


def find_cases(folder: Path, only: Collection[str] = ()) -> list[Case]:
    """Return the cases of a folder in order; `only` names some by number, `00` or `case_00`.

    Raises:
        RecordingError: when there are none, or one that was asked for is missing.
    """
    found = {
        path.name: Case(path.name, path / "drive", path / "again")
        for path in sorted(folder.glob("case_*"))
        if (path / "drive" / "recording.yaml").is_file()
    }
    wanted = [name if name.startswith("case_") else f"case_{name}" for name in only]
    missing = [name for name in wanted if name not in found]
    if missing or not found:
        what = ", ".join(missing) or "case_*/drive/recording.yaml"
        msg = f"{folder}: no {what}; there are {len(found)} cases"
        raise RecordingError(msg)
    return [found[name] for name in wanted] if wanted else list(found.values())


def read_seals(folder: Path) -> dict[str, str]:
    """Return the hash of every case's label as it was committed to."""
    lines = (folder / SEALED).read_text(encoding="utf-8").split("\n")
    pairs = [line.split() for line in lines if line]
    return {name: digest for digest, name in pairs}


def open_label(folder: Path, case: str, digest: str) -> Label:
    """Read one label and check it against its seal.

    Raises:
        RecordingError: when it is not the label that was sealed.
    """
    return label_of(case, opened(folder, case, digest))


def opened(folder: Path, case: str, digest: str) -> Mapping[str, Any]:
    """Read the fields of one label and check them against its seal.

    Raises:
        RecordingError: when it is not the label that was sealed.
    """
    path = folder / "labels" / f"{case}.json"
    held = json.loads(path.read_text(encoding="utf-8"))
    text = json.dumps({"salt": held["salt"], "label": held["label"]}, sort_keys=True)
    got = hashlib.sha256(text.encode()).hexdigest()
    if got != digest:
        msg = f"{path}: not what was sealed: expected SHA-256 {digest}, got {got}"
        raise RecordingError(msg)
    fields: Mapping[str, Any] = held["label"]
    return fields


def label_of(case: str, fields: Mapping[str, Any]) -> Label:
    """Return a label of a parsed one, of ours or of the shipped trials."""
    names = tuple(fields["names"])
    given = fields["parameters"]
    parameters = tuple(given) if isinstance(given, Sequence) else _shared_out(names, given)
    return Label(
        case=case,
        kind=fields["kind"]
        if fields.get("kind") in (*CONTROLS, *COURSES)
        else _kind(names, is_known=fields["listed"]),
        names=names,
        car=fields["car"],
        parameters=parameters,
        equations=frozenset((*fields["equation"].split("+"), *fields.get("or_equation", ()))),
        needs=frozenset(fields["depends_on"]),
        allows=frozenset(fields.get("or_depends_on", ())),
        strength=tuple(fields.get("strength", ())),
        nominal=fields.get("ordinary", {}),
        since_s=fields.get("since_s"),
        until_s=fields.get("until_s"),
        family=fields.get("family", {}),
    )


def _kind(names: tuple[str, ...], *, is_known: bool) -> str:
    if not names:
        return "none"
    if not is_known:
        return "unlisted"
    return "pair" if len(names) > 1 else "single"


def _shared_out(
    names: tuple[str, ...], given: Mapping[str, float]
) -> tuple[Mapping[str, float], ...]:
    """Give each of several effects the parameters that the library says are its own."""
    if len(names) < 2:
        return (given,) if names else ()
    return tuple(
        {key: value for key, value in given.items() if key in params_of(name)[0]} for name in names
    )


def shipped_labels(path: Path) -> dict[str, Label]:
    """Return the labels of trials that came as one file, by case."""
    fields = json.loads(path.read_text(encoding="utf-8"))
    return {case: label_of(case, entry) for case, entry in fields.items()}
