"""Numbers of a car file whose errors are correlated: `[[correlated]]` tables.

    [[correlated]]
    numbers = ["drive.no_load_speed_rad_s", "drive.stall_torque_nm"]
    matrix = [[1.0, -0.93], [-0.93, 1.0]]

Drives often determine a combination of two numbers far better than each of them. Their standard
deviations alone would then allow impossible combinations. Numbers in no table are independent.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scm.errors import nearest


@dataclass(frozen=True, slots=True)
class Correlated:
    """Numbers of a car with correlated errors.

    Attributes:
        numbers: Their keys, `section.key`.
        matrix: Correlations of their errors, symmetric and positive definite, (n, n).
    """

    numbers: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]


def read_correlated(
    blocks: Any, stds: Mapping[str, float | None], problems: list[str]
) -> tuple[Correlated, ...]:
    """Return the groups of a parsed car file; append errors to `problems`.

    Args:
        blocks: As parsed.
        stds: Of every value of the car, by key; None: the file has none.
        problems: Gets one sentence per error.
    """
    if not isinstance(blocks, list):
        problems.append("correlated: expected [[correlated]] tables")
        return ()
    found, seen = list[Correlated](), set[str]()
    for i, block in enumerate(blocks):
        wrong = next(_problems(block, stds, seen), None)
        if wrong is not None:
            problems.append(f"correlated[{i}]: {wrong}")
            continue
        seen |= set(block["numbers"])
        rows = tuple(tuple(float(v) for v in row) for row in block["matrix"])
        found.append(Correlated(tuple(block["numbers"]), rows))
    return tuple(found)


def _problems(block: Any, stds: Mapping[str, float | None], seen: set[str]) -> Iterator[str]:
    """Yield the errors of one table; later ones assume that earlier ones are corrected."""
    if not isinstance(block, dict) or set(block) != {"numbers", "matrix"}:
        yield f"expected numbers and matrix, got {block!r}"
        return
    names = block["numbers"]
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        yield f"numbers: expected a list of keys, got {names!r}"
        return
    yield from _name_problems(names, stds, seen)
    yield from _matrix_problems(block["matrix"], len(names))


def _name_problems(
    names: list[str], stds: Mapping[str, float | None], seen: set[str]
) -> Iterator[str]:
    for name in names:
        if name not in stds:
            yield f"numbers: {name}: not in this car{nearest(name, sorted(stds))}"
        elif stds[name] is None:
            yield f"numbers: {name}: has no std"
        if name in seen or names.count(name) > 1:
            yield f"numbers: {name} stands twice"


def _matrix_problems(rows: Any, count: int) -> Iterator[str]:
    try:
        matrix = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != (count, count) or not np.isfinite(matrix).all():
        yield f"matrix: expected {count} rows of {count} numbers"
        return
    if not np.allclose(matrix, matrix.T) or not np.allclose(matrix.diagonal(), 1.0):
        yield "matrix: expected it symmetric, with 1 on its diagonal"
    elif np.linalg.eigvalsh(matrix).min() <= 0.0:
        yield "matrix: expected it positive definite: these correlations contradict one another"
