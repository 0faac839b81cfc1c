"""All effects as text, `scm show terms`: one line each, or one in full."""

from collections.abc import Iterator, Sequence

from scm.errors import TermError, nearest
from scm.vehicles.car import all_terms
from scm.vehicles.param import Param
from scm.vehicles.physics_variables import VARIABLES
from scm.vehicles.sensor_fault import SensorFault, all_sensor_faults
from scm.vehicles.term import Term, flat, reads

Effect = Term | SensorFault
OTHERS = "Others"
CHAPTERS: tuple[tuple[str, frozenset[str]], ...] = (
    ("Throttle and motors", frozenset({
        "throttle_received", "throttle_limited", "throttle_live", "throttle_eased",
        "throttle_curved", "throttle_scaled", "throttle", "motor_throttle", "fade_strength",
        "warm_strength", "motor_strength", "motor_heat", "wheel_torque", "extra_inertia"})),
    ("Battery", frozenset({
        "charge_drawn", "open_circuit_voltage", "terminal_voltage", "supply_voltage"})),
    ("Steering", frozenset({
        "steering_received", "steering", "steer_demand", "steer_scaled", "steer_target",
        "servo_load_pace", "servo_pace", "servo_angle", "linkage_angle", "steer_trimmed",
        "steer_yielded", "steer_angle", "road_angle", "wheel_steer", "wheel_slope"})),
    ("Tyres and floor", frozenset({
        "tyre_x", "tyre_y", "grip_load", "grip_here", "grip", "rolling", "slip_scale", "side_lag",
        "side_lag_speed", "spin_lag", "spin_lag_speed"})),
    ("Friction that holds and brakes", frozenset({"dry_torque"})),
    ("Body", frozenset({
        "force_x", "force_y", "moment_z", "added_mass", "added_cog_x", "added_cog_z"})),
    ("Suspension", frozenset({"suspension_force", "load"})),
)  # fmt: skip


def chapter_of(term: Term) -> str:
    """Return the heading of an effect."""
    return next((title for title, targets in CHAPTERS if term.target in targets), OTHERS)


def all_effects() -> dict[str, Effect]:
    """Return every physical effect, then every sensor fault, by name."""
    return {**all_terms(), **all_sensor_faults()}


def effect_named(name: str) -> Effect:
    """Return one effect.

    Raises:
        TermError: when there is none of this name.
    """
    known = all_effects()
    if name not in known:
        msg = f"no effect {name!r}{nearest(name, list(known))}; `scm show terms` lists them"
        raise TermError(msg)
    return known[name]


def list_effects() -> str:
    """Return a line for each effect, grouped by what it acts on."""
    terms, faults = list(all_terms().values()), list(all_sensor_faults().values())
    width = max(len(name) for name in all_effects())
    lines = [f"{len(terms)} effects on a car, {len(faults)} sensor faults; "
             "`scm show terms NAME` shows one in full"]  # fmt: skip
    for title in [*(title for title, _ in CHAPTERS), OTHERS]:
        chosen = [term for term in terms if chapter_of(term) == title]
        lines += ["", title, *_lines(chosen, width)] if chosen else []
    lines += ["", "Sensor faults", *_lines(faults, width)]
    return "\n".join(lines)


def describe_term(name: str) -> str:
    """Return one effect in full: equation, numbers, range, visible manoeuvres, source.

    Raises:
        TermError: when there is none of this name.
    """
    effect = effect_named(name)
    lines = [name, "=" * len(name), effect.about, ""]
    lines += [f"    {line}" for line in effect.equation.split("; ")]
    lines += [""]
    for heading in ("Holds", "Shows in", "Source"):
        lines.append(f"{heading + ':':<10} {effect.doc_line(heading)}")
    if isinstance(effect, Term):
        lines += [f"{'Reads:':<10} {_reads(effect)}", f"{'Acts on:':<10} {_acts_on(effect)}"]
    lines += ["", *_table(params_of(effect), neutral_of(effect))]
    return "\n".join(lines)


def params_of(effect: Effect) -> list[Param]:
    """Return the numbers of an effect, each once."""
    found = effect.params if isinstance(effect, SensorFault) else _of_term(effect)
    return list({param.key: param for param in found}.values())


def _of_term(term: Term) -> Iterator[Param]:
    yield from (param for part in flat([term]) for param in part.params)


def neutral_of(effect: Effect) -> dict[str, float]:
    """Return the values at which an effect does nothing, by parameter name."""
    parts = flat([effect]) if isinstance(effect, Term) else (effect,)
    return {name: value for part in parts for name, value in part.neutral.items()}


def _lines(effects: Sequence[Effect], width: int) -> Iterator[str]:
    yield from (f"  {effect.name:<{width}}  {effect.about}" for effect in effects)


def _reads(term: Term) -> str:
    functions = [f for part in flat([term]) for f in (part.function, part.damping) if f]
    names = dict.fromkeys(name for f in functions for name in reads(f) if name in VARIABLES)
    return ", ".join(names) or "only its own numbers"


def _acts_on(term: Term) -> str:
    return "; ".join(f"{t.target} ({VARIABLES[t.target].about})" for t in flat([term]))


def _table(params: Sequence[Param], neutral: dict[str, float]) -> Iterator[str]:
    if not params:
        yield "It has no numbers of its own."
        return
    rows = [("key in a car file", "default", "unit", "bounds", "neutral", "meaning")]
    for param in params:
        low, high = param.bounds
        nothing = f"{neutral[param.name]:g}" if param.name in neutral else ""
        unit = "" if param.unit == "1" else param.unit
        rows.append((param.key, f"{param.default:g}", unit, f"{low:g} to {high:g}", nothing,
                     param.about))  # fmt: skip
    widths = [max(len(row[i]) for row in rows) for i in range(5)]
    for row in rows:
        cells = [f"{cell:<{width}}" for cell, width in zip(row[:5], widths, strict=True)]
        yield "  ".join([*cells, row[5]]).rstrip()
