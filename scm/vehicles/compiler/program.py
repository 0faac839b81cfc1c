"""A substep as stages of lines, and what can be by_text of them before they run.

Whatever depends only on a car's numbers, on what is constant during a call and on the wheel's place
is worked out once a call; a division by such a thing becomes a multiplication. Lines that say the
same are merged, lines that nobody reads are dropped. All of it is exact but for the reciprocals.
"""

import ast
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import cast

from scm.vehicles.compiler.axles import AXLES, Known, fold_body, number_of
from scm.vehicles.compiler.inline import Line
from scm.vehicles.physics_variables import Per


@dataclass(slots=True)
class Stage:
    """Lines that run together, once a car or once a wheel, of those in `wheels`."""

    name: str
    per: Per
    lines: list[Line]
    wheels: range = range(4)

    @property
    def reads(self) -> list[str]:
        """Names that come from outside this stage, in order."""
        found: dict[str, None] = {}
        known: set[str] = set()
        for name, value in self.lines:
            found |= dict.fromkeys(n for n in leaves(value) if n not in known)
            known.add(name)
        return list(found)

    @property
    def sets(self) -> list[str]:
        """Names that this stage gives a value, in order."""
        return list(dict.fromkeys(name for name, _ in self.lines))


@dataclass(slots=True)
class Program:
    """One call of the kernel: `once` stages, `substep` stages again and again, `close`, `end`.

    Attributes:
        close: Brings the states into range and finds whether the car still drives.
        end: What others read of it: nothing of the next call.
        commanded: Taken out of `once`: what follows from the commands.
        constant: Names that hold still during a call, with what each belongs to.
        inputs: Those of them that come from outside, as commands do.
        persistent: Names that outlive a substep: states and results.
        term_lines: Names of the lines of terms: each of their operations is rounded by itself, so
            that a term which does nothing changes nothing. In the skeleton's lines a product may be
            rounded together with the sum it goes into.
    """

    once: list[Stage]
    substep: list[Stage]
    close: list[Stage]
    end: list[Stage]
    constant: dict[str, Per]
    inputs: set[str]
    persistent: set[str]
    term_lines: set[str]
    prepared: dict[Per, list[Line]] = field(default_factory=lambda: {Per.BODY: [], Per.WHEEL: []})
    commanded: list[Stage] = field(default_factory=list)

    def simplify(self) -> None:
        """Bring the program into the form that is printed."""
        _Tidy(self.persistent | set(self.constant), self._counts()).run(self._stages())
        numbers = self._numbers()
        for stage in self._stages():
            stage.lines = list(_without_divisions(stage.lines, numbers))
        self._part_constants()
        self._drop_unread()
        self.once += [
            Stage(f"constant for each {per.value}", per, lines)
            for per, lines in self.prepared.items()
        ]

    def _stages(self) -> list[Stage]:
        return [*self.substep, *self.close, *self.end]

    def _counts(self) -> Counter[str]:
        return Counter(name for stage in self._stages() for name, _ in stage.lines)

    def _numbers(self) -> set[str]:
        """Return the names that depend on the car's numbers and the wheel's place alone."""
        counts, numbers = self._counts(), set(self.constant) - self.inputs
        for stage in self._stages():
            for name, value in stage.lines:
                if (
                    counts[name] == 1
                    and name not in self.persistent
                    and set(leaves(value)) <= numbers
                ):
                    numbers.add(name)
        return numbers

    def _part_constants(self) -> None:
        counts = self._counts()
        made: dict[str, str] = {}
        for stage in self._stages():
            live: list[Line] = []
            for name, value in stage.lines:
                hoist = _Hoist(name, self.constant, self.prepared, made)
                if counts[name] == 1 and name not in self.persistent and hoist.is_constant(value):
                    hoist.keep(name, value)
                else:
                    live.append((name, cast("ast.expr", hoist.visit(value))))
            stage.lines = live

    def part_axles(self) -> None:
        """Give front and rear wheels stages of their own; after simplifying."""
        stored = self.persistent.union(*(stage.reads for stage in self.end))
        axles = [Known(axle, self._counts(), stored) for axle in AXLES]
        for known in axles:
            known.fold(self.prepared[Per.WHEEL])
        parted: list[Stage] = []
        for stage in self.substep:
            if stage.per is Per.BODY:
                for known in axles:
                    stage.lines = fold_body(stage.lines, known.seen_from_the_body())
                parted.append(stage)
                continue
            for known in axles:
                name = stage.name.replace("each wheel", f"each {known.axle.name} wheel")
                wheels = range(known.axle.first, known.axle.stop)
                parted.append(Stage(name, stage.per, known.fold(stage.lines), wheels))
        self.substep[:] = parted
        for stage in self.substep:
            others = (other.reads for other in self._stages() if other is not stage)
            _drop_unneeded(stage.lines, self.persistent.union(*others))
        self._drop_unread()

    def part_commands(self, commands: Iterable[str]) -> None:
        """Part what follows from the commands from what only the car's numbers say; at the end."""
        changing = set(commands)
        for stage in self.once:
            lines, stage.lines = stage.lines, []
            later = Stage(f"{stage.name} as commanded", stage.per, [])
            for name, value in lines:
                follows = not changing.isdisjoint((name, *leaves(value)))
                changing |= {name} if follows else set()
                (later if follows else stage).lines.append((name, value))
            self.commanded.append(later)

    def _drop_unread(self) -> None:
        needed, before = set(self.persistent), -1
        groups = [*(stage.lines for stage in self._stages()), *self.prepared.values()]
        reads = [(name, set(leaves(value))) for lines in groups for name, value in lines]
        while len(needed) != before:
            before = len(needed)
            for name, read in reads:
                needed |= read if name in needed else set()
        for lines in groups:
            lines[:] = [line for line in lines if line[0] in needed]


