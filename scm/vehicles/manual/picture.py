"""The picture of an effect: the same drive with and without it, in one SVG."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.vehicles.car import Car, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.manual.line_svg import Line, draw_lines
from scm.vehicles.manual.manoeuvres import MANOEUVRES, Manoeuvre
from scm.vehicles.manual.shown import DROPPED, Shown, shown_of
from scm.vehicles.term import Term, flat

_EVERY_S = 0.01
_DEGREES = 180.0 / math.pi


@dataclass(frozen=True, slots=True)
class _Plot:
    """The plotted quantity; `dashed` is a second one of the same car."""

    title: str
    of: Callable[[Fleet], float]
    dashed: Callable[[Fleet], float] | None = None
    labels: tuple[str, str] | None = None


PLOTS: dict[str, _Plot] = {
    "path": _Plot("y [m]", lambda fleet: float(fleet.y[0])),
    "speed": _Plot("speed [m/s]", lambda fleet: float(fleet.speed[0])),
    "yaw_rate": _Plot("yaw rate [rad/s]", lambda fleet: float(fleet.yaw_rate[0])),
    "steer_angle": _Plot("wheel angle [°]", lambda f: _DEGREES * float(f.steer_angle[0])),
    "front_wheels": _Plot(
        "wheel angle [°]",
        lambda fleet: _DEGREES * float(fleet.wheel_steer[0, 0]),
        lambda fleet: _DEGREES * float(fleet.wheel_steer[0, 1]),
        ("outer, right wheel", "inner, left wheel"),
    ),
    "roll": _Plot("roll [°]", lambda fleet: _DEGREES * float(fleet.roll[0])),
    "pitch": _Plot("pitch [°]", lambda fleet: _DEGREES * float(fleet.pitch[0])),
    "height": _Plot("body height [mm]", lambda fleet: 1e3 * float(fleet.z[0])),
    "load": _Plot("front wheel load [N]", lambda fleet: float(fleet.wheel_load[0, 0])),
    "crept": _Plot("way [mm]", lambda fleet: 1e3 * float(fleet.x[0])),
}


def draw_term(term: Term) -> str:
    """Return the picture of one effect."""
    shown = shown_of(term)
    manoeuvre, plot = MANOEUVRES[shown.manoeuvre], PLOTS[shown.see]
    on_floor = shown.see == "path"
    lines = []
    for i, (car, label) in enumerate(cars_of(term, shown)):
        view = plot.dashed if plot.dashed and i == 0 else plot.of
        time, x, values = _drive(car, manoeuvre, view)
        name = plot.labels[i] if plot.labels else label
        lines.append(Line(name, x if on_floor else time, values))
    x_title = "x [m]" if on_floor else "time [s]"
    return draw_lines(lines, x_title, plot.title, equal_scale=on_floor)


def cars_of(term: Term, shown: Shown) -> tuple[tuple[Car, str], tuple[Car, str]]:
    """Return both cars of a picture with their labels: first without the effect, then with it."""
    manoeuvre = MANOEUVRES[shown.manoeuvre]
    plain = load_car(shown.car)
    given = {
        key: value
        for key, value in manoeuvre.numbers.items()
        if plain.has(key) and key not in shown.numbers
    }
    car = plain.with_terms([*shown.beside, term.name], {**given, **shown.both, **shown.numbers})
    gone = set(shown.instead)
    car = replace(car, terms=tuple(t for t in car.terms if t.name not in gone))
    if shown.other is DROPPED:
        names = {part.name for part in flat([term])}
        back = [t for t in plain.terms if t.name in gone or t.name not in names]
        beside = [n for n in shown.beside if n != term.name]
        other = replace(plain, terms=tuple(back)).with_terms(beside, {**given, **shown.both})
        return (other, f"without {term.name}"), (car, _label(term, shown.numbers, term.name))
    numbers = shown.other if shown.other is not None else neutral_numbers(term)
    label = _label(term, numbers, "nominal") if shown.other else "without"
    return (car.with_terms([], numbers), label), (car, _label(term, shown.numbers, "as it is"))


def neutral_numbers(term: Term) -> Mapping[str, float]:
    """Return the values at which an effect changes nothing, by `section.key`."""
    return {
        param.key: part.neutral[param.name]
        for part in flat([term])
        for param in part.params
        if param.name in part.neutral
    }


def _label(term: Term, numbers: Mapping[str, float], otherwise: str) -> str:
    params = {param.key: param for part in flat([term]) for param in part.params}
    known = [(params[key], number) for key, number in numbers.items() if key in params]
    if not known:
        return otherwise
    param, number = known[0]
    unit = "" if param.unit == "1" else f" {param.unit.replace('*', '·').replace('^2', '²')}"
    return f"{param.name.replace('_', ' ')} {number:g}{unit}"


def _drive(
    car: Car, manoeuvre: Manoeuvre, plot: Callable[[Fleet], float]
) -> tuple[Floats, Floats, Floats]:
    fleet = Fleet(car, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.place(0, Pose2(0.0, 0.0, 0.0), manoeuvre.speed, manoeuvre.sideways)
    if manoeuvre.floor is not None:
        manoeuvre.floor(fleet)
    every = max(_EVERY_S, manoeuvre.seconds / 600.0)
    steps = round(manoeuvre.seconds / every)
    time, x, values = np.zeros(steps + 1), np.zeros(steps + 1), np.zeros(steps + 1)
    for i in range(steps + 1):
        t = i * every
        time[i], x[i], values[i] = t, float(fleet.x[0]), plot(fleet)
        fleet.throttle[0], fleet.steering[0] = manoeuvre.throttle(t), manoeuvre.steering(t)
        fleet.advance(every)
    return time, x, values
