"""The first start beside its limits: 15 s (a city 25 s) with nothing compiled, 3 s warm.

Each row is a process of its own. Cold, it has empty cache folders; warm, those that the cold one
has filled. Run with `python -m bench start`.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time

COLD_S, COLD_CITY_S, WARM_S = 15.0, 25.0, 3.0
FLEET = """
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
Fleet(load_car("nigel"), 1000).advance(0.01)
print("moved", flush=True)
"""
WORLD = """
from scm.maps.load import load_map
from scm.world.part import WorldPart
cars = tuple((f"n{i}", "nigel") for i in range(4))
WorldPart(load_map("driving_school"), 0, cars).step(20_000_000, [])
print("ticked", flush=True)
"""
CITY = """
import queue, signal, subprocess, sys, tempfile, threading, time, urllib.request
with tempfile.TemporaryDirectory() as runs:
    command = [sys.executable, "-m", "scm", "up", "--port", "0", "--listen", "tcp/127.0.0.1:0"]
    city = subprocess.Popen(
        [*command, "--record-dir", runs],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )
    killer = threading.Timer(120.0, city.kill)
    killer.start()
    for line in city.stdout:
        if line.startswith("dashboard: "):
            urllib.request.urlopen(line.split()[1]).read()
            print("answered", flush=True)
            city.send_signal(signal.SIGINT)
    city.wait()
    killer.cancel()
"""
ROWS = {
    "first call of a fleet of 1,000 Nigels": (FLEET, COLD_S),
    "world of the driving school, four cars, first tick": (WORLD, COLD_S),
    "`scm up driving_school`, dashboard answers": (CITY, COLD_CITY_S),
}


def timed(program: str, folder: str) -> tuple[float, float]:
    """Return wall and processor seconds of a program, to its first printed line or its end."""
    own = {"SCM_CACHE_DIR": f"{folder}/cars", "NUMBA_CACHE_DIR": f"{folder}/numba"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    with subprocess.Popen(
        [sys.executable, "-c", program], env={**os.environ, **own}, stdout=subprocess.PIPE
    ) as process:
        if process.stdout is not None:
            process.stdout.readline()
        wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main() -> None:
    print("| what | | wall | processor | of its limit |")
    print("|---|---|---:|---:|---:|")
    for name, (program, cold_s) in ROWS.items():
        with tempfile.TemporaryDirectory() as folder:
            for state, limit in (("cold", cold_s), ("warm", WARM_S)):
                wall, processor = timed(program, folder)
                row = f"| {name} | {state} | {wall:.1f} s | {processor:.1f} s "
                print(row + f"| {100 * wall / limit:.0f} % |", flush=True)


if __name__ == "__main__":
    main()