def _drop_unneeded(lines: list[Line], needed: set[str]) -> None:
    """Drop the lines of a stage that nobody reads after it or, from below, in it."""
    left: list[Line] = []
    for name, value in reversed(lines):
        if name in needed:
            left.append((name, value))
            needed |= set(leaves(value))
    lines[:] = left[::-1]


def leaves(value: ast.expr) -> Iterator[str]:
    """Yield the names in an expression, wheels' without their number, and none of functions."""
    for name in names_in(value):
        yield name.partition("__")[0] if name[-3:-1] == "__" else name


def names_in(value: ast.expr) -> Iterator[str]:
    """Yield the names in an expression as they are written; those of functions are none."""
    nodes: list[ast.AST] = [value]
    for node in nodes:  # it grows as it is read; `ast.walk` does the same at a third of the speed
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            nodes += node.args
        elif not isinstance(node, ast.Constant):
            nodes += _parts(node)


def _parts(node: ast.AST) -> Iterator[ast.AST]:
    for name in node._fields:
        part = getattr(node, name)
        if isinstance(part, ast.expr):
            yield part
        elif isinstance(part, list):
            yield from part


class _Tidy(ast.NodeTransformer):
    """Numbers that are known, names that are only other names, lines that say the same."""

    def __init__(self, fixed: set[str], counts: Counter[str]) -> None:
        self.fixed, self.counts = fixed, counts
        self.known: dict[str, ast.expr] = {}

    def run(self, stages: Iterable[Stage]) -> None:
        for stage in stages:
            by_text: dict[str, str] = {}
            lines: list[Line] = []
            moved: set[str] = set()
            for name, old in stage.lines:
                value = self.visit(old)
                once = self.counts[name] == 1 and name not in self.fixed
                steady = all(self._is_steady(n) for n in leaves(value))
                if once and (isinstance(value, ast.Constant) or self._is_alias(value)):
                    self.known[name] = value
                    continue
                text = ast.dump(value)
                same = by_text.get(text)
                if once and same and steady:
                    self.known[name] = ast.Name(same)
                    continue
                if once and steady:
                    by_text[text] = name
                moved.add(name)
                lines.append((name, value))
            stage.lines = lines

    def _is_steady(self, name: str) -> bool:
        return self.counts[name] == 0 or (self.counts[name] == 1 and name not in self.fixed)

    def _is_alias(self, value: ast.expr) -> bool:
        return isinstance(value, ast.Name) and self._is_steady(value.id) and "__" not in value.id

    def visit_Name(self, node: ast.Name) -> ast.expr:
        name, _, wheel = node.id.partition("__")
        known = self.known.get(name)
        if known is None:
            return node
        return ast.Name(f"{known.id}__{wheel}") if wheel and isinstance(known, ast.Name) else known

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        self.generic_visit(node)
        number = number_of(node.operand)
        return node if number is None else ast.Constant(-number)

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        left, right = number_of(node.left), number_of(node.right)
        match node.op:
            case ast.Add() if left == 0.0:
                return node.right
            case ast.Add() | ast.Sub() if right == 0.0:
                return node.left
            case ast.Mult() if left == 1.0:
                return node.right
            case ast.Mult() | ast.Div() if right == 1.0:
                return node.left
            case ast.Mult() if 0.0 in {left, right}:
                return ast.Constant(0.0)
        return node


