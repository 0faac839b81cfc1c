"""Long work stands back: it takes the processor time that the city leaves over.

Niceness counts among the processes of one session only where the kernel groups them by session
(`sched_autogroup`, usual on desktops); work in a session of its own has to lower its group as well.
"""

import contextlib
import os
from pathlib import Path

NICER = 15


def stand_back(pid: int) -> None:
    """Let a process, the leader of its session or not, and its children go after the city's."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, pid, NICER)
    with contextlib.suppress(OSError):
        if os.getsid(pid) == pid:
            Path(f"/proc/{pid}/autogroup").write_text(str(NICER))
