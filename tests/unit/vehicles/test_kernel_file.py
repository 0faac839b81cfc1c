"""The kept kernels: made of the code that is loaded, and made anew where they are damaged."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow  # each run compiles in a process of its own

SMALL = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from scm.vehicles.car import all_terms
from scm.vehicles.kernel_file import compile_kernel
from scm.vehicles.signals import Per
from scm.vehicles.term import Term
import calm
if len(sys.argv) > 2:
    Path(sys.argv[1], "calm.py").write_text(sys.argv[2])
names = ("suspension_spring", "tyre_contact")
terms = [*(all_terms()[name] for name in names), Term(calm.calm, per=Per.BODY, adds="force_x")]
print(compile_kernel("small", terms).__name__)
"""
CURVE = "from scm.vehicles.jit import law\n\n\n@law\ndef curve(vx):\n    return {slope} * vx\n"
LAW = (
    "from curve import curve\nfrom scm.vehicles.jit import law\n\n\n"
    "@law\ndef calm(vx):\n    return {sign}curve(vx)\n"
)


@pytest.fixture
def kernel_of(tmp_path):
    """Compile a small car in a process of its own; return the generated module's name."""

    def run(*arguments):
        done = subprocess.run(
            [sys.executable, "-B", "-c", SMALL, str(tmp_path), *arguments],
            env={**os.environ, "SCM_CACHE_DIR": str(tmp_path / "cache")},
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    (tmp_path / "curve.py").write_text(CURVE.format(slope=2.0), encoding="utf-8")
    (tmp_path / "calm.py").write_text(LAW.format(sign="-"), encoding="utf-8")
    return run


def test_damaged_files_are_made_anew(tmp_path, kernel_of):
    kernel = kernel_of()
    for ending in ("nbi", "nbc", "py"):
        (path,) = (tmp_path / "cache").rglob(f"*.{ending}")
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) // 2])
        assert kernel_of() == kernel
        assert len(path.read_bytes()) == len(whole), ending


def test_a_change_in_a_file_that_a_law_calls_makes_another_kernel(tmp_path, kernel_of):
    kernel = kernel_of()
    (tmp_path / "curve.py").write_text(CURVE.format(slope=3.0), encoding="utf-8")
    assert kernel_of() != kernel


def test_a_file_edited_while_a_process_runs_does_not_name_its_kernel(tmp_path, kernel_of):
    kernel = kernel_of()
    changed = LAW.format(sign="2.0 * ")
    assert kernel_of(changed) == kernel  # it had loaded the old law before the edit
    assert (tmp_path / "calm.py").read_text(encoding="utf-8") == changed
    assert kernel_of() != kernel
