"""A trial whose diagnoses never end, for the test that ends it: `python sleeping_trial.py FOLDER`.

Each worker holds a lock on a file of its own for as long as it lives, so that a test sees it go
whoever buries it.
"""

import fcntl
import signal
import sys
import threading
from pathlib import Path

from scm.mismatch.trial.labels import Case
from scm.mismatch.trial.run import answer_all, processes


def sleep(_recording, out):
    """Hold a lock and diagnose for ever."""
    with (out / "alive").open("w") as alive:
        fcntl.flock(alive, fcntl.LOCK_EX)
        (out / "began").touch()
        threading.Event().wait()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    folder = Path(sys.argv[1])
    cases = [Case(n, folder, folder) for n in ("00", "01", "02")]
    with processes(2) as executor:
        for _ in answer_all(cases, folder, sleep, executor):
            pass
