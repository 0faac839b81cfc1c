"""Every condition of the real car's guard is seen both ways, and every mutant of it is caught.

How many: python -m tests.unit.test_real_guard_mutants
"""

import ast
import sys
import types
from pathlib import Path

import pytest

from tests.unit.test_real_guard import CLAIMS
from vehicle_agent import guard as real

SOURCE = Path(real.__file__)
COMPARED = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
}
COUNTED = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.BitOr: None,
    ast.MatMult: None,
}
NAMED = {"min": "max", "max": "min", "any": "all", "all": "any", "sin": "cos", "cos": "sin"}

EQUAL = {
    "half = self.width_m / 2.0: 2.0 -> -2.0": "the outline is as wide to the left as to the right",
    "way = math.copysign(1.0, throttle): 1.0 -> -1.0": "copysign takes the sign of the other",
}
"""Mutants that do the same, and why."""
UNTRIED = ("strict",)
"""Keywords that guard against a mistake of ours alone: what is zipped is made equally long."""


def tree():
    """The guard's syntax, without docstrings: they may say what they like."""
    made = ast.parse(SOURCE.read_text(encoding="utf-8"))
    for node in ast.walk(made):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [one for one in body if not is_text(one)] or [ast.Pass()]
    return made


def is_text(node):
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def changes(node):
    """What may stand instead of a node: (name, a function that changes it in place)."""
    return [*changed_operators(node), *changed_values(node), *changed_statements(node)]


def changed_operators(node):
    match node:
        case ast.Compare():
            for i, one in enumerate(node.ops):
                for other in COMPARED[type(one)]:
                    yield other.__name__, lambda n, i=i, o=other: n.ops.__setitem__(i, o())
        case ast.BoolOp():
            other = ast.And if isinstance(node.op, ast.Or) else ast.Or
            yield other.__name__, lambda n: setattr(n, "op", other())
        case ast.BinOp() if COUNTED[type(node.op)]:
            other = COUNTED[type(node.op)]
            yield other.__name__, lambda n: setattr(n, "op", other())
        case ast.UnaryOp():
            twice = ast.UnaryOp(node.op, node.operand)
            yield "none", lambda n: setattr(n, "operand", twice)


def changed_values(node):
    match node:
        case ast.Constant():
            for other in others(node.value):
                yield repr(other), lambda n, o=other: setattr(n, "value", o)
        case ast.Name(id=name) if name in NAMED:
            yield NAMED[name], lambda n: setattr(n, "id", NAMED[name])
        case ast.Attribute(attr=name) if name in NAMED:
            yield NAMED[name], lambda n: setattr(n, "attr", NAMED[name])
        case ast.IfExp():
            yield "swapped", swap


def changed_statements(node):
    match node:
        case ast.If():
            yield "swapped", lambda n: setattr(n, "test", ast.UnaryOp(ast.Not(), n.test))
        case ast.Expr():
            yield "left out", lambda n: setattr(n, "value", ast.Constant(None))
        case ast.Assign(targets=[ast.Attribute() | ast.Tuple(elts=[ast.Attribute(), *_])]):
            yield "left out", lambda n: setattr(n, "targets", [ast.Name("_", ast.Store())])


def swap(node):
    node.body, node.orelse = node.orelse, node.body


def others(value):
    match value:
        case bool():
            return [not value]
        case str():
            return [value + "?"]
        case int() | float():
            return [value * 2, -value] if value else [type(value)(1), 10**9]
        case _:
            return []


