"""Cases: a car, what is concealed in it, two drives, and a label sealed by its hash."""

import hashlib
import json
import math
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from tests.reality.changing import Changing
from tests.reality.concealed import (
    ALIKE,
    DEPENDENT,
    EFFECTS,
    HIDING,
    LISTED,
    PLACED,
    UNLISTED,
    Drawn,
)
from tests.reality.family import USUAL, draw_family, equations
from tests.reality.motion import Moving
from tests.reality.numbers import KEYS, SCATTER, TOGETHER, nominal, scattered
from tests.reality.recorded import Drive, record, write
from tests.reality.routes import TEMPERS
from tests.reality.sensing import FAULTS

KINDS = ("single", "none", "pair", "unlisted")
LAWS = {"unlisted": UNLISTED, "dependent": DEPENDENT, "placed": PLACED}
CONTROLS = ("shuffled", "other_car")
COURSES = ("step", "ramp", "intermittent")
"""Of one effect that changes during the drive."""
STEADY = {"clock_drift", "unit_error", "surface_patch", "motor_fade", "battery_sag"}
SHARES = (0.55, 0.15, 0.15, 0.15)
DRIVES = (("drive", 90.0), ("again", 60.0))
ENOUGH_ON_PATCH_S = 1.5
ENOUGH_AT_STOP = 0.03
ENOUGH_EACH_WAY = 0.08


def lacking(moving: type) -> frozenset[str]:
    """Return the numbers that have no place in an engine."""
    return frozenset() if moving is Moving else moving.lacks


def possible(effects, car: str, moving: type = Moving) -> list[str]:
    """Return the names of those effects that a car shows, and that an engine can simulate."""
    lacks = lacking(moving)
    rng = np.random.default_rng(0)  # which numbers an effect changes does not depend on it
    found = []
    for effect in effects:
        if car in effect.smallest:
            drawn = effect.draw(effect.smallest[car], rng, car)
            if not lacks & {*drawn.adds, *drawn.times}:
                found.append(effect.name)
    return found


def check_possible(names: tuple[str, ...], car: str, moving: type) -> None:
    """Check that an engine can simulate effects.

    Raises:
        ValueError: names what it can.
    """
    can = possible(EFFECTS.values(), car, moving)
    if cannot := [name for name in names if name not in can]:
        engine = moving.__module__.rpartition("in_")[2]
        msg = f"{engine} cannot simulate {', '.join(cannot)} of {car}; it can: {', '.join(can)}"
        raise ValueError(msg)


def names_for(
    kind: str, car: str, rng: np.random.Generator, moving: type = Moving
) -> tuple[str, ...]:
    """Draw what is concealed; half of the pairs are such as hide each other."""
    listed = possible(LISTED, car, moving)
    if kind in {"none", *CONTROLS}:
        return ()
    if kind == "single":
        return (str(rng.choice(listed)),)
    if kind in COURSES:
        return (str(rng.choice([name for name in listed if name not in STEADY])),)
    if kind in LAWS:
        return (str(rng.choice(possible(LAWS[kind], car, moving))),)
    hiding = [pair for pair in HIDING if set(pair) <= set(listed)]
    if rng.random() < 0.5:
        return hiding[rng.integers(len(hiding))]
    names = [name for name in listed if name != "unit_error"]
    pair = {str(name) for name in rng.choice(names, 2, replace=False)}
    return names_for(kind, car, rng, moving) if pair in ALIKE else tuple(sorted(pair))


def draw_effects(
    names: tuple[str, ...],
    car: str,
    strengths: tuple[float, float],
    rng: np.random.Generator,
    floor: float = 1.0,
) -> list[tuple[str, float, Drawn]]:
    """Return (name, strength, what it does) for each; sizes spread evenly over their logarithm."""
    found = []
    for name in names:
        strength = math.exp(rng.uniform(*np.log(strengths)))
        effect = EFFECTS[name]
        found.append(
            (name, strength, effect.draw(strength * effect.smallest[car], rng, car, floor))
        )
    return found


def apply(values: dict[str, float], effects: list[tuple[str, float, Drawn]]) -> dict[str, float]:
    """Return numbers with what the effects add and multiply."""
    changed = dict(values)
    for _, _, drawn in effects:
        for name, factor in drawn.times.items():
            if name in changed:
                changed[name] *= factor
        for name, more in drawn.adds.items():
            if name in changed:
                changed[name] += more
    return changed


