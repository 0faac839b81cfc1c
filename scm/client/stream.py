"""Server-sent events: what is live, through losses of the connection, and as one picture.

The stream sends a `snapshot` of its topics, then `delta`s with those that changed, each complete,
and a `beat` when nothing changes. After a loss the last id is sent back: no event comes twice.
"""

from collections.abc import Callable, Iterator
from typing import Any

import httpx
import msgspec

from scm.errors import LinkError

TRIES = 8

Lines = Iterator[str]


class LiveEvent(msgspec.Struct, kw_only=True, frozen=True):
    """One event.

    Attributes:
        id: Where the stream resumes after it.
        name: `snapshot`, `delta` or `beat`.
        data: Topics by name.
    """

    id: str
    name: str
    data: dict[str, Any]


def events_of(connect: Callable[[str], Lines], pause: Callable[[int], bool]) -> Iterator[LiveEvent]:
    """Yield events, and connect again when they stop.

    Args:
        connect: Returns the lines of a stream that resumes after an event, by its id; raises a
            LinkError where it is worth trying again.
        pause: Waits before the next try, by its number; returns whether to give up.

    Raises:
        LinkError: when no event came in several tries.
    """
    last_id, failed = "", 0
    while True:
        reason = "the server ended the stream"
        try:
            for found in parse(connect(last_id)):
                last_id, failed = found.id or last_id, 0
                yield found
        except httpx.TransportError as cause:
            reason = f"{type(cause).__name__}: {cause}"
        except LinkError as refusal:
            reason = str(refusal)
        failed += 1
        if failed >= TRIES:
            msg = f"live stream: nothing came in {failed} tries: {reason}; is `scm up` running?"
            raise LinkError(msg)
        if pause(failed):
            return


def parse(lines: Lines) -> Iterator[LiveEvent]:
    """Yield the events in lines; one that is cut off is dropped."""
    fields: dict[str, str] = {}
    for line in lines:
        if line:
            name, _, value = line.partition(":")
            fields[name] = value.removeprefix(" ")
        elif "data" in fields:
            data = msgspec.json.decode(fields["data"], type=dict[str, Any])
            yield LiveEvent(id=fields.get("id", ""), name=fields.get("event", ""), data=data)
            fields = {}
        else:
            fields = {}


def states(events: Iterator[LiveEvent]) -> Iterator[dict[str, Any]]:
    """Yield all topics as they are after each event; `events` of the log are the new ones."""
    state: dict[str, Any] = {}
    for found in events:
        if found.name == "snapshot":
            state = {}
        state.pop("events", None)
        state |= found.data
        yield dict(state)
