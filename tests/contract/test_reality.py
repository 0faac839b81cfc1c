"""The reality that judges the mismatch tool shares no code with it."""

import ast
import subprocess
import sys

OURS = {"scm", "vehicle_agent", "maps", "recordings"}


def test_the_independent_reality_imports_nothing_of_what_it_judges(root):
    files = sorted((root / "tests" / "reality").glob("*.py"))
    assert len(files) > 5
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = [name.name for name in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            else:
                continue
            assert not OURS & {name.partition(".")[0] for name in names}, path
            within = [name for name in names if name.startswith("tests")]
            assert all(name.startswith("tests.reality") for name in within), path


def test_nothing_of_ours_is_loaded_when_cases_are_made(root):
    code = "import sys, tests.reality.cases; print(sorted(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True
    )
    loaded = ast.literal_eval(done.stdout)
    assert "tests.reality.motion" in loaded
    assert not [name for name in loaded if name.partition(".")[0] in OURS]
