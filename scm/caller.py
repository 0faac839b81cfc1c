"""What this program is called, for those who want to know who asks: the file that was started."""

import sys
from pathlib import Path


def program_name() -> str:
    """Return the name of the script or package that runs: `travel_times.py`, `scm`, `python`."""
    started = Path(sys.argv[0] if sys.argv else "")
    name = started.parent.name if started.name == "__main__.py" else started.name
    return "python" if name in ("", "-c", "-m", "-") else name
