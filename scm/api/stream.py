"""The live stream: one loop encodes what changed, once, for all pages that subscribe.

A page first gets a `snapshot` of its topics, then `delta`s: the topics that changed, each complete.
Events come one by one and never twice. A topic without a subscriber is not encoded. When a page
reads too slowly and its queue is full, the queue is dropped and the page gets a new snapshot, with
the events that it has not received. When nothing changes, a `beat` is sent once a second.

An id is `<run>-<frame>-<event>`. A page that reconnects with its last id gets the events after that
one; after a restart of the server the run differs, and it gets the last `EVENTS_SHOWN` events.
"""

import asyncio
import logging
from collections import deque
from collections.abc import AsyncIterator, Iterable

import msgspec

from scm.api.acknowledgements import Acknowledgements
from scm.api.city import City
from scm.api.encoding import encode
from scm.api.picture import Picture
from scm.api.topics import EVENTS, topics_of

_LOGGER = logging.getLogger(__name__)

PERIOD_S = 0.05
HEARTBEAT_FRAMES = 20
EVENTS_SHOWN = 100
CARS_A_FRAME = 250  # so many more cars, one frame longer to wait: pages draw on by themselves
QUEUE_DEPTH = 20  # frames: one second


class Listener:
    """One page and the frames queued for it; when it cannot keep up, all of them are dropped.

    Attributes:
        sent_seq: Number of the newest event sent to it; None: nothing was sent yet.
    """

    def __init__(self, topics: frozenset[str]) -> None:
        self.topics = topics
        self.sent_seq: int | None = None
        self._frames: deque[tuple[bytes, int]] = deque()
        self._wake = asyncio.Event()
        self.behind = False
        self.closed = False

    def offer(self, frame: bytes, event_seq: int) -> None:
        """Queue a frame with events up to a number; a full queue is emptied."""
        if self.behind:
            return
        if len(self._frames) >= QUEUE_DEPTH:
            self._frames.clear()
            self.behind = True
        else:
            self._frames.append((frame, event_seq))
        self._wake.set()

    def close(self) -> None:
        """End the page's stream at its next turn."""
        self.closed = True
        self._wake.set()

    async def next_frame(self) -> bytes | None:
        """Wait for the next frame; None: the page is behind or closed."""
        while not (self._frames or self.behind or self.closed):
            self._wake.clear()
            await self._wake.wait()
        if self.behind or self.closed:
            return None
        frame, self.sent_seq = self._frames.popleft()
        return frame


