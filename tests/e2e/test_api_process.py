"""The web server as a process: it must not outlive its own ear."""

import subprocess
import sys

from scm.v2x.router import Router, free_endpoint

DEAF_AT_THE_THIRD_STEP = """
import sys
from scm.__main__ import main
from scm.api.view import CityView

steps, real = [], CityView.step
def step(self, now_ns, inbox):
    steps.append(now_ns)
    if len(steps) > 2:
        raise ValueError("a bug in the view")
    return real(self, now_ns, inbox)
CityView.step = step
sys.exit(main(["api", "driving_school", "--port", "0", "--connect", sys.argv[1]]))
"""


def test_a_server_whose_view_fails_ends_so_that_it_is_started_again() -> None:
    with Router(free_endpoint()) as router:
        command = [sys.executable, "-c", DEAF_AT_THE_THIRD_STEP, router.listen]
        done = subprocess.run(command, capture_output=True, text=True, timeout=30.0, check=False)
    assert done.returncode == 1
    assert "a bug in the view" in done.stderr
