"""Cuts a part out of a run: the file of a recorder that ran for that time only."""

from collections import defaultdict, deque
from dataclasses import dataclass
from pathlib import Path

from scm.clock import NS_PER_S, nanoseconds
from scm.errors import RecordingError
from scm.recorder.mcap_file import Recorded, RunFile, SchemaTable
from scm.recorder.run_index import RunIndex, read_index
from scm.v2x.exchange import RawSample
from scm.v2x.message import Delivery


@dataclass(frozen=True, slots=True)
class Cut:
    """The result of a cut.

    Attributes:
        messages: How many were copied.
        span_s: From the first to the last of them [s].
        damage: What could not be read, one sentence each.
    """

    path: Path
    messages: int
    span_s: float
    damage: tuple[str, ...]


def cut(run: Path, part: Path, from_s: float = 0.0, to_s: float | None = None) -> Cut:
    """Copy the messages of a run between two times to a new file.

    The file begins with earlier messages that are still valid, such as the map, as they reach every
    station that joins late (`Message.HISTORY_DEPTH`).

    Args:
        run: The recording; it is not changed, and may be truncated or still growing.
        part: The new file.
        from_s: Since the run began [s].
        to_s: Likewise; None: to its end.

    Raises:
        RecordingError: when nothing was recorded then, the run cannot be read, or `part` exists.
    """
    index = read_index(run)
    length_s = (index.end_ns - index.begin_ns) / NS_PER_S
    end_s = length_s if to_s is None else to_s
    if not 0.0 <= from_s <= end_s or from_s >= length_s:
        msg = f"{run}: got {from_s:g} to {end_s:g} s, expected a part of its {length_s:.1f} s"
        raise RecordingError(msg)
    begin_ns, end_ns = (index.begin_ns + nanoseconds(at) for at in (from_s, end_s))
    damage: list[str] = []
    with RunFile(part, index.city) as file:
        for one in _still_true(index, begin_ns, damage):
            file.write(RawSample(one.key, one.body, None, begin_ns))
        last_ns = begin_ns
        for one in index.read(begin_ns, end_ns, lambda _: True, damage):
            file.write(RawSample(one.key, one.body, None, one.t_ns))
            last_ns = max(last_ns, one.t_ns)
    return Cut(part, file.messages, (last_ns - begin_ns) / NS_PER_S, tuple(dict.fromkeys(damage)))


def _still_true(index: RunIndex, begin_ns: int, damage: list[str]) -> list[Recorded]:
    """Return the last events of each key before a time, in order."""
    schemas = SchemaTable(index.city)
    most = {
        key: kind.HISTORY_DEPTH
        for key in index.topics.values()
        if (kind := schemas.kind_of(key)) is not None and kind.DELIVERY is Delivery.EVENT
    }
    last: dict[str, deque[Recorded]] = defaultdict(deque)
    for one in index.read(0, begin_ns - 1, most.__contains__, damage):
        last[one.key].append(one)
        if len(last[one.key]) > most[one.key]:
            last[one.key].popleft()
    return sorted((one for of_key in last.values() for one in of_key), key=lambda one: one.t_ns)
