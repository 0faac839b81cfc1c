"""A program as one loop over cars: the same lines as the tiles', a car after the other.

It is what one would write by hand. Tests hold the tiles against it, the benchmark measures by it.
"""

from collections.abc import Sequence
from textwrap import indent

from scm.vehicles import body14
from scm.vehicles.compiler.print_tiles import (
    BlockRows,
    loads_of,
    motion_rows,
    print_line,
    range_text,
)
from scm.vehicles.compiler.program import Program, Stage
from scm.vehicles.physics_variables import Per

_PAGE = '''"""{title}

Generated from the car's list of terms, car by car: the reference of the kernel in tiles.
"""

import math

import numpy as np

from scm.vehicles.jit import typed_kernel

# rows of each wheel in `wheel`
{wheel_rows}


@typed_kernel(
    "(float64[:,::1], float64[:,::1], boolean[::1], int64[::1], int64, int64, int64, float64)"
)
def advance(block, numbers, alive, status, first, last, steps, dt):
    """Advance rows first..last-1 by `steps` substeps; a car that diverges is put back, marked."""
    wheel = np.empty((4, {wheel_count}))
    for row in range(first, last):
        if not alive[row] or status[row] != 0:
            continue
        for w in range(4):
            for slot in range({wheel_loads}):
                wheel[w, slot] = block[{first_wheel} + 4 * slot + w, row]
{load}
{once}
        for _ in range(steps):
{substep}
{end}
        if verdict != 0.0:
            status[row] = int(verdict)
            for slot in {motion}:
                block[slot, row] = 0.0
            continue
{store}
        for w in range(4):
            for slot in range({wheel_inputs}, {wheel_slots}):
                block[{first_wheel} + 4 * slot + w, row] = wheel[w, slot]
'''


def print_plain(title: str, program: Program, block_rows: BlockRows, columns: Sequence[str]) -> str:
    """Return the text of a kernel that goes car by car; `columns` names the car's numbers."""
    first_wheel = min(offset for offset, width in block_rows.values() if width == 4)
    ends = [*program.close, *program.end]
    stages = [*program.once, *program.substep, *ends]
    wheel = [name for name, (_, width) in block_rows.items() if width == 4]
    for stage in (stage for stage in stages if stage.per is Per.WHEEL):
        others = {name for other in stages if other is not stage for name in other.reads}
        wheel += [name for name in stage.sets if name in others and name not in wheel]
    for stage in (stage for stage in stages if stage.per is Per.BODY):
        wheel = [name for name in wheel if name not in stage.sets]
    body = [name for name, (_, width) in block_rows.items() if width == 1]
    loaded = body[: first_wheel - len(body14.OUTPUTS[Per.BODY])]
    stored = body[len(body14.INPUTS[Per.BODY]) :]
    load = [f"{name} = block[{block_rows[name][0]}, row]" for name in loaded]
    load += [f"{name} = numbers[{k}, row]" for k, name in enumerate(columns)]

    def write(some: Sequence[Stage], width: int) -> str:
        return indent("\n".join(_text(s, wheel) for s in some if s.lines), " " * width)

    return _PAGE.format(
        title=title,
        wheel_rows="\n".join(f"{name.upper()} = {k}" for k, name in enumerate(wheel)),
        wheel_count=len(wheel),
        wheel_loads=sum(1 for name in wheel if name in block_rows) - len(body14.OUTPUTS[Per.WHEEL]),
        wheel_inputs=len(body14.INPUTS[Per.WHEEL]),
        wheel_slots=sum(1 for name in wheel if name in block_rows),
        first_wheel=first_wheel,
        load=indent("\n".join(load), " " * 8),
        once=write(program.once, 8),
        substep=write(program.substep, 12),
        end=write(ends, 8),
        motion=motion_rows(block_rows),
        store=indent("\n".join(f"block[{block_rows[n][0]}, row] = {n}" for n in stored), " " * 8),
    )


def _text(stage: Stage, wheel: Sequence[str]) -> str:
    """Return one stage: a wheel's names wait in `wheel` from one loop to the next."""
    lines = [print_line(line, branches=True) for line in stage.lines]
    if stage.per is Per.BODY:
        far = [name for name in loads_of(stage) if name[-3:-1] == "__"]
        lines = [f"{n} = wheel[{n[-1]}, {n[:-3].upper()}]" for n in far] + lines
        return f"# {stage.name}\n" + "\n".join(lines)
    before = [f"{name} = wheel[w, {name.upper()}]" for name in loads_of(stage) if name in wheel]
    after = [f"wheel[w, {name.upper()}] = {name}" for name in stage.sets if name in wheel]
    place = ["front = 1.0 if w < 2 else 0.0", "side = 1.0 if w % 2 == 0 else -1.0"]
    return f"# {stage.name}\nfor w in {range_text(stage.wheels)}:\n" + indent(
        "\n".join([*place, *before, *lines, *after]), "    "
    )
