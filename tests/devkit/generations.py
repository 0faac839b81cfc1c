"""Python environments with the script's library, one a generation, made once and kept.

They lie in `$XDG_CACHE_HOME/scm/devkit` (or `~/.cache/scm/devkit`): a script's libraries are old,
contradict each other and must not come near ours.
"""

import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

MAKING_S = 240.0
GENERATIONS = {
    "4.2": (
        "python-socketio==4.2.0",
        "python-engineio==3.13.0",
        "eventlet==0.33.3",
        "Flask==1.1.1",
        "greenlet>=3.0",
        "Jinja2==3.0.3",
        "itsdangerous==2.0.1",
        "werkzeug==2.0.3",
        "markupsafe<2.1",
    ),
    "5.x": ("python-socketio>=5.11,<6", "eventlet>=0.36"),
}
SCRIPT = Path(__file__).with_name("script.py")


class NotToBeHadError(Exception):
    """The libraries could not be installed; says why."""


def python_of(generation: str) -> str:
    """Return the interpreter of a generation's environment; makes it where there is none.

    Raises:
        NotToBeHadError: with the installer's last words.
    """
    packages = GENERATIONS[generation]
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "scm" / "devkit"
    of_what = f"{sys.version_info[:3]} {packages}".encode()
    folder = cache / f"{generation}-{hashlib.sha256(of_what).hexdigest()[:12]}"
    python, ready = folder / "bin" / "python", folder / "ready"
    cache.mkdir(parents=True, exist_ok=True)
    with (cache / f"{folder.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not ready.exists():
            shutil.rmtree(folder, ignore_errors=True)
            _run(sys.executable, "-m", "venv", str(folder))
            _run(str(python), "-m", "pip", "install", "-q", *packages)
            ready.write_text("\n".join(packages) + "\n")
    return str(python)


def _run(*command: str) -> None:
    alone = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=MAKING_S, env=alone
        )
    except subprocess.TimeoutExpired as cause:
        msg = f"not made within {MAKING_S:.0f} s: {' '.join(command)}"
        raise NotToBeHadError(msg) from cause
    if done.returncode:
        last = [line for line in done.stderr.splitlines() if line.strip()][-1:]
        raise NotToBeHadError("".join(last) or f"exit code {done.returncode}")