def make_case(
    kind: str,
    rng: np.random.Generator,
    strengths: tuple[float, float] = (1.0, 4.0),
    moving: type = Moving,
    names: tuple[str, ...] | None = None,
    car: str | None = None,
    families: str = "own",
) -> tuple[dict, dict[str, Drive], dict[str, float]]:
    """Draw and drive one case; return its label, its drives by name and the car's numbers.

    The second drive has what the first one has at its end.

    Args:
        families: `own`: the usual equations and sensors; or what `draw_family` draws from.
    """
    if car is None:
        cars = [c for c in TEMPERS if all(c in EFFECTS[n].smallest for n in names or ())]
        car = str(rng.choice(cars, p=[0.7, 0.3] if len(cars) == 2 else None))
    names = names_for(kind, car, rng, moving) if names is None else names
    check_possible(names, car, moving)
    file_numbers = nominal(car)
    ordinary = scattered(file_numbers, rng) if rng.random() < 0.5 else dict(file_numbers)
    family, usual = USUAL, ordinary
    if families != "own":
        family = draw_family(families, names, rng)
        if moving is not Moving:  # another engine moves the bodies in its own way
            family = replace(family, **moving.fixed)
        usual = ordinary | equations(family, car, ordinary, rng)
    while True:
        effects = draw_effects(names, car, strengths, rng, family.floor)
        numbers, faults = apply(usual, effects), apply(FAULTS, effects)
        change = _change(kind, rng)
        drives = {}
        for number, (name, duration) in enumerate(DRIVES):
            driven, sensed = (
                _in_drive(number, *both, change) for both in ((usual, numbers), (FAULTS, faults))
            )
            drives[name] = record(car, driven, sensed, duration, rng, moving, family)
        showing = dict(drives)
        if kind == "intermittent":
            showing = {"drive": _part(drives["drive"], change[0], change[2])}
        if all(_shows(drive, numbers) for drive in showing.values()) and (
            numbers["side_gain"] == numbers["left_lag"] == 0.0 or _turns_both_ways(showing["drive"])
        ):
            break
    real = {name: v for name, v in ordinary.items() if name not in lacking(moving)}
    label = _label(kind, car, effects, file_numbers | real, file_numbers, drives["drive"])
    if change:
        label |= {"course": kind, "since_s": change[0] if kind != "ramp" else None}
        label |= {"until_s": change[2]} if kind == "intermittent" else {}
    if families != "own":
        label["family"] = asdict(family)
    return label, drives, numbers


def _change(kind: str, rng: np.random.Generator) -> tuple[float, ...] | None:
    """Draw when a change begins and ends, and when it is taken back; None: nothing changes."""
    length = DRIVES[0][1]
    if kind == "intermittent":
        since = float(rng.uniform(0.2, 0.5)) * length
        return since, since, since + float(rng.uniform(0.15, 0.4)) * length
    if kind == "step":
        since = float(rng.uniform(0.25, 0.75)) * length
        return since, since
    return (0.0, length) if kind == "ramp" else None


def _in_drive(number, before, after, change):
    """Return the numbers of the first drive, or of one that comes later."""
    if change and number == 0:
        return Changing(before, after, *change)
    return before if change and len(change) > 2 else after


def _part(drive: Drive, since: float, until: float) -> Drive:
    """Return what a drive was between two times."""
    rows, commands = (
        values[(values[:, 0] >= since) & (values[:, 0] < until)]
        for values in (drive.rows, drive.commands)
    )
    return replace(drive, rows=rows, commands=commands)


def _shows(drive: Drive, numbers: dict[str, float]) -> bool:
    """Say whether the car came to the patch or stop that it has, and stayed on the floor."""
    x, y, speed = (drive.rows[:, k] for k in (1, 2, 4))
    if not np.isfinite(drive.rows).all() or np.abs(drive.rows[:, 1:3]).max() > 12.0:
        return False
    left, right = numbers["stop_left"], numbers["stop_right"]
    if min(left, right) < 1.0:
        steering = drive.commands[:, 2]
        return float(np.mean((steering > left) | (steering < -right))) > ENOUGH_AT_STOP
    if numbers["patch_radius"] < 0.02:
        return True
    on = np.hypot(x - numbers["patch_x"], y - numbers["patch_y"]) < 0.7 * numbers["patch_radius"]
    return float(np.sum(on & (np.abs(speed) > 0.02))) * 0.0025 > ENOUGH_ON_PATCH_S


