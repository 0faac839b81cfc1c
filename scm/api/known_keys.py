"""Whose a key is, without keeping the event loop waiting for the store that knows.

A store may be a server across the network. It is queried in threads, and its answer holds for
`FRESH_NS`: a key that another process ends is refused here so much later, one that this process
ends at once. The red stop waits for no store: a key that was good before is good for it.
"""

import asyncio
import threading
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

from scm.api.keys import KeyRecord, KeyRing, public_part, whose
from scm.clock import NS_PER_MS, NS_PER_S, Clock

FRESH_NS = 250 * NS_PER_MS
THREADS = 2
PATIENCE_S = 0.2
REMEMBERED_NS = 600 * NS_PER_S


class Known(NamedTuple):
    """What is known of a key.

    Attributes:
        record: Of the key; None: no such key.
        is_sure: Whether the store confirms it; else it did earlier, and does not answer now.
    """

    record: KeyRecord | None
    is_sure: bool = True


class _Held(NamedTuple):
    record: KeyRecord
    at_ns: int


class KnownKeys:
    """The keys of a ring, as they were a moment ago.

    Args:
        ring: Of all keys.
        clock: Of this process.
    """

    def __init__(self, ring: KeyRing, clock: Clock) -> None:
        self._ring = ring
        self._clock = clock
        self._held: dict[str, _Held] = {}
        self._others = _Queue(self, THREADS, "keys")
        self._stop = _Queue(self, 1, "stop-keys")

    async def find(self, key: str) -> KeyRecord | None:
        """Return a key's record; None: no such key.

        Raises:
            StoreError: when the store does not answer.
        """
        key_id = public_part(key)
        if not key_id:
            return None
        held = self._younger_than(FRESH_NS, key_id)
        return self._judged(
            await self._others.look_up_shared(key_id) if held is None else held, key
        )

    async def find_for_stop(self, key: str) -> Known:
        """Return what is known of a key that presses the red stop, soon.

        A store that does not answer is waited for only where the key was never good before.

        Raises:
            StoreError: when then the store does not answer.
        """
        key_id = public_part(key)
        if not key_id:
            return Known(None)
        held = self._younger_than(FRESH_NS, key_id)
        if held is not None:
            return Known(self._judged(held, key))
        before = self._younger_than(REMEMBERED_NS, key_id)
        looking_up = asyncio.ensure_future(self._stop.look_up_shared(key_id))
        if before is None:
            return Known(self._judged(await looking_up, key))
        await asyncio.wait({looking_up}, timeout=PATIENCE_S)
        if looking_up.done() and looking_up.exception() is None:
            return Known(self._judged(looking_up.result(), key))
        looking_up.add_done_callback(
            lambda late: late.cancelled() or late.exception()
        )  # it was heard
        return Known(self._judged(before, key), is_sure=False)

    def look_up(self, key_id: str) -> KeyRecord | None:
        """Query the store for a key by its id, and remember the answer; blocks.

        Raises:
            StoreError: when it does not answer.
        """
        now_ns = self._clock.now_ns()
        record = self._ring.record(key_id)
        if record is None:
            self._held.pop(key_id, None)
        else:
            self._held[key_id] = _Held(record, now_ns)
        return record

    def _younger_than(self, age_ns: int, key_id: str) -> KeyRecord | None:
        held = self._held.get(key_id)
        if held is None or self._clock.now_ns() - held.at_ns >= age_ns:
            return None
        return held.record

    def _judged(self, record: KeyRecord | None, key: str) -> KeyRecord | None:
        if record is None or self._ring.has_ended(record.key_id):
            return None
        return whose(key, record)


class _Queue:
    """Look-ups on threads of their own; requests for a key under way share its answer."""

    def __init__(self, keys: KnownKeys, threads: int, name: str) -> None:
        self._keys = keys
        self._threads = ThreadPoolExecutor(threads, thread_name_prefix=name)
        self._under_way: dict[str, Future[KeyRecord | None]] = {}
        self._lock = threading.Lock()

    async def look_up_shared(self, key_id: str) -> KeyRecord | None:
        """Return the store's answer for a key.

        Raises:
            StoreError: when it does not answer.
        """
        with self._lock:
            running = self._under_way.get(key_id)
            if running is None:
                running = self._threads.submit(self._look_up, key_id)
                self._under_way[key_id] = running
        return await asyncio.shield(asyncio.wrap_future(running))  # others may wait for it as well

    def _look_up(self, key_id: str) -> KeyRecord | None:
        try:
            return self._keys.look_up(key_id)
        finally:
            with self._lock:
                del self._under_way[key_id]
