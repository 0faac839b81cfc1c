"""A program as loops over lanes: tiles of cars, each in a local buffer of fixed shape.

Every inner loop is straight-line text over neighbours in memory, a register full at a time, so the
compiler turns it into vector instructions without a question left open. A tile whose last lanes are
empty is driven without them.
"""

import ast
import re
from collections.abc import Mapping, Sequence
from textwrap import indent

from scm.vehicles import body14
from scm.vehicles.command_delay import COMMANDS
from scm.vehicles.compiler.inline import Line, copied
from scm.vehicles.compiler.program import Program, Stage, names_in
from scm.vehicles.compiler.vector_code import LANES, WIDTH
from scm.vehicles.physics_variables import Per

BlockRows = Mapping[str, tuple[int, int]]

_HEAD = '''"""{title}

Generated from the car's list of terms: {lanes} cars at a time, one in each lane. `car` and `wheel`
hold a tile of cars while it is worked on; a name in capitals is the row that a quantity waits in.
A stage works on whole rows, so `a * b` is the product for each car; see
`scm/vehicles/compiler/vector_code.py`.
"""

import numpy as np

from scm.vehicles.compiler.vector_code import fetch, put, put_lane, stage
from scm.vehicles.jit import typed_kernel

# rows of `car`: those of the fleet's block, then the car's numbers, then what is worked out
{vehicle_rows}
# rows of each wheel in `wheel`
{wheel_rows}
CAR_ROWS = {car_count}
WHEEL_ROWS = {wheel_rows_count}


{stages}


@typed_kernel(
    "(float64[:,::1], float64[:,::1], boolean[::1], int64[::1], int64, int64, int64, float64, "
    "float64[:,::1], float64[:,::1], int64[::1], float64[:,:,::1])"
)
def rollout(
    block, numbers, alive, status, first, last, steps, dt, throttle, steering, output_rows, out
):
    """Drive rows first..last-1 through commands, `steps` substeps under each.

    Commands have a column for each row, or the columns of one tile for all. The rows are stored
    after every so many of them, as `out` has room. A tile stays in its buffers
    as long as it drives. Where a car diverges, the tile goes back to what was stored last and is
    driven up to the command before: that is what is left of the car, marked.
    """
    parts = throttle.shape[0]
    every = parts // max(out.shape[0], 1)
    own_throttle, own_steering = throttle.shape[1] > {lanes}, steering.shape[1] > {lanes}
    room = np.empty({lanes} * (CAR_ROWS + 4 * WHEEL_ROWS) + 8)
    begin = (64 - room.ctypes.data % 64) // 8 % 8  # rows begin on a cache line
    car = room[begin : begin + {lanes} * CAR_ROWS].reshape((CAR_ROWS, {lanes}))
    wheel = room[begin + {lanes} * CAR_ROWS : begin + {lanes} * (CAR_ROWS + 4 * WHEEL_ROWS)]
    wheel = wheel.reshape((4, WHEEL_ROWS, {lanes}))
    for w in range(4):
        wheel[w, FRONT] = 1.0 if w < 2 else 0.0
        wheel[w, SIDE] = 1.0 if w % 2 == 0 else -1.0
    car_at, wheel_at, block_at, out_at = (
        car.ctypes.data, wheel.ctypes.data, block.ctypes.data, out.ctypes.data
    )
    numbers_at, throttle_at, steering_at = (
        numbers.ctypes.data, throttle.ctypes.data, steering.ctypes.data
    )
    width, number_width, out_width = block.shape[1], numbers.shape[1], out.shape[2]
    throttle_width, steering_width = throttle.shape[1], steering.shape[1]
    going = np.empty({lanes}, np.bool_)
    for start in range(first // {lanes} * {lanes}, last, {lanes}):
        cars = vectors = 0
        for i in range({lanes}):
            row = start + i
            going[i] = row >= first and row < last and alive[row] and status[row] == 0
            cars += going[i]
            vectors = i // {width} + 1 if going[i] else vectors
        t = stored = 0
        halt = parts
        fresh = True
        while t < parts:
            own, there = THROTTLE_COMMAND, start * own_throttle
            fetch(car_at, own, throttle_at, throttle_width, t, there, 1, 1)
            own, there = STEERING_COMMAND, start * own_steering
            fetch(car_at, own, steering_at, steering_width, t, there, 1, 1)
            if out.shape[0] > 0:
                put(car_at, 0, block_at, width, 0, start, {commands}, 1)
            if cars > 0:
                if fresh:
                    own, there = {commands}, {commands}
                    fetch(car_at, own, block_at, width, there, start, {body_loads} - {commands}, 1)
                    fetch(car_at, {first_wheel}, numbers_at, number_width, 0, start, {columns}, 1)
                    for w in range(4):
                        own, there = w * WHEEL_ROWS, {first_wheel} + w
                        fetch(wheel_at, own, block_at, width, there, start, {wheel_loads}, 4)
                    <once>
                <commanded>
                for _ in range(steps):
                    <substep>
                <close>
                fresh = False
                for i in range({lanes}):
                    fresh |= going[i] and car[VERDICT, i] != 0.0
                if fresh and t > stored:
                    halt = t
                    t = stored
                    continue
                if fresh or t + 1 == halt or (t + 1) % every == 0:
                    stored, halt = t + 1, parts
                    <end>
                    for i in range({lanes}):
                        if going[i] and car[VERDICT, i] != 0.0:
                            status[start + i] = int(car[VERDICT, i])
                            for r in {motion}:
                                block[r, start + i] = 0.0
                            going[i] = False
                            cars -= 1
                    if cars == {lanes}:
                        own, there = {body_inputs}, {body_inputs}
                        put(car_at, own, block_at, width, there, start, {body_stores}, 1)
                        for w in range(4):
                            own, there = w * WHEEL_ROWS + {wheel_inputs}, {wheel_stored} + w
                            put(wheel_at, own, block_at, width, there, start, {wheel_keeps}, 4)
                    else:
                        for i in range({lanes}):
                            if going[i]:
                                own, there = {body_inputs}, {body_inputs}
                                put_lane(
                                    car_at, own, block_at, width, there, start, {body_stores}, 1, i
                                )
                                for w in range(4):
                                    own, there = w * WHEEL_ROWS + {wheel_inputs}, {wheel_stored} + w
                                    put_lane(
                                        wheel_at, own, block_at, width, there, start,
                                        {wheel_keeps}, 4, i
                                    )
            t += 1
            if t % every == 0:
                for k in range(output_rows.shape[0]):
                    row = (t // every - 1) * output_rows.shape[0] + k
                    fetch(car_at, VERDICT, block_at, width, output_rows[k], start, 1, 1)
                    put(car_at, VERDICT, out_at, out_width, row, start, 1, 1)


def advance(block, numbers, alive, status, first, last, steps, dt):
    """Advance rows first..last-1 by `steps` substeps under the commands that the block has."""
    throttle = block[THROTTLE_COMMAND : THROTTLE_COMMAND + 1]
    steering = block[STEERING_COMMAND : STEERING_COMMAND + 1]
    rollout(
        block, numbers, alive, status, first, last, steps, dt, throttle, steering, NO_ROWS, NO_OUT
    )


NO_ROWS, NO_OUT = np.empty(0, np.int64), np.empty((0, 0, 0))
'''


