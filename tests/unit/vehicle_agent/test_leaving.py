"""Leaving politely."""

import threading

import pytest

from scm.clock import NS_PER_MS
from scm.runtime.part import BasePart
from scm.v2x.exchange import Call, Incoming
from scm.v2x.messages.remove_request import RemoveReply, RemoveRequest
from vehicle_agent.leaving import Leaving


class Guest(BasePart):
    """A part that counts its steps and has last words."""

    name, role, period_ns, subscriptions, services = "n7", "v", 20 * NS_PER_MS, (), ()

    def __init__(self):
        self.steps = 0
        self.words = [Call(RemoveRequest(vehicle="n7"))]

    def step(self, now_ns, inbox):
        self.steps += 1
        return []

    def finish(self, now_ns):
        return self.words


@pytest.fixture
def guest():
    return Guest()


@pytest.fixture
def wish():
    return threading.Event()


@pytest.fixture
def done():
    return threading.Event()


@pytest.fixture
def leaving(guest, wish, done):
    return Leaving(guest, wish, done)


def test_until_it_is_wished_the_part_lives(leaving, guest, done):
    leaving.step(0, [])
    assert guest.steps == 1
    assert not done.is_set()


def test_it_ends_when_the_last_words_are_answered(leaving, guest, wish, done):
    wish.set()
    assert leaving.step(0, []) == guest.words
    assert leaving.step(20 * NS_PER_MS, []) == []
    assert not done.is_set()
    leaving.step(40 * NS_PER_MS, [Incoming(RemoveReply(vehicle="n7"), 0, guest.words[0])])
    assert done.is_set()
    assert leaving.finish(50 * NS_PER_MS) == []


def test_it_ends_unanswered_after_a_while(leaving, wish, done):
    wish.set()
    leaving.step(0, [])
    leaving.step(880 * NS_PER_MS, [])
    assert not done.is_set()
    leaving.step(900 * NS_PER_MS, [])
    assert done.is_set()


def test_whoever_has_nothing_to_say_ends_at_once(leaving, guest, wish, done):
    guest.words = []
    wish.set()
    leaving.step(0, [])
    leaving.step(20 * NS_PER_MS, [])
    assert done.is_set()


def test_a_runner_that_ends_early_still_gets_the_last_words(leaving, guest):
    assert leaving.finish(0) == guest.words
