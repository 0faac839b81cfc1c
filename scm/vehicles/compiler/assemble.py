"""A car's terms become the text of one readable Python file.

Terms are sorted by what they read and set, ties by name, so sums keep their order. What does not
fit together is refused by name: unknown names, two setters, a missing one, a circle.
"""

import ast
from collections.abc import Iterator, Sequence
from graphlib import CycleError, TopologicalSorter

from scm.errors import TermError, nearest
from scm.vehicles import body14, lane_math, substep
from scm.vehicles.command_delay import COMMANDS
from scm.vehicles.compiler.inline import Functions, Inliner, Line
from scm.vehicles.compiler.print_plain import print_plain
from scm.vehicles.compiler.print_tiles import print_tiles
from scm.vehicles.compiler.program import Program, Stage
from scm.vehicles.layout import columns_of, rows_of, states_of
from scm.vehicles.physics_variables import DAMPED_BY, VARIABLES, Per, Role
from scm.vehicles.term import Function, Term, reads

# the skeleton's own steps between the terms: what each gives, needs and says
_NODES = {
    Per.BODY: {"road_slope": ("road_angle", substep.ROAD)},
    Per.WHEEL: {"frame": ("wheel_slope", substep.FRAME)},
}
_FROM_FRAME = {"v_long": "frame", "v_lat": "frame"}
_SKELETON = {param.name for param in body14.PARAMS}


def setters_of(terms: Sequence[Term]) -> dict[str, Term]:
    """Return which term sets which variable.

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
    for variable in VARIABLES.values():
        if variable.role is Role.CHAIN and not variable.otherwise and variable.name not in setters:
            problems.append(f"no term sets {variable.name} ({variable.about})")
    if problems:
        raise TermError("; ".join(problems))
    return setters


def _problems(term: Term) -> Iterator[str]:
    own = {param.name for param in term.params}
    known = [*own, *_SKELETON, *VARIABLES]
    for function in (term.function, term.damping):
        for name in reads(function) if function else ():
            if name not in known:
                yield f"{term.name} reads {name!r}, which nothing provides{nearest(name, known)}"
            elif term.per is Per.BODY and name in VARIABLES and VARIABLES[name].per is Per.WHEEL:
                yield f"{term.name} is once a body and cannot read {name}, which each wheel has"
    target = VARIABLES.get(term.target)
    wanted = (Role.SUM, Role.SHAPE) if term.adds else (Role.CHAIN,)
    if target is None or target.role not in wanted or target.per is not term.per:
        names = [
            variable.name
            for role in wanted
            for variable in VARIABLES.values()
            if variable.role is role and variable.per is term.per
        ]
        yield f"{term.name}: {term.target!r} is no such {wanted[0].value} of each {term.per.value}"
        yield f"expected one of {', '.join(names)}"
    elif term.damping is not None and term.target not in DAMPED_BY:
        yield f"{term.name}: nothing damps {term.target}; expected one of {', '.join(DAMPED_BY)}"


def _order(terms: Sequence[Term], per: Per, setters: dict[str, Term]) -> list[str]:
    """Return a stage's terms, chain variables and own steps in an order that can be computed."""
    graph: dict[str, set[str]] = {}
    chain = {s.name: s for s in VARIABLES.values() if s.role is Role.CHAIN and s.per is per}
    for name, variable in chain.items():
        source = setters[name].name if name in setters else variable.otherwise or ""
        known = source in chain or source in _NODES[per] or name in setters
        graph[name] = {source} if known else set()
    for term in _running(terms, per):
        names = {
            name
            for function in (term.function, term.damping)
            if function
            for name in reads(function)
        }
        names -= {term.target} if term.keeps is not None else set()
        graph[term.name] = {_FROM_FRAME.get(n, n) for n in names} & {*chain, *_NODES[per]}
    for name, (needs, _) in _NODES[per].items():
        graph[name] = {needs}
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


def _running(terms: Sequence[Term], per: Per) -> list[Term]:
    """Return the terms of a stage that act in every substep."""
    shapes = {variable.name for variable in VARIABLES.values() if variable.role is Role.SHAPE}
    return [term for term in terms if term.per is per and term.target not in shapes]