def mutants():
    """Every (name, code) of the guard with one place changed."""
    whole = tree()
    skipped = {
        id(node.value)
        for node in ast.walk(whole)
        if isinstance(node, ast.keyword) and node.arg in UNTRIED
    }
    texts = {}
    for node in ast.walk(whole):
        if isinstance(node, ast.stmt):
            statement = ast.unparse(node).split("\n")[0]
            texts |= {id(one): statement for one in ast.walk(node)}
    for node in list(ast.walk(whole)):
        for what, change in changes(node) if id(node) not in skipped else ():
            name = f"{texts[id(node)]}: {ast.unparse(node).splitlines()[0]} -> {what}"
            before = {k: [*v] if isinstance(v, list) else v for k, v in vars(node).items()}
            change(node)
            yield name, compile(ast.fix_missing_locations(whole), "mutant", "exec")
            vars(node).update(before)


def module_of(code, **more):
    module = types.ModuleType("mutant")
    module.__dict__.update(more)
    exec(code, module.__dict__)
    return module


LATEST_FIRST = list(CLAIMS)  # what caught a mutant catches its neighbours


def is_caught(code):
    one = LATEST_FIRST[0]
    try:
        module = module_of(code)
        for one in tuple(LATEST_FIRST):
            one(module)
    except (Exception, pytest.fail.Exception):  # noqa: BLE001 whatever shows that it is wrong
        LATEST_FIRST.remove(one)
        LATEST_FIRST.insert(0, one)
        return True
    return False


def test_every_mutant_is_caught():
    caught = [(name, is_caught(code)) for name, code in mutants()]
    assert len(caught) > 200
    assert sorted(name for name, is_it in caught if not is_it) == sorted(EQUAL)


def test_the_claims_hold_of_the_unchanged_syntax():
    assert not is_caught(compile(tree(), "whole", "exec"))


class Watched(ast.NodeTransformer):
    """Wraps every condition, and every operand of one, into a call that notes how it came out."""

    def __init__(self):
        self.places = []

    def seen(self, node):
        self.places.append(ast.unparse(node))
        name = ast.Name("_seen", ast.Load())
        return ast.Call(name, [ast.Constant(len(self.places) - 1), node], [])

    def visit_BoolOp(self, node):
        self.generic_visit(node)
        node.values = [self.seen(value) for value in node.values]
        return node

    def generic_visit(self, node):
        super().generic_visit(node)
        if isinstance(node, ast.If | ast.IfExp):
            node.test = self.seen(node.test)
        return node

    def visit_comprehension(self, node):
        self.generic_visit(node)
        node.ifs = [self.seen(test) for test in node.ifs]
        return node


def test_every_condition_comes_out_both_ways():
    watched, seen = Watched(), {}

    def note(place, value):
        seen.setdefault(place, set()).add(bool(value))
        return value

    whole = ast.fix_missing_locations(watched.visit(tree()))
    module = module_of(compile(whole, "watched", "exec"), _seen=note)
    for one in CLAIMS:
        one(module)
    assert len(watched.places) > 20
    one_way = [text for i, text in enumerate(watched.places) if seen.get(i) != {True, False}]
    assert not one_way


def test_every_line_is_run():
    made = compile(SOURCE.read_text(encoding="utf-8"), "watched", "exec")
    expected, run = set(), set()
    todo = [made]
    while todo:
        code = todo.pop()
        expected |= {line for _, _, line in code.co_lines() if line}
        todo += [one for one in code.co_consts if isinstance(one, types.CodeType)]

    def trace(frame, event, _arg):
        if frame.f_code.co_filename != "watched":
            return None
        if event == "line":
            run.add(frame.f_lineno)
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        module = types.ModuleType("watched")
        exec(made, module.__dict__)
        for one in CLAIMS:
            one(module)
    finally:
        sys.settrace(before)
    missed = {n for n in expected - run if not is_header(n)}
    assert not missed


def is_header(number):
    """Whether a line is one that only begins a function or a class, or a docstring."""
    line = SOURCE.read_text(encoding="utf-8").splitlines()[number - 1].strip()
    return line.startswith(("def ", "class ", '"""', "@"))


if __name__ == "__main__":
    tried = [is_caught(code) for _, code in mutants()]
    print(f"caught {sum(tried)} of {len(tried)} mutants; {len(EQUAL)} change nothing")
