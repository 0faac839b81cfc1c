"""Both generations of the protocol, frame by frame; then a socket whose script comes and goes."""

import json
import math
import socket
import threading
import time

import pytest
from websockets.sync.server import serve

from scm.clock import NS_PER_MS, NS_PER_S, StepClock, WallClock
from vehicle_agent.devkit.deflate import Packet, Piece
from vehicle_agent.devkit.engineio import EVENT, Dialogue, ScriptSocket

OLD = '0{"sid":"a","upgrades":[],"pingTimeout":60000,"pingInterval":25000}'
NEW = '0{"sid":"a","upgrades":[],"pingTimeout":20000,"pingInterval":25000,"maxPayload":1000000}'
REPLY = '42["Bridge",{"V1 Throttle":"0.5"}]'


def opened(welcome):
    dialogue = Dialogue(0)
    dialogue.feed(welcome, 0)
    dialogue.due(0)
    dialogue.feed("40", 0)
    return dialogue


def test_the_old_server_connects_us_unasked():
    dialogue = Dialogue(0)
    assert dialogue.feed(OLD, 0) == []
    assert dialogue.due(100 * NS_PER_MS) == []
    dialogue.feed("40", 100 * NS_PER_MS)
    assert (dialogue.is_open, dialogue.generation) == (True, 3)
    assert dialogue.due(300 * NS_PER_MS) == []


def test_the_new_server_is_asked_at_once():
    dialogue = Dialogue(0)
    dialogue.feed(NEW, 0)
    assert dialogue.due(0) == ["40"]
    assert not dialogue.is_open
    dialogue.feed('40{"sid":"b"}', 1)
    assert (dialogue.is_open, dialogue.generation) == (True, 4)


def test_a_new_server_that_does_not_say_so_is_asked_a_moment_later():
    dialogue = Dialogue(0)
    dialogue.feed(OLD, 0)
    assert dialogue.due_ns == 200 * NS_PER_MS
    assert dialogue.due(200 * NS_PER_MS) == ["40"]
    assert dialogue.due(201 * NS_PER_MS) == []


def test_the_old_server_is_pinged_each_twenty_seconds():
    dialogue = opened(OLD)
    assert dialogue.due_ns == 20 * NS_PER_S
    assert dialogue.due(20 * NS_PER_S - 1) == []
    assert dialogue.due(20 * NS_PER_S) == ["2"]
    dialogue.feed("3", 21 * NS_PER_S)
    assert dialogue.due_ns == 41 * NS_PER_S
    assert not dialogue.ended


def test_an_old_server_without_a_pong_is_given_up():
    dialogue = opened(OLD)
    dialogue.due(20 * NS_PER_S)
    assert dialogue.due(40 * NS_PER_S) == []
    assert "ping" in dialogue.ended


def test_the_new_servers_ping_is_answered_and_missed():
    dialogue = opened(NEW)
    dialogue.feed("2", 25 * NS_PER_S)
    assert dialogue.due(25 * NS_PER_S) == ["3"]
    assert dialogue.due(70 * NS_PER_S - 1) == []
    assert not dialogue.ended
    dialogue.due(70 * NS_PER_S)
    assert "pings" in dialogue.ended


@pytest.mark.parametrize("text", [REPLY, '4213["Bridge",{"V1 Throttle":"0.5"}]'])
def test_an_event_is_read_whether_it_wants_to_be_confirmed_or_not(text):
    assert opened(OLD).feed(text, 0) == [{"V1 Throttle": "0.5"}]


def test_an_event_with_a_nan_as_python_writes_it_is_an_event():
    (told,) = opened(OLD).feed('42["Bridge",{"V1 Throttle":NaN}]', 0)
    assert math.isnan(told["V1 Throttle"])


def test_a_fault_of_ours_on_the_thread_is_kept_for_the_other_one():
    script = FakeScript(0)
    ours = Ours(script.port)
    try:
        ours.socket._packet = lambda: 1 // 0
        soon(lambda: ours.socket.failure is not None, "it is kept")
        assert isinstance(ours.socket.failure, ZeroDivisionError)
        soon(lambda: not ours.socket.is_open, "the connection is over")
    finally:
        ours.socket.stop()
        script.close()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "4",
        "42",
        "42[",
        "42[]",
        "42" + "[" * 100_000,
        '42["Bridge"]',
        '42["Other",{}]',
        "42{}",
        "9",
        "6",
        "x",
        "3",
    ],
)
def test_what_is_no_event_is_none_and_harms_nothing(text):
    dialogue = opened(OLD)
    assert dialogue.feed(text, 0) == []
    assert not dialogue.ended


@pytest.mark.parametrize(
    ("text", "words"), [("1", "closed"), ("41", "disconnected"), ('44{"message":"no"}', "no")]
)
def test_an_end_is_told_in_words(text, words):
    dialogue = opened(NEW)
    dialogue.feed(text, 0)
    assert words in dialogue.ended


