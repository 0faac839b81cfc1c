"""The recorder: a part that hears everything and says nothing but how it is doing."""

from collections.abc import Sequence
from pathlib import Path

from scm.clock import NS_PER_MS, NS_PER_S
from scm.part import Hears, Serves
from scm.recorder.mcap_file import RunFile
from scm.v2x.exchange import Incoming, Outgoing, RawSample
from scm.v2x.messages.part_status import PartStatus

FLUSH_NS = 250 * NS_PER_MS


class RecorderPart:
    """Writes every message of the city; what is older than half a second survives a kill."""

    name = "record"
    role = "part"
    period_ns = 50 * NS_PER_MS
    hears: Sequence[Hears] = ()
    serves: Sequence[Serves] = ()
    hears_raw = True

    def __init__(self, path: Path, city: str = "city") -> None:
        self.file = RunFile(path, city)
        self._flush_due_ns = 0
        self._status_due_ns = 0

    def step(self, now_ns: int, inbox: Sequence[Incoming | RawSample]) -> list[Outgoing]:
        """Write what came in; flush four times a second."""
        for item in inbox:
            if isinstance(item, RawSample):
                self.file.write(item)
        if now_ns >= self._flush_due_ns:
            self._flush_due_ns = now_ns + FLUSH_NS
            self.file.flush()
        if now_ns < self._status_due_ns:
            return []
        self._status_due_ns = now_ns + NS_PER_S
        detail = f"{self.file.messages} messages in {self.file.path.name}"
        return [PartStatus(station=self.name, t_ns=now_ns, detail=detail)]

    def finish(self, now_ns: int) -> list[Outgoing]:
        """End the file with its index."""
        del now_ns
        self.file.close()
        return []