def print_tiles(title: str, program: Program, block_rows: BlockRows, columns: Sequence[str]) -> str:
    """Return the text of a kernel that goes tile by tile; `columns` names the car's numbers."""
    first_wheel = min(offset for offset, width in block_rows.values() if width == 4)
    rows = _Rows(program, block_rows, columns)
    outputs, inputs = body14.OUTPUTS, body14.INPUTS
    wheel_count = sum(1 for _, width in block_rows.values() if width == 4)
    stages = [stage for stage in rows.stages if stage.lines]

    page = _HEAD.format(
        title=title,
        lanes=LANES,
        width=WIDTH,
        vehicle_rows=_named_rows(rows.car),
        wheel_rows=_named_rows(rows.wheel),
        car_count=len(rows.car),
        wheel_rows_count=len(rows.wheel),
        stages="\n\n\n".join(rows.function(stage) for stage in stages),
        columns=len(columns),
        first_wheel=first_wheel,
        body_inputs=len(inputs[Per.BODY]),
        body_stores=first_wheel - len(inputs[Per.BODY]),
        body_loads=first_wheel - len(outputs[Per.BODY]),
        wheel_inputs=len(inputs[Per.WHEEL]),
        wheel_loads=wheel_count - len(outputs[Per.WHEEL]),
        wheel_stored=first_wheel + 4 * len(inputs[Per.WHEEL]),
        wheel_keeps=wheel_count - len(inputs[Per.WHEEL]),
        motion=motion_rows(block_rows),
        commands=len(COMMANDS),
    )
    called = {
        name: "\n".join(rows.call(stage) for stage in getattr(program, name) if stage.lines)
        for name in ("once", "commanded", "substep", "close", "end")
    }
    return re.sub(r"^( *)<(\w+)>$", lambda m: indent(called[m[2]], m[1]), page, flags=re.MULTILINE)


