"""Has cases made by the independent reality, a program of its own beside this package."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import scm
from scm.errors import RunError
from scm.runtime.parent_watch import with_parent

PLACE = "tests/reality"
KINDS = ("mixed", "single", "none", "pair", "unlisted", "shuffled", "other_car")
ENGINES = ("own", "mujoco")


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseRequest:
    """What cases to make.

    Attributes:
        strength: Smallest and largest, in multiples of what a drive can show at all.
    """

    seed: int = 0
    cases: int = 40
    kind: str = "mixed"
    engine: str = "own"
    strength: tuple[float, float] = (1.0, 4.0)


def find_root() -> Path:
    """Return the folder that holds this package and the independent reality.

    Raises:
        RunError: where there is none, as in an installed wheel.
    """
    root = Path(scm.__file__).resolve().parent.parent
    if not (root / PLACE / "__main__.py").is_file():
        msg = (
            f"{root / PLACE}: not here. Blind trials need the independent reality, which comes "
            f"with the repository and not with the installed package: run them from a clone, "
            f"or score recordings that you have with --trials DIR"
        )
        raise RunError(msg)
    return root


def make_cases(request: CaseRequest, out: Path, notify: Callable[[int], None]) -> None:
    """Write recordings, labels and seals into `out`; `notify` hears how many cases are made.

    Raises:
        RunError: with the reality's own words when it fails.
    """
    command = [
        sys.executable, "-m", PLACE.replace("/", "."), "--out", str(out.absolute()),
        "--seed", str(request.seed), "--cases", str(request.cases), "--kind", request.kind,
        "--engine", request.engine, "--strength", *map(str, request.strength),
    ]  # fmt: skip
    with subprocess.Popen(
        with_parent(command),
        cwd=find_root(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as running:
        if running.stdout is None or running.stderr is None:
            return
        for line in running.stdout:
            notify(int(line.split()[0]))
        words = running.stderr.read()
    if running.returncode:
        last = words.strip().splitlines()[-1:] or ["no words"]
        msg = f"the independent reality stopped with {running.returncode}: {last[0]}"
        raise RunError(msg)
