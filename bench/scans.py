"""Loading a scanned map beside its limits: time, and peak memory over that of the imports.

Each row is a process of its own. Run with `python -m bench scans`.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

PASSES = 3
LIMITS = {
    "1,000 x 1,000 cells of 1 cm, empty": (1.5, 150.0),
    "800 x 800 cells of 5 cm, 4,400 lone specks": (1.0, 100.0),
}
LOADS = """
import json, resource, sys, time
from scm.maps.load import load_map
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
start = time.perf_counter()
walls = len(load_map(sys.argv[1]).walls)
took = time.perf_counter() - start
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
print(json.dumps([took, peak / 1000.0, walls]))
"""


def scans(folder: Path) -> list[Path]:
    """Write the maps of `LIMITS` and return their descriptions."""
    empty = np.pad(np.full((998, 998), 254, np.uint8), 1)
    specks = np.pad(np.full((798, 798), 254, np.uint8), 1)
    places = np.random.default_rng(0).permutation(265 * 265)[:4400]
    specks[2 + places // 265 * 3, 2 + places % 265 * 3] = 0
    paths = []
    for name, cells, cell_m in (("empty", empty, 0.01), ("specks", specks, 0.05)):
        rows, columns = cells.shape
        header = f"P5 {columns} {rows} 255\n".encode()
        (folder / f"{name}.pgm").write_bytes(header + cells.tobytes())
        corner = [-columns * cell_m / 2.0, -rows * cell_m / 2.0, 0.0]
        paths.append(folder / f"{name}.yaml")
        paths[-1].write_text(
            f"image: {name}.pgm\nresolution: {cell_m}\norigin: {corner}\n"
            "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n",
            encoding="utf-8",
        )
    return paths


def loaded(path: Path) -> tuple[float, float, int]:
    """Return time [s], memory [MB] and walls of one load in a process of its own."""
    command = [sys.executable, "-c", LOADS, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=os.environ)
    return tuple(json.loads(done.stdout))


def main() -> None:
    print("| map | time | of its limit | memory | of its limit | walls |")
    print("|---|---:|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as folder:
        for path, (name, (most_s, most_mb)) in zip(
            scans(Path(folder)), LIMITS.items(), strict=True
        ):
            took, peak, walls = min(loaded(path) for _ in range(PASSES))
            print(
                f"| {name} | {took:.2f} s | {100 * took / most_s:.0f} % | {peak:.0f} MB "
                f"| {100 * peak / most_mb:.0f} % | {walls} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
