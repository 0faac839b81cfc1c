"""A car's terms become the text of one readable Python file.

Terms are sorted by what they read and set, ties by name, so sums keep their order. What does not
fit together is refused by name: unknown names, two setters, a missing one, a circle.
"""

from collections.abc import Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

from scm.errors import TermError, nearest
from scm.vehicles import body14, page
from scm.vehicles.layout import columns_of, slots_of
from scm.vehicles.signals import DAMPED_BY, SIGNALS, Per, Role
from scm.vehicles.term import Law, Term, reads

_FRAME = "wheel frame"  # the skeleton's own node: needs wheel_steer, gives v_long and v_lat
_FRAME_LINES = (
    "cos_steer = math.cos(wheel_steer) if wheel_steer != 0.0 else 1.0",
    "sin_steer = math.sin(wheel_steer) if wheel_steer != 0.0 else 0.0",
    "v_long = cos_steer * over_x + sin_steer * over_y",
    "v_lat = cos_steer * over_y - sin_steer * over_x",
)
_SKELETON = {param.name for param in body14.PARAMS}


def setters_of(terms: Sequence[Term]) -> dict[str, Term]:
    """Return which term sets which signal.

    Raises:
        TermError: naming every unknown name, double setter and missing setter at once.
    """
    problems: list[str] = []
    setters: dict[str, Term] = {}
    for term in terms:
        problems += _problems(term)
        if term.sets is not None:
            first = setters.setdefault(term.sets, term)
            if first is not term:
                problems.append(f"{first.name} and {term.name} both set {term.sets}")
    for signal in SIGNALS.values():
        if signal.role is Role.CHAIN and not signal.otherwise and signal.name not in setters:
            problems.append(f"no term sets {signal.name} ({signal.about})")
    if problems:
        raise TermError("; ".join(problems))
    return setters


def _problems(term: Term) -> Iterator[str]:
    own = {param.name for param in term.params}
    known = [*own, *_SKELETON, *SIGNALS]
    for law in (term.law, term.damping):
        for name in reads(law) if law else ():
            if name not in known:
                yield f"{term.name} reads {name!r}, which nothing provides{nearest(name, known)}"
            elif term.per is Per.BODY and name in SIGNALS and SIGNALS[name].per is Per.WHEEL:
                yield f"{term.name} is once a body and cannot read {name}, which each wheel has"
    target = SIGNALS.get(term.target)
    wanted = Role.SUM if term.adds else Role.CHAIN
    if target is None or target.role is not wanted or target.per is not term.per:
        names = [s.name for s in SIGNALS.values() if s.role is wanted and s.per is term.per]
        yield f"{term.name}: {term.target!r} is no such {wanted.value} of each {term.per.value}"
        yield f"expected one of {', '.join(names)}"
    elif term.damping is not None and term.target not in DAMPED_BY:
        yield f"{term.name}: nothing damps {term.target}; expected one of {', '.join(DAMPED_BY)}"


def _order(terms: Sequence[Term], per: Per, setters: dict[str, Term]) -> list[str]:
    """Return term, chain-signal and frame names of one stage in an order that can be computed."""
    graph: dict[str, set[str]] = {}
    chain = {s.name: s for s in SIGNALS.values() if s.role is Role.CHAIN and s.per is per}
    for name, signal in chain.items():
        source = setters[name].name if name in setters else signal.otherwise or ""
        graph[name] = {source} if source in chain or name in setters else set()
    for term in (t for t in terms if t.per is per):
        names = {name for law in (term.law, term.damping) if law for name in reads(law)}
        names -= {term.target} if term.keeps is not None else set()
        waits = {_FRAME if n in {"v_long", "v_lat"} else n for n in names}
        graph[term.name] = waits & {*chain, _FRAME}
    if per is Per.WHEEL:
        graph[_FRAME] = {"wheel_steer"}
    sorter = TopologicalSorter(graph)
    try:
        sorter.prepare()
    except CycleError as error:
        msg = f"effects wait for each other: {' -> '.join(error.args[1])}"
        raise TermError(msg) from error
    order: list[str] = []
    while sorter.is_active():
        ready = sorted(sorter.get_ready())
        order += ready
        sorter.done(*ready)
    return order


def _stage(terms: Sequence[Term], per: Per, setters: dict[str, Term]) -> Iterator[str]:
    slots, by_name = slots_of(terms), {term.name: term for term in terms}
    own = {c.param.key: c.variable for c in columns_of(terms)}

    def call(term: Term, law: Law) -> str:
        names = {param.name: own[param.key] for param in term.params}
        return f"{law.__name__}({', '.join(names.get(n, n) for n in reads(law))})"

    for name in _order(terms, per, setters):
        if name == _FRAME:
            yield from _FRAME_LINES
        elif name in by_name:
            term = by_name[name]
            kept = term.keeps is not None and per is Per.WHEEL
            where = f"car[{slots[term.target][0]} + w]" if kept else ""
            if kept:
                yield f"{term.target} = {where}"
            yield f"{term.target} {'+=' if term.adds else '='} {call(term, term.law)}"
            if term.damping is not None:
                yield f"{term.target}_damping += {call(term, term.damping)}"
            if kept:
                yield f"{where} = {term.target}"
        elif name not in setters:
            yield f"{name} = {SIGNALS[name].otherwise}"


def _given(terms: Sequence[Term], slots: Mapping[str, tuple[int, int]]) -> Iterator[str]:
    """Yield what the skeleton gives to those effects only that read it."""
    asked = {name for term in terms for name in reads(term.law)}
    if "drive_omega" in asked:
        spin = [f"car[{slots['wheel_speed'][0]} + {w}]" for w in range(4)]
        both = f"front_driven * ({spin[0]} + {spin[1]}) + rear_driven * ({spin[2]} + {spin[3]})"
        yield f"drive_omega = ({both}) / max(2.0 * (front_driven + rear_driven), 1.0)"


def write_page(car_name: str, terms: Sequence[Term]) -> str:
    """Return the text of a car's kernel.

    Raises:
        TermError: when the terms do not fit together; all problems in one message.
    """
    setters = setters_of(terms)
    slots = slots_of(terms)
    kept = [t.target for t in terms if t.keeps is not None and t.per is Per.BODY]
    held = [n for n, width in body14.STATES if width == 1]
    held += ["steer_angle", *(n for n in sorted(kept) if n != "steer_angle")]
    laws = sorted({(t.module, law.__name__) for t in terms for law in (t.law, t.damping) if law})
    load = [f"{c.variable} = parameters[row, {i}]" for i, c in enumerate(columns_of(terms))]
    inputs = [n for n, width in body14.INPUTS if width == 1]
    load += [f"{n} = car[{slots[n][0]}]" for n in [*held, *inputs]]
    load += [f"{n} = min(max({n}, -1.0), 1.0)" for n in ("throttle_command", "steering_command")]
    return page.PAGE.format(
        title=f"Kernel of the car {car_name!r}: {len(terms)} effects on 14 degrees of freedom.",
        imports="\n".join(f"from {module} import {law}" for module, law in laws),
        gravity=body14.GRAVITY,
        load=_indent(load, 8),
        body_terms=_indent([*_given(terms, slots), *_stage(terms, Per.BODY, setters)], 12),
        wheel_terms=_indent(_stage(terms, Per.WHEEL, setters), 16),
        store=_indent([f"car[{slots[n][0]}] = {n}" for n in held], 8),
        **{name: offset for name, (offset, _) in slots.items()},
    )


def _indent(lines: Iterator[str] | list[str], width: int) -> str:
    return "\n".join(" " * width + line for line in lines)