def _turns_both_ways(drive: Drive) -> bool:
    """Say whether a drive can tell a side's gain from that of the whole steering."""
    steering = drive.commands[:, 2]
    return min(float(np.mean(steering > 0.1)), float(np.mean(steering < -0.1))) > ENOUGH_EACH_WAY


def _label(kind, car, effects, ordinary, file_numbers, drive):
    return {
        **described(effects, car),
        "kind": kind,
        "ordinary": ordinary_of(ordinary, file_numbers),
        "span": drive.span,
        "vmax": drive.fastest,
        "route": drive.shape,
    }


def ordinary_of(numbers: dict[str, float], file_numbers: dict[str, float]) -> dict[str, float]:
    """Return the numbers in which a car differs from its file, by the file's keys."""
    moved = [name for name in (*SCATTER, *TOGETHER) if numbers[name] != file_numbers[name]]
    return {KEYS[name]: numbers[name] for name in moved}


def described(effects: list[tuple[str, float, Drawn]], car: str) -> dict:
    """Return what a label says of effects."""
    known = [EFFECTS[name] for name, _, _ in effects]
    return {
        "case": "+".join(effect.name for effect in known) or "nothing",
        "names": [effect.name for effect in known],
        "car": car,
        "equation": "+".join(effect.equation for effect in known),
        "or_equation": [other for effect in known for other in effect.or_equation],
        "depends_on": [word for effect in known for word in effect.depends_on],
        "or_depends_on": [word for effect in known for word in effect.or_depends_on],
        "parameters": [drawn.parameters for _, _, drawn in effects],
        "strength": [strength for _, strength, _ in effects],
        "law": "; ".join(drawn.law for _, _, drawn in effects if drawn.law),
        "listed": bool(known) and all(effect.listed for effect in known),
    }


def seal(label: dict, salt: str) -> str:
    """Return the hash that commits to a label without giving it away."""
    text = json.dumps({"salt": salt, "label": label}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def write_label(out: Path, name: str, label: dict, rng: np.random.Generator) -> str:
    """Write the label of a case with a salt; return its seal."""
    salt = rng.bytes(16).hex()
    labels = out / "labels"
    labels.mkdir(exist_ok=True)
    text = json.dumps({"salt": salt, "label": label}, sort_keys=True, indent=1)
    (labels / f"{name}.json").write_text(text + "\n", encoding="utf-8")
    return seal(label, salt)


def write_cases(
    out: Path,
    seed: int,
    kinds: list[str],
    strengths: tuple[float, float] = (1.0, 4.0),
    moving: type = Moving,
    say=lambda _line: None,
    families: str = "own",
) -> None:
    """Write every case's recordings, its label, and `sealed.txt` with one hash a case.

    Each case has randomness of its own, so that a case is the same however many there are.
    """
    out.mkdir(parents=True, exist_ok=True)
    sealed = []
    for k, kind in enumerate(kinds):
        rng = np.random.default_rng([seed, k])
        label, drives, numbers = make_case(kind, rng, strengths, moving, families=families)
        drives, stated_car = _controlled(kind, label["car"], drives, rng, moving, families)
        name = f"case_{k:03d}"
        for drive_name, drive in drives.items():
            write(drive, stated_car, numbers, out / name / drive_name, moving)
        sealed.append(f"{write_label(out, name, label, rng)}  {name}")
        say(f"{k + 1} of {len(kinds)}")
    (out / "sealed.txt").write_text("\n".join(sealed) + "\n", encoding="utf-8")


def _controlled(kind, car, drives, rng, moving, families):
    """Return drives, and the car that the recording names, of cases that fit no car at all."""
    if kind == "shuffled":
        _, others, _ = make_case("none", rng, moving=moving, car=car, families=families)
        drives = {
            name: replace(drive, commands=others[name].commands) for name, drive in drives.items()
        }
    others = [other for other in TEMPERS if other != car]
    return drives, others[0] if kind == "other_car" else car


def draw_kinds(kind: str, count: int, seed: int) -> list[str]:
    """Return the kind of every case; `mixed` draws them, in an order that tells nothing."""
    if kind != "mixed":
        return [kind] * count
    rng = np.random.default_rng([seed, 1_000_003])
    return [str(k) for k in rng.choice(KINDS, count, p=SHARES)]
