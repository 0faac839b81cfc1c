"""The red button: from pressing it until a real car's motor has no throttle, in a live city.

    python -m bench stop [published] [ours] [--cars N ...] [--times N]

`scm up` with so many other cars, a real car's agent over `--serial` to the published firmware
emulated, or to ours on a simulated chip. Pressed as the dashboard does: `PUT /api/v1/stop`. Times
count from before the request until the device tells PWM 0. The bar is 150 ms.
"""

import argparse
import json
import random
import statistics
import time
import urllib.request

from bench.car_rig import FIRMWARES, Rig, rig, wait_for
from bench.city_live import city

MAP = "grid:3x3:12"
BAR_MS = 150.0
PATIENCE_S = 3.0


def press(port: int, *, engaged: bool) -> None:
    """Press or release the stop, as the dashboard does."""
    body = json.dumps({"engaged": engaged, "by": "bench", "reason": "bench"}).encode()
    request = urllib.request.Request(
        f"http://127.0.0.1:{port}/api/v1/stop", body, {"Content-Type": "application/json"},
        method="PUT",
    )  # fmt: skip
    with urllib.request.urlopen(request, timeout=5.0) as answer:
        answer.read()


def tried(made: Rig, port: int) -> float | None:
    """Return how long one press took [ms]; None: it never stopped."""
    made.drive()
    time.sleep(random.uniform(0.0, 0.2))
    pressed_ns = time.monotonic_ns()
    press(port, engaged=True)
    wait_for(lambda: made.motor.stopped(pressed_ns), PATIENCE_S)
    stopped_ns = made.motor.stopped(pressed_ns)
    press(port, engaged=False)
    return None if stopped_ns is None else (stopped_ns - pressed_ns) / 1e6


def row(firmware: str, cars: int, times: int) -> bool:
    """Print one line; return whether every press passed the bar."""
    with (
        city(cars, MAP) as (endpoint, _, port),
        rig(endpoint, MAP, FIRMWARES[firmware]) as made,
    ):
        spans = [tried(made, port) for _ in range(times)]
    known = [span for span in spans if span is not None]
    late = sum(span is None or span > BAR_MS for span in spans)
    middle = f"{statistics.median(known):.0f}" if known else "-"
    worst = f"{max(known):.0f}" if len(known) == times else "never"
    judged = f"FAIL ({late} late)" if late else "pass"
    print(f"| {firmware} | {cars} | {times} | {middle} | {worst} | {judged} |", flush=True)
    return not late


def main() -> None:
    """Print the table; end with 1 when a press was late."""
    parser = argparse.ArgumentParser(prog="python -m bench stop", description=__doc__)
    parser.add_argument("firmware", nargs="*", help="published, ours; default: both")
    parser.add_argument("--cars", type=int, nargs="+", default=[0, 20])
    parser.add_argument("--times", type=int, default=20)
    given = parser.parse_args()
    print(f"milliseconds from the press to PWM 0; bar {BAR_MS:g}")
    print("| firmware | other cars | presses | median | worst | |")
    print("|---|---|---|---|---|---|")
    passed = [
        row(firmware, cars, given.times)
        for firmware in given.firmware or list(FIRMWARES)
        for cars in given.cars
    ]
    if not all(passed):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
