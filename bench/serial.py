"""Rubbish from a Nigel's cable: wrong commands and time to recover, over ten million bytes.

`python -m bench serial [MILLIONS]`
"""

import argparse
import time

from tests.unit.nigel.fuzzed_line import fuzz

RUNS = 10


def main() -> None:
    """Fuzz several hosts, each with a seed of its own; a wrong command ends with code 1."""
    parser = argparse.ArgumentParser(prog="python -m bench serial", description=__doc__)
    parser.add_argument(
        "millions", nargs="?", type=float, default=10.0, help="bytes, in millions (default 10)"
    )
    millions = parser.parse_args().millions
    began, wrong, sent, slowest_ns = time.monotonic(), 0, 0, 0
    for seed in range(RUNS):
        found = fuzz(round(millions * 1e6 / RUNS), seed)
        wrong, sent = wrong + found.wrong, sent + found.sent
        slowest_ns = max(slowest_ns, found.slowest_ns)
    span_s = time.monotonic() - began
    print("| bytes | wrong commands | slowest recovery | limit | speed |")
    print("|---|---|---|---|---|")
    print(
        f"| {sent} | {wrong} | {slowest_ns / 1e6:.0f} ms | 100 ms | {sent / span_s:.0f} bytes/s |"
    )
    if wrong or slowest_ns > 100_000_000:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
