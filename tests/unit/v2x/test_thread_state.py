"""A thread of Zenoh keeps its Python state from one callback to the next."""

import threading

import pytest

from scm.clock import NS_PER_S, WallClock
from scm.v2x import thread_state
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.router import Router, free_endpoint
from scm.v2x.thread_state import ThreadStates

MESSAGES = 50

pytestmark = pytest.mark.usefixtures("lasting_links")


class Remembering(Mailbox):
    """Notes how often the thread that brings something has been here, as that thread knows it."""

    def __init__(self):
        super().__init__(1000)
        self.local, self.most = threading.local(), 0

    def put_later(self, make):
        self.local.visits = getattr(self.local, "visits", 0) + 1
        self.most = max(self.most, self.local.visits)
        super().put_later(make)


def test_a_thread_that_brings_messages_is_known_again():
    endpoint, box, got = free_endpoint(), Remembering(), []
    with (
        Router(endpoint),
        ZenohBus("city", "ears", endpoint) as ears,
        ZenohBus("city", "mouth", endpoint) as mouth,
    ):
        ears.subscribe(PartStatus, {}, box)
        clock, never = WallClock(), threading.Event()
        end_ns = clock.now_ns() + 30 * NS_PER_S
        while len(got) < MESSAGES:
            assert clock.now_ns() < end_ns
            mouth.publish(PartStatus(station="mouth", t_ns=1))
            never.wait(0.002)
            got += box.drain()
    assert box.most > 1


def kept_by(states, threads, times=1):
    def keep():
        for _ in range(times):
            states.pin()

    for _ in range(threads):
        thread = threading.Thread(target=keep)
        thread.start()
        thread.join()
    return states.pinned


def test_a_thread_is_kept_once():
    assert kept_by(ThreadStates(), 2, times=5) == 2


def test_no_more_are_kept_than_may_be(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(thread_state, "MAX_THREADS", 3)
    assert kept_by(ThreadStates(), 5) == 3