class Stream:
    """The live stream of one city; `run` it in the event loop that serves the pages."""

    def __init__(self, city: City, run_id: str, seen: Acknowledgements) -> None:
        self._city = city
        self._run_id = run_id
        self._listeners: set[Listener] = set()
        self._sent: dict[str, bytes] = {}
        self._frame = 0
        self._failed_frame = -HEARTBEAT_FRAMES
        self._event_seq = 0
        self._closed = False
        self._topics = topics_of(city, seen)

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of all topics."""
        return (*self._topics, EVENTS)

    @property
    def pages(self) -> int:
        """How many pages listen."""
        return len(self._listeners)

    @property
    def is_closed(self) -> bool:
        """Whether the server is ending: nothing may stream on."""
        return self._closed

    async def run(self) -> None:
        """Send a frame every 50 ms until `close`."""
        while not self._closed:
            try:
                self.send_frame()
            except Exception as failure:  # noqa: BLE001  one bad frame must not silence all pages
                self._log_failure(failure)
            await asyncio.sleep(PERIOD_S)

    def close(self) -> None:
        """End all streams; call it in the event loop."""
        self._closed = True
        for listener in self._listeners:
            listener.close()

    def send_frame(self) -> None:
        """Encode what changed since the last frame, once, and offer it to all pages."""
        self._frame += 1
        picture = self._city.view.picture()
        if not self._listeners:
            self._event_seq = picture.event_seq
            return
        changed = self._changed(picture)
        frames: dict[frozenset[str], bytes | None] = {}
        for listener in self._listeners:
            if listener.topics not in frames:
                frames[listener.topics] = self._frame_of(changed, listener.topics)
            frame = frames[listener.topics]
            if frame is not None:
                listener.offer(frame, self._event_seq)

    async def listen(
        self, last_event_id: str = "", topics: Iterable[str] | None = None
    ) -> AsyncIterator[bytes]:
        """Yield a page's frames: a snapshot first, and again whenever it fell behind.

        Args:
            last_event_id: Of the last frame that the page saw; empty: none.
            topics: Those that it receives, of `self.topics`; None: all.
        """
        if not self._listeners:
            self._event_seq = self._city.view.picture().event_seq
        listener = Listener(frozenset(self.topics if topics is None else topics))
        listener.sent_seq = self._resume_seq(last_event_id)
        self._listeners.add(listener)
        try:
            yield b"retry: 1000\n\n" + self._snapshot(listener)
            while not (self._closed or listener.closed):
                frame = await listener.next_frame()
                if frame is not None:
                    yield frame
                elif listener.behind:
                    listener.behind = False
                    yield self._snapshot(listener)
        finally:
            self._listeners.discard(listener)

    def _log_failure(self, failure: Exception) -> None:
        if self._frame - self._failed_frame >= HEARTBEAT_FRAMES:
            self._failed_frame = self._frame
            _LOGGER.error("stream_frame_failed frame=%d", self._frame, exc_info=failure)

    def _frame_of(self, changed: dict[str, msgspec.Raw], topics: frozenset[str]) -> bytes | None:
        """Return a page's part of what changed; None: nothing, and no `beat` is due."""
        own = {name: body for name, body in changed.items() if name in topics}
        if own:
            return self._event("delta", own, self._event_seq)
        heartbeat_is_due = self._frame % HEARTBEAT_FRAMES == 0
        return self._event("beat", own, self._event_seq) if heartbeat_is_due else None

    def _changed(self, picture: Picture) -> dict[str, msgspec.Raw]:
        changed: dict[str, msgspec.Raw] = {}
        wanted = frozenset[str]().union(*(listener.topics for listener in self._listeners))
        for name, topic in self._topics.items():
            if name in wanted and self._frame % (topic.every + _crowding(name, picture)) == 0:
                body = encode(topic.make(picture))
                if self._sent.get(name) != body:
                    self._sent[name] = body
                    changed[name] = msgspec.Raw(body)
        events = self._city.view.events_after(self._event_seq, EVENTS_SHOWN)
        if events:
            self._event_seq = events[-1].seq
            changed[EVENTS] = msgspec.Raw(encode(events))
        return changed

    def _snapshot(self, listener: Listener) -> bytes:
        """Return everything as it is; of events those that no delta has sent or will send."""
        picture = self._city.view.picture()
        newest = self._event_seq
        after_seq = min(max(listener.sent_seq or 0, newest - EVENTS_SHOWN), newest)
        events = self._city.view.events_after(after_seq, newest - after_seq)
        listener.sent_seq = newest
        body = {
            name: msgspec.Raw(encode(topic.make(picture)))
            for name, topic in self._topics.items()
            if name in listener.topics
        }
        if EVENTS in listener.topics:
            body[EVENTS] = msgspec.Raw(encode(events))
        body["run"] = msgspec.Raw(encode(self._run_id))
        return self._event("snapshot", body, newest)

    def _event(self, name: str, body: dict[str, msgspec.Raw], event_seq: int) -> bytes:
        head = f"id: {self._run_id}-{self._frame}-{event_seq}\nevent: {name}\ndata: "
        return head.encode() + encode(body) + b"\n\n"

    def _resume_seq(self, last_event_id: str) -> int | None:
        run_id, _, seq = [*last_event_id.split("-"), "", ""][:3]
        return int(seq) if run_id == self._run_id and seq.isascii() and seq.isdigit() else None


def _crowding(topic: str, picture: Picture) -> int:
    """Return how many frames longer a topic waits in a large city."""
    if topic != "vehicles" or picture.snapshot is None:
        return 0
    return len(picture.snapshot.message.vehicles) // CARS_A_FRAME
