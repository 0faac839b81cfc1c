"""The kept kernels: made of the code that is loaded, and made anew where they are damaged."""

import shutil

import pytest

from tests.unit.vehicles.fresh import Compiling, small_kernel

pytestmark = pytest.mark.slow  # each run compiles in a process of its own

CURVE = (
    "from scm.vehicles.jit import kernel_function\n\n\n"
    "@kernel_function\ndef curve(vx):\n    return {slope} * vx\n"
)
LAW = (
    "from curve import curve\nfrom scm.vehicles.jit import kernel_function\n\n\n"
    "@kernel_function\ndef calm(vx):\n    return {sign}curve(vx)\n"
)


def compiled(folder, calm_after=None):
    """Compile a small car in a process of its own; return the generated module's name."""
    return Compiling(small_kernel, folder / "cache", folder, calm_after).result()


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """A folder where the small car was compiled once, and its kernel's name."""
    folder = tmp_path_factory.mktemp("first")
    (folder / "curve.py").write_text(CURVE.format(slope=2.0), encoding="utf-8")
    (folder / "calm.py").write_text(LAW.format(sign="-"), encoding="utf-8")
    return folder, compiled(folder)


@pytest.fixture
def kernel(first, tmp_path):
    """The name of a kernel that lies in the cache."""
    folder, name = first
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    return name


def test_damaged_files_are_made_anew(tmp_path, kernel):
    for ending in ("nbi", "nbc", "py"):
        (path,) = (tmp_path / "cache").rglob(f"*.{ending}")
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) // 2])
        assert compiled(tmp_path) == kernel
        assert len(path.read_bytes()) == len(whole), ending


def test_a_change_in_a_file_that_a_law_calls_makes_another_kernel(tmp_path, kernel):
    (tmp_path / "curve.py").write_text(CURVE.format(slope=3.0), encoding="utf-8")
    assert compiled(tmp_path) != kernel


def test_a_file_edited_while_a_process_runs_does_not_name_its_kernel(tmp_path, kernel):
    changed = LAW.format(sign="2.0 * ")
    assert compiled(tmp_path, changed) == kernel  # it had loaded the old law before the edit
    assert (tmp_path / "calm.py").read_text(encoding="utf-8") == changed
    assert compiled(tmp_path) != kernel