def test_who_welcomes_us_and_never_connects_us_is_given_up_after_five_seconds():
    dialogue = Dialogue(0)
    dialogue.feed(NEW, 0)
    dialogue.due(0)
    dialogue.due(5 * NS_PER_S - 1)
    assert not dialogue.ended
    dialogue.due(5 * NS_PER_S)
    assert "no socket.io server" in dialogue.ended


def test_a_server_that_says_nothing_is_told_bare_events_and_never_pinged():
    dialogue = Dialogue(0)
    assert dialogue.due_ns == NS_PER_S
    assert dialogue.due(NS_PER_S - 1) == []
    assert not dialogue.is_open
    assert dialogue.due(NS_PER_S) == []
    assert (dialogue.is_open, dialogue.is_bare) == (True, True)
    for second in range(20, 100, 20):
        assert dialogue.feed(REPLY, second * NS_PER_S) == [{"V1 Throttle": "0.5"}]
        assert dialogue.due((second + 20) * NS_PER_S) == []
    assert not dialogue.ended


def test_a_server_that_never_answers_a_bare_event_is_given_up():
    dialogue = Dialogue(0)
    dialogue.due(NS_PER_S)
    dialogue.due(31 * NS_PER_S - 1)
    assert not dialogue.ended
    dialogue.due(31 * NS_PER_S)
    assert "no socket.io server" in dialogue.ended


def test_a_server_that_was_only_slow_to_welcome_us_is_talked_to_as_ever():
    dialogue = Dialogue(0)
    dialogue.due(NS_PER_S)
    dialogue.feed(NEW, 3 * NS_PER_S)
    assert (dialogue.is_open, dialogue.is_bare) == (False, False)
    assert dialogue.due(3 * NS_PER_S) == ["40"]
    dialogue.feed("40", 4 * NS_PER_S)
    assert dialogue.is_open


def test_a_silent_script_gets_the_event_without_a_number():
    heard = []

    def talk(connection):
        for text in connection:
            heard.append(text)
            connection.send(REPLY)

    with serve(talk, "127.0.0.1", 0, compression=None) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        ours = Ours(server.socket.getsockname()[1])
        try:
            soon(lambda: ours.replies and ours.socket.is_open, "it answers")
            assert "events alone" in ours.socket.detail
            assert all(text.startswith('42["Bridge",{') for text in heard)
        finally:
            ours.socket.stop()
            server.shutdown()
            thread.join()


class FakeScript:
    """A script's server of the new generation, in this process."""

    def __init__(self, port, answers=True, compression=None):
        self.answers, self.heard, self.asked = answers, [], []
        self.server = serve(self._talk, "127.0.0.1", port, compression=compression, max_size=None)
        self.port = self.server.socket.getsockname()[1]
        self.thread = threading.Thread(target=self.server.serve_forever)
        self.thread.start()

    def _talk(self, connection):
        self.asked.append(connection.request.path)
        connection.send(NEW)
        for text in connection:
            if text == "40":
                connection.send('40{"sid":"b"}')
            elif text.startswith("42"):
                self.heard.append(json.loads(text[2:].lstrip("0123456789"))[1])
                if self.answers:
                    connection.send(REPLY)

    def close(self):
        self.server.shutdown()
        self.thread.join()


@pytest.mark.parametrize("spans", ["1e308", "1" + "0" * 400, "NaN", "Infinity"])
def test_no_span_of_a_welcome_is_too_long(spans):
    dialogue = opened(f'0{{"pingInterval":{spans},"pingTimeout":{spans},"maxPayload":1}}')
    dialogue.feed("2", NS_PER_S)
    assert dialogue.due(NS_PER_S) == ["3"]
    assert NS_PER_S < dialogue.due_ns <= (2 * 86_400 + 1) * NS_PER_S


@pytest.mark.parametrize(
    "text", ["42[", '42["Bridge"]', '42["Other",{}]', "42{}", "0[]", "42" + "[" * 100_000]
)
def test_what_cannot_be_read_is_said_and_cut(text):
    dialogue = opened(OLD)
    dialogue.feed(REPLY, 0)
    assert dialogue.unread == ""
    dialogue.feed(text, 0)
    assert 0 < len(dialogue.unread) < 150


def test_the_number_of_an_eaten_packet_is_read():
    dialogue = opened(OLD)
    for text in ("4317[]", "43[]", "43x[]"):
        dialogue.feed(text, 0)
        assert dialogue.handled == 17
    dialogue.feed("43" + "9" * 9999 + "[]", 0)


class Hostile:
    """Says the same to whoever connects, and counts them."""

    def __init__(self, *words, compression=None):
        self.words, self.times = words, 0
        self.server = serve(self._talk, "127.0.0.1", 0, compression=compression, max_size=None)
        self.port = self.server.socket.getsockname()[1]
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def _talk(self, connection):
        self.times += 1
        for text in (NEW, "40", *self.words):
            connection.send(text)
        for _ in connection:
            pass


