"""The live stream: one loop encodes what changed, once, for all pages that listen.

A page first gets a `snapshot` with every topic, then `delta`s with the topics that changed, each
whole; events come one by one and never twice. A page too slow to take them gets a new snapshot
instead of a backlog. Silence is broken by a `beat` once a second.

An id is `<run>-<frame>-<event>`: a page that comes back with the last one it saw gets the events
after that one; after a restart of the server the run differs, and it gets the last ones anew.
"""

import asyncio
import logging
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import NamedTuple

import msgspec

from scm.api.car_rows import cars_topic
from scm.api.city import City
from scm.api.encoding import encode
from scm.api.eye_rows import camera_rows
from scm.api.picture import Picture
from scm.api.routes.boxes import boxes_of
from scm.api.routes.stop import stop_of
from scm.api.signal_rows import junction_rows

_LOGGER = logging.getLogger(__name__)

PERIOD_S = 0.05
BEAT_FRAMES = 20
EVENTS_SHOWN = 100
CARS_A_FRAME = 250  # so many more cars, one frame longer to wait: pages draw on by themselves
QUEUE_DEPTH = 20  # frames: one second


class Topic(NamedTuple):
    """A part of the page: how to make it, and every how many frames that is due."""

    make: Callable[[Picture], object]
    every: int


class Listener:
    """One page: frames on their way to it; when it cannot keep up they are all dropped."""

    def __init__(self) -> None:
        self._frames: deque[bytes] = deque()
        self._wake = asyncio.Event()
        self.behind = False
        self.closed = False

    def offer(self, frame: bytes) -> None:
        """Queue a frame; a full queue is emptied and the page marked as behind."""
        if self.behind:
            return
        if len(self._frames) >= QUEUE_DEPTH:
            self._frames.clear()
            self.behind = True
        else:
            self._frames.append(frame)
        self._wake.set()

    def close(self) -> None:
        """End the page's stream at its next turn."""
        self.closed = True
        self._wake.set()

    async def take(self) -> bytes | None:
        """Wait for the next frame; None: the page is behind or closed."""
        while not (self._frames or self.behind or self.closed):
            self._wake.clear()
            await self._wake.wait()
        return None if self.behind or self.closed else self._frames.popleft()


class Stream:
    """The live stream of one city; `run` it in the event loop that serves the pages."""

    def __init__(self, city: City, run_id: str) -> None:
        self._city = city
        self._run_id = run_id
        self._listeners: set[Listener] = set()
        self._sent: dict[str, bytes] = {}
        self._frame = 0
        self._silent_frames = 0
        self._failed_frame = -BEAT_FRAMES
        self._event_seq = 0
        self._closed = False
        self._topics = {
            "cars": Topic(cars_topic, 1),
            "signals": Topic(
                lambda picture: junction_rows(picture, city.city_map.junctions, city.plans), 2
            ),
            "boxes": Topic(boxes_of, 2),
            "stop": Topic(stop_of, 2),
            "eye": Topic(camera_rows, 2),
            "stations": Topic(lambda picture: picture.stations, 10),
        }

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
        if not changed:
            self._silent_frames += 1
            if self._silent_frames < BEAT_FRAMES:
                return
        self._silent_frames = 0
        frame = self._event("delta" if changed else "beat", changed, self._event_seq)
        for listener in self._listeners:
            listener.offer(frame)

    async def listen(self, last_event_id: str = "") -> AsyncIterator[bytes]:
        """Yield a page's frames: a snapshot first, and again whenever it fell behind."""
        listener = Listener()
        self._listeners.add(listener)
        try:
            yield b"retry: 1000\n\n" + self._snapshot(self._resume_seq(last_event_id))
            while not (self._closed or listener.closed):
                frame = await listener.take()
                if frame is not None:
                    yield frame
                elif listener.behind:
                    listener.behind = False
                    yield self._snapshot(None)
        finally:
            self._listeners.discard(listener)

    def _log_failure(self, failure: Exception) -> None:
        if self._frame - self._failed_frame >= BEAT_FRAMES:
            self._failed_frame = self._frame
            _LOGGER.error("stream_frame_failed frame=%d", self._frame, exc_info=failure)

    def _changed(self, picture: Picture) -> dict[str, msgspec.Raw]:
        changed: dict[str, msgspec.Raw] = {}
        for name, topic in self._topics.items():
            if self._frame % (topic.every + _crowding(name, picture)) == 0:
                body = encode(topic.make(picture))
                if self._sent.get(name) != body:
                    self._sent[name] = body
                    changed[name] = msgspec.Raw(body)
        events = self._city.view.events_after(self._event_seq, EVENTS_SHOWN)
        if events:
            self._event_seq = events[-1].seq
            changed["events"] = msgspec.Raw(encode(events))
        return changed

    def _snapshot(self, after_seq: int | None) -> bytes:
        picture = self._city.view.picture()
        after_seq = max(after_seq or 0, picture.event_seq - EVENTS_SHOWN)
        events = self._city.view.events_after(after_seq, EVENTS_SHOWN)
        body = {
            name: msgspec.Raw(encode(topic.make(picture))) for name, topic in self._topics.items()
        }
        body["events"] = msgspec.Raw(encode(events))
        body["run"] = msgspec.Raw(encode(self._run_id))
        return self._event("snapshot", body, events[-1].seq if events else after_seq)

    def _event(self, name: str, body: dict[str, msgspec.Raw], event_seq: int) -> bytes:
        head = f"id: {self._run_id}-{self._frame}-{event_seq}\nevent: {name}\ndata: "
        return head.encode() + encode(body) + b"\n\n"

    def _resume_seq(self, last_event_id: str) -> int | None:
        run_id, _, seq = [*last_event_id.split("-"), "", ""][:3]
        return int(seq) if run_id == self._run_id and seq.isascii() and seq.isdigit() else None


def _crowding(topic: str, picture: Picture) -> int:
    """Return how many frames longer a topic waits in a large city."""
    if topic != "cars" or picture.snapshot is None:
        return 0
    return len(picture.snapshot.message.vehicles) // CARS_A_FRAME