class _Hoist(ast.NodeTransformer):
    """Takes what is constant during a call out of one line."""

    def __init__(
        self, name: str, constant: dict[str, Per], prepared: dict[Per, list[Line]],
        made: dict[str, str],
    ) -> None:  # fmt: skip
        self.name, self.constant, self.prepared, self.made = name, constant, prepared, made

    def is_constant(self, value: ast.expr) -> bool:
        return all(name in self.constant for name in leaves(value))

    def keep(self, name: str, value: ast.expr) -> None:
        wheel = any(self.constant[n] is Per.WHEEL for n in leaves(value))
        self.constant[name] = per = Per.WHEEL if wheel else Per.BODY
        self.prepared[per].append((name, value))

    def visit(self, node: ast.AST) -> ast.AST:
        simple = isinstance(node, ast.Name | ast.Constant | ast.Compare)
        if isinstance(node, ast.expr) and not simple and self.is_constant(node):
            return ast.Name(self._made(node))
        return super().generic_visit(node)

    def _made(self, node: ast.expr) -> str:
        text = ast.dump(node)
        if text not in self.made:
            match node:
                case ast.BinOp(left=ast.Constant(value=1.0), op=ast.Div(), right=ast.Name(id=name)):
                    wanted = f"per_{name}"
                case _:
                    wanted = f"{self.name}_part"
            k = sum(1 for name in self.constant if name.rstrip("0123456789") == wanted)
            self.made[text] = f"{wanted}{k + 1}" if k else wanted
            self.keep(self.made[text], node)
        return self.made[text]


def _without_divisions(lines: list[Line], numbers: set[str]) -> Iterator[Line]:
    """Yield the lines with products in place of divisions that recur.

    What divides by a number of the car, or by a name of this stage, multiplies by its reciprocal,
    whatever else a car has: so a term that does nothing leaves every bit of the others. Numbers
    among themselves are divided truly: `dt / (0 + dt)` has to be 1.
    """
    made = Counter(name for name, _ in lines)
    here = {name for name in made if made[name] == 1 and name not in numbers}
    products = _Products(numbers, here)
    new = [(name, products.visit(value)) for name, value in lines]
    for name, value in new:
        yield name, value
        if name in products.divisors:
            yield f"per_{name}", _reciprocal(ast.Name(name))


class _Products(ast.NodeTransformer):
    def __init__(self, numbers: set[str], here: set[str]) -> None:
        self.numbers, self.here = numbers, here
        self.divisors: set[str] = set()

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        if not isinstance(node.op, ast.Div) or set(leaves(node.left)) <= self.numbers:
            return self._one_over(node) if isinstance(node.op, ast.Div) else node
        if set(leaves(node.right)) <= self.numbers:
            return ast.BinOp(node.left, ast.Mult(), _reciprocal(node.right))
        if isinstance(node.right, ast.Name) and node.right.id in self.here:
            self.divisors.add(node.right.id)
            return ast.BinOp(node.left, ast.Mult(), ast.Name(f"per_{node.right.id}"))
        return node

    def _one_over(self, node: ast.BinOp) -> ast.expr:
        """Return a division of numbers: by a name of this stage as a product."""
        if not isinstance(node.right, ast.Name) or node.right.id not in self.here:
            return node
        self.divisors.add(node.right.id)
        reciprocal = ast.Name(f"per_{node.right.id}")
        is_one = isinstance(node.left, ast.Constant) and node.left.value == 1.0
        return reciprocal if is_one else ast.BinOp(node.left, ast.Mult(), reciprocal)


def _reciprocal(value: ast.expr) -> ast.expr:
    return ast.BinOp(ast.Constant(1.0), ast.Div(), value)
