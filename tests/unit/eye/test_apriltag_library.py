"""What the library of AprilTags must be kept from: it writes into memory that is not its own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
CHECKED = {"LD_PRELOAD": "libc_malloc_debug.so.0", "GLIBC_TUNABLES": "glibc.malloc.check=3"}
LOOK = """
import numpy as np
from scm.eye.detect import Settings, look
rng = np.random.default_rng(0)
for decimate in (1.0, 2.0):
    for size in ((16, 16), (40, 100), (64, 64), (71, 72), (73, 71), (128, 160)):
        look(rng.integers(0, 255, size, dtype=np.uint8), Settings(), decimate, 0.8)
print("looked")
"""


def test_one_module_alone_opens_it_for_whoever_frees_a_detector_dies_later():
    folders = (ROOT / name for name in ("scm", "vehicle_agent", "tests", "bench", "examples"))
    opens = ("import pupil_apriltags", "from pupil_apriltags")
    found = {
        path.relative_to(ROOT).as_posix()
        for folder in folders
        for path in folder.rglob("*.py")
        if path != Path(__file__) and any(words in path.read_text("utf-8") for words in opens)
    }
    assert found == {"scm/eye/detect.py"}


def test_a_small_picture_is_looked_at_without_a_write_beyond_what_was_asked_for():
    def run(script):
        environment = {**os.environ, **CHECKED, "NUMBA_DISABLE_JIT": "1"}
        return subprocess.run(
            [sys.executable, "-c", script], env=environment, cwd=ROOT, capture_output=True,
            text=True, check=False,
        )  # fmt: skip

    if run("print()").stderr:  # the linker says that it does not know the checking allocator
        pytest.skip("needs the checking allocator of the GNU C library (libc_malloc_debug.so.0)")
    done = run(LOOK)
    assert (done.returncode, done.stdout) == (0, "looked\n"), done.stderr