class _Writer:
    """Writes a car's stages: the skeleton's text with the terms' functions in its gaps."""

    def __init__(self, terms: Sequence[Term]) -> None:
        self.terms, self.setters = terms, setters_of(terms)
        self.own = {c.param.key: c.variable for c in columns_of(terms)}
        self.names = {t.name: f"{t.name}_" if t.name in VARIABLES else t.name for t in terms}
        own = (f"{name}{end}" for name in self.names.values() for end in ("", "_damping"))
        self.term_lines: set[str] = set()
        self.inliner = Inliner({*VARIABLES, *substep.NAMES, *self.own.values(), *own})
        self.scope: Functions = {**vars(body14), **vars(lane_math)}

    def text(self, text: str) -> list[Line]:
        return list(self.inliner.lines(text, self.scope))

    def value(self, term: Term, function: Function, name: str) -> list[Line]:
        """Write one function of a term; its value gets this name."""
        names = {param.name: self.own[param.key] for param in term.params}
        arguments: list[ast.expr] = [ast.Name(names.get(n, n)) for n in reads(function)]
        *before, (_, value) = self.inliner.call(function, arguments)
        lines = [*before, (name, value)]
        self.term_lines.update(name for name, _ in lines)
        return lines

    def sums(self, terms: Sequence[Term], role: Role, per: Per) -> list[Line]:
        """Write every sum of a role as its terms' values, one after the other."""
        lines: list[Line] = []
        damps = role is Role.SUM
        self.term_lines.update(DAMPED_BY, (f"{name}_damping" for name in DAMPED_BY))
        for variable in VARIABLES.values():
            if variable.role is role and variable.per is per:
                mine = sorted((t for t in terms if t.adds == variable.name), key=lambda t: t.name)
                damped = [f"{term.name}_damping" for term in mine if term.damping]
                lines += self.text(f"{variable.name} = {_sum([self.names[t.name] for t in mine])}")
                lines += self.text(f"{variable.name}_damping = {_sum(damped)}" if damps else "")
        return lines

    def stage(self, per: Per) -> list[Line]:
        """Write the effects of one stage in an order that can be computed."""
        terms = _running(self.terms, per)
        by_name = {term.name: term for term in terms}
        lines: list[Line] = []
        for name in _order(self.terms, per, self.setters):
            if name in _NODES[per]:
                lines += self.text(_NODES[per][name][1])
            elif name in by_name:
                term = by_name[name]
                lines += self.value(term, term.function, term.sets or self.names[name])
                if term.damping is not None:
                    lines += self.value(term, term.damping, f"{term.name}_damping")
            elif name not in self.setters:
                lines += self.text(f"{name} = {VARIABLES[name].otherwise}")
        for name in (n for n in DAMPED_BY if n in self.setters and VARIABLES[n].per is per):
            damped = self.setters[name].damping is not None
            value = f"{self.setters[name].name}_damping" if damped else "0.0"
            lines += self.text(f"{name}_damping = {value}")
        return [*lines, *self.sums(terms, Role.SUM, per)]

    def start(self) -> list[Line]:
        """Write what happens once a call: commands are clipped, the car's numbers added up."""
        shaping = [term for term in self.terms if VARIABLES[term.target].role is Role.SHAPE]
        lines = [line for t in shaping for line in self.value(t, t.function, self.names[t.name])]
        return [*lines, *self.sums(shaping, Role.SHAPE, Per.BODY), *self.text(substep.START)]


def _sum(names: Sequence[str]) -> str:
    return " + ".join(names) or "0.0"


def write_program(terms: Sequence[Term]) -> Program:
    """Return a car's substep, ready to be printed.

    Raises:
        TermError: when the terms do not fit together; all problems in one message.
    """
    write = _Writer(terms)
    body, wheel, solve, roll, close, end, end_wheel = (
        Stage("effects on the body", Per.BODY, [*write.text(substep.BODY), *write.stage(Per.BODY)]),
        Stage(
            "effects on each wheel",
            Per.WHEEL,
            [
                *write.text(substep.WHEEL),
                *write.stage(Per.WHEEL),
                *write.text(substep.ELIMINATE),
            ],
        ),
        Stage("one implicit step of the whole car", Per.BODY, write.text(substep.SOLVE)),
        Stage("what it does to each wheel", Per.WHEEL, write.text(substep.ROLL)),
        Stage("whether it still drives", Per.BODY, write.text(substep.CLOSE)),
        Stage("what others read of the car", Per.BODY, write.text(substep.FINISH)),
        Stage("what others read of each wheel", Per.WHEEL, write.text(substep.FINISH_WHEEL)),
    )
    constant = dict.fromkeys([c.variable for c in columns_of(terms)], Per.BODY) | {"dt": Per.BODY}
    persistent = {"verdict"}
    for per in Per:
        constant |= dict.fromkeys(body14.INPUTS[per], per)
        persistent |= {*states_of(terms, per), *body14.OUTPUTS[per]}
    constant |= {"front": Per.WHEEL, "side": Per.WHEEL}
    program = Program(
        [Stage("commands and numbers", Per.BODY, write.start())],
        [body, wheel, solve, roll],
        [close],
        [end, end_wheel],
        constant,
        {name for per in Per for name in body14.INPUTS[per]},
        persistent,
        write.term_lines,
    )
    program.simplify()
    return program


def write_page(terms: Sequence[Term], *, plain: bool = False) -> str:
    """Return the text of a car's kernel; `plain` goes car by car instead of tile by tile.

    It names no car: those with the same effects share one compiled kernel.

    Raises:
        TermError: when the terms do not fit together; all problems in one message.
    """
    title = f"Kernel of a car: {len(terms)} effects on 14 degrees of freedom."
    program, block_rows = write_program(terms), rows_of(terms)
    columns = [column.variable for column in columns_of(terms)]
    if plain:
        return print_plain(title, program, block_rows, columns)
    program.part_axles()
    program.part_commands(COMMANDS)
    return print_tiles(title, program, block_rows, columns)
