"""The whole tree is clean: lint, format, types, import directions, and the size of things."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

TREES = ("scm", "vehicle_agent", "tests", "bench", "examples")
LONGEST_MODULE = 500
LONGEST_FUNCTION = 60
MYPY = """
import gc

gc.disable()
gc.enable = gc.disable  # hardly an object is free before it ends: a fifth of its time
from mypy.__main__ import console_entry

console_entry()
"""


def check(root: Path, *command: str) -> None:
    """Run a tool of this environment; its output is the failure."""
    bin_dir = Path(sys.executable).parent
    path = os.pathsep.join((str(bin_dir), os.environ["PATH"]))
    done = subprocess.run(
        command,
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PATH": path},
    )
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"


def test_lint_is_clean(root: Path) -> None:
    check(root, "ruff", "check", *TREES)


def test_format_is_clean(root: Path) -> None:
    check(root, "ruff", "format", "--check", *TREES)


@pytest.mark.timeout(900)  # it stands back like all tests, and takes most of a core for a minute
def test_types_are_clean(root: Path) -> None:
    check(root, sys.executable, "-c", MYPY)


def test_imports_go_one_way(root: Path) -> None:
    check(root, "lint-imports")


@pytest.mark.parametrize("tree", ["scm", "vehicle_agent"])
def test_modules_and_functions_stay_short(root: Path, tree: str) -> None:
    too_long = []
    for path in sorted((root / tree).rglob("*.py")):
        if path.parent == root / "scm" / "client" / "nouns":
            continue  # written by docs/make/client.py: a parameter a field of the interface
        text = path.read_text(encoding="utf-8")
        if text.count("\n") > LONGEST_MODULE:
            too_long.append(f"{path.relative_to(root)}: {text.count(chr(10))} lines")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                lines = (node.end_lineno or node.lineno) - node.lineno + 1
                if lines > LONGEST_FUNCTION:
                    too_long.append(f"{path.relative_to(root)}:{node.name}: {lines} lines")
    assert not too_long, "\n".join(too_long)


def test_no_module_is_called_after_nothing(root: Path) -> None:
    empty_names = {"utils", "helpers", "common", "base", "core", "manager", "misc"}
    found = [
        str(path.relative_to(root))
        for tree in ("scm", "vehicle_agent")
        for path in (root / tree).rglob("*.py")
        if path.stem in empty_names
    ]
    assert not found


def test_importing_messages_needs_no_compiler_and_no_camera() -> None:
    code = "import sys, scm.v2x.bus_zenoh, scm.v2x.messages.world_definition as m;"
    code += "print([n for n in ('numba', 'cv2', 'fastapi', 'pymunk') if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_nominal_cars_are_those_that_were_agreed(root: Path, shared: Path) -> None:
    import tomllib

    for name in ("nigel", "f1tenth"):
        agreed = tomllib.loads((shared / f"cars/{name}.toml").read_text())
        ours = tomllib.loads((root / f"scm/vehicles/types/{name}.toml").read_text())
        for section, keys in agreed.items():
            said = ours[section]
            known = {key: said.get(key) for key in keys} if isinstance(keys, dict) else said
            assert known == keys, f"{name}: [{section}]"  # ours may say more, of its devices
