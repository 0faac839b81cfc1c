"""`python -m tests.reality --out DIR`: cases of cars that conceal something, labels sealed."""

import argparse
import sys
from pathlib import Path

from tests.reality.cases import CONTROLS, COURSES, KINDS, LAWS, draw_kinds, write_cases
from tests.reality.engine import ENGINES, find_engine
from tests.reality.family import HALVES


def main() -> int:
    """Write the cases; say after each how many are done."""
    parser = argparse.ArgumentParser(prog="python -m tests.reality", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", type=int, default=40)
    kinds = ("mixed", *KINDS, *CONTROLS, *COURSES, *LAWS)
    parser.add_argument("--kind", choices=dict.fromkeys(kinds), default="mixed")
    parser.add_argument("--strength", type=float, nargs=2, default=(1.0, 4.0))
    parser.add_argument("--engine", choices=tuple(ENGINES), default="own")
    parser.add_argument(
        "--family", choices=("own", "drawn"), default="own", help="equations and sensors"
    )
    parser.add_argument("--half", choices=tuple(HALVES), help="of the families, with drawn ones")
    arguments = parser.parse_args()
    if arguments.half and arguments.family == "own":
        parser.error("--half needs --family drawn")
    try:
        moving = find_engine(arguments.engine)
    except ModuleNotFoundError as error:
        sys.exit(str(error))
    kinds = draw_kinds(arguments.kind, arguments.cases, arguments.seed)
    low, high = arguments.strength
    write_cases(
        arguments.out, arguments.seed, kinds, (low, high), moving,
        lambda line: print(line, flush=True), arguments.half or arguments.family,
    )  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