class _Rows:
    """Which names of a program cross from one loop into another, and where they wait."""

    def __init__(self, program: Program, block_rows: BlockRows, columns: Sequence[str]) -> None:
        self.term_lines, self.fused = program.term_lines, program.substep
        self.stages = [
            *program.once, *program.commanded, *program.substep, *program.close, *program.end
        ]  # fmt: skip
        self.car = [*(n for n, (_, width) in block_rows.items() if width == 1), *columns]
        self.wheel = [*(n for n, (_, width) in block_rows.items() if width == 4), "front", "side"]
        reads = [set(stage.reads) for stage in self.stages]
        for k, stage in enumerate(self.stages):
            others = set().union(*reads[:k], *reads[k + 1 :])
            crossing = [n for n in stage.sets if n == "verdict" or n in others]
            mine = self.car if stage.per is Per.BODY else self.wheel
            mine += [n for n in crossing if n not in self.car and n not in self.wheel]
        self.block_rows = set(block_rows)

    def function(self, stage: Stage) -> str:
        """Return one stage as a function of whole rows."""
        body = [f"{n} = {self._place(n)}" for n in loads_of(stage) if n != "dt"]
        fused = stage in self.fused
        for k, line in enumerate(stage.lines):
            if fused and (
                k == 0 or (line[0] in self.term_lines) != (stage.lines[k - 1][0] in self.term_lines)
            ):
                body.append('"terms"' if line[0] in self.term_lines else '"skeleton"')
            body.append(print_line(line))
        stored = [n for n in stage.sets if n in self.car or n in self.wheel]
        body += [f"{self._place(n)} = {n}" for n in stored]
        text = indent("\n".join(body), "    ")
        return f"@stage\ndef {_function_name(stage)}(car, wheel, w, dt, vectors):\n{text}"

    def call(self, stage: Stage) -> str:
        """Return the call of one stage, for each wheel where it is a wheel's."""
        if stage.per is Per.BODY:
            return f"{_function_name(stage)}(car_at, wheel_at, 0, dt, vectors)"
        wheels = range_text(stage.wheels)
        return f"for w in {wheels}:\n    {_function_name(stage)}(car_at, wheel_at, w, dt, vectors)"

    def _place(self, name: str) -> str:
        if name[-3:-1] == "__":
            return f"wheel[{name[-1]}, {name[:-3].upper()}]"
        return f"car[{name.upper()}]" if name in self.car else f"wheel[w, {name.upper()}]"


def _function_name(stage: Stage) -> str:
    return stage.name.replace(" ", "_")


def range_text(wheels: range) -> str:
    """Return a run of wheels as it is written."""
    return f"range({wheels.start}, {wheels.stop})" if wheels.start else f"range({wheels.stop})"


def loads_of(stage: Stage) -> list[str]:
    """Return what a stage reads from outside, a wheel's name with its wheel as it is written."""
    names: dict[str, None] = {}
    known: set[str] = set()
    for name, value in stage.lines:
        names |= dict.fromkeys(n for n in names_in(value) if n not in known)
        known.add(name)
    return list(names)


def motion_rows(block_rows: BlockRows) -> str:
    """Return the block's rows that a frozen car loses, as the text of a tuple."""
    found = [
        offset + w for n in body14.MOTION for offset, width in [block_rows[n]] for w in range(width)
    ]
    return f"({', '.join(map(str, sorted(found)))})"


def _named_rows(names: Sequence[str]) -> str:
    return "\n".join(f"{name.upper()} = {k}" for k, name in enumerate(names))


def print_line(line: Line, *, branches: bool = False) -> str:
    """Return a line as text; without branches its selects become `where`."""
    name, value = line
    spelled = _Spell(branches).visit(copied(value))
    return f"{name} = {ast.unparse(spelled)}"


class _Spell(ast.NodeTransformer):
    def __init__(self, branches: bool) -> None:
        self.branches = branches

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        if self.branches:
            return node
        return ast.Call(_numpy("where"), [node.test, node.body, node.orelse], [])

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        match node.func:
            case ast.Name(id="floor"):
                return ast.Call(_numpy("floor"), node.args, [])
            case ast.Name(id="sqrt" | "copysign" as name):
                module = "math" if self.branches else "np"
                return ast.Call(ast.Attribute(ast.Name(module), name), node.args, [])
            case ast.Name(id="min" | "max" as name) if not self.branches:
                return ast.Call(_numpy(f"{name}imum"), node.args, [])
        return node


def _numpy(name: str) -> ast.expr:
    return ast.Attribute(ast.Name("np"), name)
