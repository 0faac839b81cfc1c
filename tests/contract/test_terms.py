"""Every physical effect keeps its contract: wiring, documents, finite, passive, neutral."""

import inspect
import math
import random
from pathlib import Path

import pytest

from scm.vehicles import body14
from scm.vehicles.car import all_terms
from scm.vehicles.jit import plain
from scm.vehicles.layout import columns_of
from scm.vehicles.physics_variables import VARIABLES
from scm.vehicles.term import flat, reads

FILES = all_terms()
TERMS = {term.name: term for term in flat(FILES.values())}
RATES = {"vx", "vy", "yaw_rate", "omega", "v_long", "v_lat", "compression_rate", "wheel_radius"}
DRAWS = 300  # situations a term is tried in

# Power that a term's value gives the car, by what it adds to; never positive of a passive one.
POWER = {
    "force_x": lambda value, s: value * s["vx"],
    "force_y": lambda value, s: value * s["vy"],
    "moment_z": lambda value, s: value * s["yaw_rate"],
    "wheel_torque": lambda value, s: value * s["omega"],
    "tyre_x": lambda value, s: value * (s["v_long"] - s["wheel_radius"] * s["omega"]),
    "tyre_y": lambda value, s: value * s["v_lat"],
    "suspension_force": lambda value, s: -value * s["compression_rate"],
    "dry_torque": lambda value, s: -value,
    "extra_inertia": lambda value, s: -value,
}


def somewhere(draw, low, high):
    """Draw a number: mostly anywhere in its span, else an end of it, zero, or almost zero."""
    kind = draw.random()
    if kind < 0.7:
        return draw.uniform(low, high)
    if kind < 0.85:
        return draw.choice((low, high, min(max(0.0, low), high)))
    tiny = draw.choice((-1.0, 1.0)) * 10.0 ** draw.uniform(-15.0, -1.0)
    return min(max(tiny, low), high)


def situations(term):
    """Draw every variable in its physical span and every parameter inside its bounds."""
    needed = {n for law in (term.function, term.damping) if law for n in reads(law)} | RATES
    if term.sets:
        needed.add(otherwise_of(term))
    spans = {name: variable.span for name, variable in VARIABLES.items()}
    spans |= {param.name: param.bounds for param in (*body14.PARAMS, *term.params)}
    spans |= {name: (float(name), float(name)) for name in ("0.0", "1.0")}
    draw = random.Random(term.name)
    for _ in range(DRAWS):
        yield {name: somewhere(draw, *spans[name]) for name in sorted(needed)}


def otherwise_of(term):
    """What the term's variable would be without it: a variable, else a number, else itself."""
    return VARIABLES[term.target].otherwise or term.target


def undisturbed(values):
    """Still air, bare floor, tyres without memory: nothing but the effect itself acts."""
    calm = {"air_x", "air_y", "rolling", "floor_rolling", "side_lag_speed", "spin_lag_speed"}
    return values | dict.fromkeys(values.keys() & calm, 0.0)


def call(law, values):
    return plain(law)(**{name: values[name] for name in reads(law)})


@pytest.mark.parametrize("name", FILES)
def test_the_law_is_named_like_its_file(name):
    assert FILES[name].name == name
    for term in flat([FILES[name]]):
        assert term.module == f"scm.vehicles.terms.{name}"
        assert term.name.startswith(name)


@pytest.mark.parametrize("name", TERMS)
def test_the_file_states_equation_range_manoeuvre_and_source(name):
    term = TERMS[name]
    assert term.about.endswith(".")
    assert "=" in term.equation
    assert term.target in term.equation or "tan(" in term.equation
    for heading in ("Holds", "Shows in", "Source"):
        assert len(term.doc_line(heading)) > 5, heading
    assert term.shows_in
    file = Path(inspect.getfile(plain(term.function)))
    longest = 130 if FILES[file.stem].also else 70
    assert len(file.read_text(encoding="utf-8").splitlines()) <= longest


@pytest.mark.parametrize("name", TERMS)
def test_parameters_have_unit_meaning_and_a_default_inside_their_bounds(name):
    for param in TERMS[name].params:
        low, high = param.bounds
        assert low <= param.default <= high
        assert param.unit
        assert len(param.about) >= 5
        section, _, key = param.key.partition(".")
        assert section.isidentifier()
        assert key.isidentifier()


def test_a_key_means_the_same_in_every_term():
    seen = {}
    for term in TERMS.values():
        for param in term.params:
            first = seen.setdefault(param.key, param)
            assert (param.unit, param.bounds) == (first.unit, first.bounds)


@pytest.mark.parametrize("name", TERMS)
def test_every_parameter_is_read_by_its_law(name):
    term = TERMS[name]
    names = {n for law in (term.function, term.damping) if law for n in reads(law)}
    delays = {"drive.delay_s", "steering.delay_s"}  # read by whoever keeps the commands
    assert {param.name for param in term.params if param.key not in delays} <= names


@pytest.mark.parametrize("name", TERMS)
def test_laws_are_finite_and_never_negatively_damped(name):
    term = TERMS[name]
    for values in situations(term):
        assert math.isfinite(call(term.function, values)), values
        if term.damping is not None:
            damping = call(term.damping, values)
            assert math.isfinite(damping), values
            assert damping >= 0.0, values


@pytest.mark.parametrize("name", [name for name, term in TERMS.items() if term.passive])
def test_passive_terms_never_give_energy(name):
    term = TERMS[name]
    for values in map(undisturbed, situations(term)):
        assert POWER[term.target](call(term.function, values), values) <= 1e-12, values


@pytest.mark.parametrize("name", [name for name, term in TERMS.items() if term.neutral])
def test_a_neutral_term_does_nothing(name):
    term = TERMS[name]
    otherwise = otherwise_of(term)
    for drawn in situations(term):
        values = undisturbed(drawn) | dict(term.neutral)
        if otherwise in values and term.keeps is not None and otherwise[0].isdigit():
            values[term.target] = float(otherwise)  # such a state starts there, and must stay
        for past in ("throttle_past", "steering_past"):
            values[past] = values.get(past.replace("past", "command"), 0.0)  # no delay, no past
        value = call(term.function, values)
        if term.adds:
            assert value == 0.0, values
            assert term.damping is None or call(term.damping, values) == 0.0, values
        else:
            assert value == values[otherwise], values


@pytest.mark.parametrize("name", TERMS)
def test_neutral_values_lie_inside_the_bounds(name):
    term = TERMS[name]
    bounds = {param.name: param.bounds for param in term.params}
    for param, value in term.neutral.items():
        low, high = bounds[param]
        assert low <= value <= high


def test_all_terms_together_have_one_column_for_each_key():
    columns = columns_of(list(TERMS.values()))
    assert len({column.name for column in columns}) == len(columns)
    assert len({column.variable for column in columns}) == len(columns)
    assert not {column.variable for column in columns} & set(VARIABLES)