@pytest.mark.parametrize("compression", [None, "deflate"])
def test_too_much_at_once_ends_that_connection_and_another_begins(compression):
    script = Hostile('42["Bridge",{"' + "k" * 2**20 + '":"1"}]', compression=compression)
    ours = Ours(script.port)
    try:
        soon(lambda: script.times > 1, "it connects anew")
        assert ours.replies == []
        assert ours.socket.failure is None
    finally:
        ours.socket.stop()
        script.server.shutdown()


def test_a_reply_that_cannot_be_taken_ends_that_connection_and_another_begins(caplog):
    script = Hostile(REPLY)
    ours = Ours(script.port)
    ours.socket._on_reply = lambda *_: {}["no such key"]
    try:
        soon(lambda: script.times > 1, "it connects anew")
        soon(lambda: "KeyError" in caplog.text, "it is told")
        assert ours.socket.failure is None
    finally:
        ours.socket.stop()
        script.server.shutdown()


def test_a_redirection_is_refused_whatever_its_place():
    with socket.create_server(("127.0.0.1", 0)) as listening:
        ours = Ours(listening.getsockname()[1])
        try:
            for place in ("http://[::bad", "ws://127.0.0.1:9/"):
                with listening.accept()[0] as held:
                    held.recv(4096)
                    words = f"HTTP/1.1 302 Found\r\nLocation: {place}\r\n"
                    held.sendall((words + "Content-Length: 0\r\n\r\n").encode())
                soon(lambda: "302" in ours.socket.detail, "it says so")
            assert ours.socket.failure is None
        finally:
            ours.socket.stop()


def free_port():
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        return held.getsockname()[1]


class Ours:
    def __init__(self, port, clock=None):
        self.replies, self.number, self.knows = [], 0, True
        self.socket = ScriptSocket(
            ("127.0.0.1", port), self.packet, self.said, clock or WallClock(), 5 * NS_PER_MS
        )
        self.socket.start()

    def packet(self):
        self.number += 1
        return Packet(EVENT, [Piece(f'"number":"{self.number}"')]) if self.knows else None

    def said(self, data, _t_ns):
        self.replies.append(data)


def soon(condition, what, within_s=20.0):
    end = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.005)


def test_a_script_that_starts_later_ends_and_starts_again_is_found_each_time():
    port = free_port()
    ours = Ours(port)
    try:
        soon(lambda: "nothing listens" in ours.socket.detail, "it says that nobody is there")
        assert not ours.socket.is_open
        for _ in range(2):
            script, before = FakeScript(port), len(ours.replies)
            soon(lambda b=before: len(ours.replies) > b + 3, "it converses")
            assert ours.socket.is_open
            assert "talks with" in ours.socket.detail
            script.close()
            soon(lambda: not ours.socket.is_open, "it notices the end")
        assert script.asked == ["/socket.io/?EIO=4&transport=websocket"]
    finally:
        ours.socket.stop()
    assert set(map(str, ours.replies)) == {"{'V1 Throttle': '0.5'}"}


def test_each_packet_is_the_newest_and_none_goes_before_there_is_one():
    script = FakeScript(0)
    ours = Ours(script.port)
    ours.knows = False
    try:
        soon(lambda: ours.socket.is_open, "it is open")
        time.sleep(0.1)
        assert script.heard == []
        ours.knows = True
        soon(lambda: len(script.heard) > 5, "packets come")
        numbers = [int(heard["number"]) for heard in script.heard]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    finally:
        ours.socket.stop()
        script.close()


@pytest.mark.parametrize("compression", [None, "deflate"])
def test_a_server_that_inflates_is_sent_deflated_packets_and_any_other_text(
    compression, monkeypatch
):
    sent, deflated = [], Packet.deflated
    monkeypatch.setattr(Packet, "deflated", lambda *told: sent.append(told) or deflated(*told))
    script = FakeScript(0, compression=compression)
    ours = Ours(script.port)
    try:
        soon(lambda: len(ours.replies) > 5, "it converses")
        assert [heard["number"] for heard in script.heard[:3]] == ["1", "2", "3"]
        assert ours.replies[0] == {"V1 Throttle": "0.5"}
        assert bool(sent) == (compression is not None)
    finally:
        ours.socket.stop()
        script.close()


class CountedClock(StepClock):
    """Counts how often somebody looks at it."""

    looks = 0

    def now_ns(self):
        self.looks += 1
        return super().now_ns()


def test_an_unanswered_packet_is_sent_again_after_a_second():
    script, clock = FakeScript(0, answers=False), CountedClock()
    ours = Ours(script.port, clock)
    try:
        soon(lambda: len(script.heard) == 1, "the first packet")
        clock.set_ns(NS_PER_S - 1)
        before = clock.looks
        soon(lambda: clock.looks > before + 10, "it looks at the clock, and again")
        assert ours.number == 1
        clock.set_ns(NS_PER_S)
        soon(lambda: len(script.heard) == 2, "the second packet")
        assert ours.replies == []
    finally:
        ours.socket.stop()
        script.close()
