"""A port that is pulled, forbidden, busy or full; and the process that keeps it."""

import errno
import os
import pty
import signal
import socket
import subprocess
import sys
import time
import tty
import types

import msgspec
import pytest
import serial

from scm.clock import NS_PER_MS, NS_PER_S, StepClock, WallClock
from tests.unit.nigel.fake_device import Device
from tests.unit.nigel.pty_device import PtyDevice
from vehicle_agent.nigel import watchdog_client as client_module
from vehicle_agent.nigel.cable import FULL_BYTES, REOPEN_NS, Cable
from vehicle_agent.nigel.host import Host, NigelCommand
from vehicle_agent.nigel.rosserial import pack_float
from vehicle_agent.nigel.serial_watchdog import (
    COMMAND_TIMEOUT_NS,
    SerialWatchdog,
    WatchdogCommand,
    WatchdogReport,
)
from vehicle_agent.nigel.watchdog_client import SUSPECT_NS, WatchdogClient

ZERO, HALF = pack_float(0.0), pack_float(0.5)
PATIENCE_S = 40.0


@pytest.fixture
def ends():
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    yield master, slave
    for end in (master, slave):
        try:
            os.close(end)
        except OSError:
            continue


def failing(number):
    def opens(path, baud):
        raise serial.SerialException(number, "no")

    return opens


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOENT, "is the cable plugged in"),
        (errno.EACCES, "usermod -aG dialout"),
        (errno.EBUSY, "in use by another program"),
        (errno.EAGAIN, "in use by another program"),
        (errno.ENOTTY, "no serial port"),
    ],
)
def test_a_port_that_does_not_open_says_what_to_do_and_is_tried_again(number, words):
    cable = Cable("/dev/x", 57600, failing(number))
    assert not cable.keep_open(0)
    assert cable.trouble.startswith("/dev/x: ")
    assert words in cable.trouble
    cable._opens = lambda path, baud: FakePort(-1)
    assert not cable.keep_open(REOPEN_NS - 1)
    assert cable.keep_open(REOPEN_NS)
    assert cable.trouble == ""


def test_a_path_that_is_not_there_a_folder_and_a_file_are_told_apart(tmp_path):
    (tmp_path / "file").write_text("")
    said = []
    for name in ("nothing", "file", ""):
        cable = Cable(str(tmp_path / name), 57600)
        cable.keep_open(0)
        said.append(cable.trouble.partition(": ")[2])
    assert said[0].startswith("no such device")
    assert said[2] == "this is no serial port"
    assert "could not configure" in said[1].lower()


def test_a_second_program_does_not_get_the_port(ends):
    path = os.ttyname(ends[1])
    first, second = Cable(path, 57600), Cable(path, 57600)
    assert first.keep_open(0)
    assert not second.keep_open(0)
    assert "in use by another program" in second.trouble
    first.close()


def test_bytes_pass_both_ways_and_a_pulled_cable_is_noticed(ends):
    master, slave = ends
    cable = Cable(os.ttyname(slave), 57600)
    cable.keep_open(0)
    assert cable.read() == b""
    cable.write([b"abc", b"de"])
    got = os.read(master, 9)
    while len(got) < 5:  # two frames may come in two pieces
        got += os.read(master, 9)
    assert got == b"abcde"
    os.write(master, b"xyz")
    assert cable.read() == b"xyz"
    os.close(master)
    assert cable.read() == b""
    assert cable.fd is None
    assert "unplugged" in cable.trouble


class FakePort:
    """A port whose driver takes so many bytes."""

    def __init__(self, fd):
        self.fd, self.out_waiting = fd, 0

    def close(self):
        """Nothing."""

    def reset_output_buffer(self):
        """Nothing."""


def test_a_full_line_drops_whole_frames_and_ends_those_it_began(monkeypatch):
    room, out = [5], bytearray()

    def write(fd, data):
        if not room[0]:
            raise BlockingIOError
        taken = data[: room[0]]
        room[0] -= len(taken)
        out.extend(taken)
        return len(taken)

    monkeypatch.setattr(os, "write", write)
    cable = Cable("x", 1, lambda path, baud: FakePort(9))
    cable.keep_open(0)
    cable.write([b"aaa", b"bbb", b"ccc"])
    assert (bytes(out), cable.held_back) == (b"aaabb", 1)
    cable.write([b"ddd"])
    room[0] = 9
    cable.write([b"eee"])
    assert (bytes(out), cable.held_back) == (b"aaabbbeee", 2)
    cable._port.out_waiting = FULL_BYTES + 1
    cable.write([b"fff"])
    assert (bytes(out), cable.held_back) == (b"aaabbbeee", 3)


class LoopCable(Cable):
    """A cable to a device in this process."""

    def __init__(self, device):
        super().__init__("loop", 57600, lambda path, baud: FakePort(9))
        self.device, self._back, self.now_ns = device, b"", 0

    def read(self):
        back, self._back = self._back, b""
        return back

    is_full = False

    def write(self, frames):
        if self.is_full:
            self.held_back += len(frames)
            return
        self._back += self.device.hear(b"".join(frames), self.now_ns)


class Kept:
    """A keeper in virtual time."""

    def __init__(self):
        self.device = Device()
        self.cable = LoopCable(self.device)
        self.keeper = SerialWatchdog(self.cable, Host())
        self.now_ns = 10**18

    def run(self, span_ns, wish=None, age_ns=0):
        for _ in range(span_ns // (5 * NS_PER_MS)):
            self.now_ns += 5 * NS_PER_MS
            self.cable.now_ns = self.now_ns
            asked = None if wish is None else WatchdogCommand(self.now_ns - age_ns, wish)
            self.keeper.step(self.now_ns, asked)
        return self.device.values


def test_the_keeper_says_zero_once_the_agent_has_been_silent_for_150_ms():
    kept = Kept()
    kept.run(3 * NS_PER_S, NigelCommand(0.5, -0.5))
    assert kept.device.values == {"steer_cmd": -0.5, "drive_cmd": 0.5}
    assert kept.run(COMMAND_TIMEOUT_NS - 25 * NS_PER_MS) == {"steer_cmd": -0.5, "drive_cmd": 0.5}
    assert kept.run(50 * NS_PER_MS) == {"steer_cmd": 0.0, "drive_cmd": 0.0}


@pytest.mark.parametrize("age_ns", [COMMAND_TIMEOUT_NS + 1, -COMMAND_TIMEOUT_NS - 1, 10**18])
def test_a_wish_that_waited_in_the_queue_or_has_no_honest_stamp_is_not_obeyed(age_ns):
    kept = Kept()
    assert kept.run(3 * NS_PER_S, NigelCommand(0.5, 0.5), age_ns) == {
        "steer_cmd": 0.0,
        "drive_cmd": 0.0,
    }


def test_the_keeper_answers_every_wish_and_tells_how_to_say_zero_once_it_knows():
    kept = Kept()
    kept.run(5 * NS_PER_MS, NigelCommand())
    assert kept.keeper.report().rest == b""
    assert kept.keeper.report() is None
    kept.run(3 * NS_PER_S, NigelCommand(0.5, 0.5))
    assert kept.keeper.report() is not None
    kept.run(5 * NS_PER_MS)
    assert kept.keeper.report() is None
    kept.run(5 * NS_PER_MS, NigelCommand(0.5, 0.5))
    rest = kept.keeper.report().rest
    kept.device.hear(rest, kept.now_ns)
    assert kept.device.values == {"steer_cmd": 0.0, "drive_cmd": 0.0}


def test_the_keeper_tells_once_what_it_wrote_and_when_it_did_and_what_found_no_room_not():
    kept = Kept()
    kept.run(3 * NS_PER_S, NigelCommand(0.5, -0.5))
    kept.keeper.report()
    begun, heard = kept.now_ns, len(kept.device.said)
    kept.run(NS_PER_S, NigelCommand(2.0, -0.25))
    written = kept.keeper.report().written
    payloads = [frame.payload for frame in kept.device.said[heard:] if frame.topic == 101]
    assert [pack_float(one.throttle) for one in written] == payloads
    assert {(one.throttle, one.steering) for one in written} == {(1.0, -0.25)}
    assert [one.t_ns - begun for one in written] == [
        (5 + 20 * i) * NS_PER_MS for i in range(50)]  # fmt: skip
    assert kept.keeper.report() is None
    kept.cable.is_full = True
    kept.run(NS_PER_S, NigelCommand(0.5, 0.5))
    assert kept.keeper.report().written == ()


def test_the_keeper_ends_with_zeros_said_five_times():
    kept = Kept()
    kept.run(3 * NS_PER_S, NigelCommand(0.5, 0.5))
    before = len(kept.device.said)
    clock = StepClock(kept.now_ns)
    kept.keeper.finish(clock)
    assert [frame.payload for frame in kept.device.said[before:]] == [ZERO] * 10
    assert kept.cable.fd is None
    assert clock.now_ns() - kept.now_ns <= NS_PER_S


@pytest.fixture
def plugged(tmp_path):
    device = PtyDevice(tmp_path / "nigel")
    yield device
    device.pull()


def wait(condition, every=lambda: None):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        every()
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.fixture
def driving(plugged, monkeypatch):
    monkeypatch.setattr(client_module, "EXIT_TIMEOUT_S", PATIENCE_S)
    watchdog, clock = WatchdogClient(str(plugged.path), 57600), WallClock()
    steer = lambda: watchdog.command(NigelCommand(0.5, 0.5), clock.now_ns())  # noqa: E731
    wait(lambda: plugged.newest(101) == HALF and watchdog.report.rest, every=steer)
    yield watchdog, steer, plugged
    watchdog.close()
    watchdog._process.wait(PATIENCE_S)


def test_a_silent_agent_is_zeroed_from_outside_and_close_leaves_zeros(driving):
    watchdog, steer, device = driving
    wait(lambda: device.newest(101) == ZERO)
    wait(lambda: device.newest(101) == HALF, steer)
    watchdog.close()
    assert watchdog._process.returncode == 0
    last = lambda: [(topic, payload) for _, topic, payload in device.log[-10:]]  # noqa: E731
    wait(lambda: last() == [(101, ZERO), (100, ZERO)] * 5)


def test_the_helm_knows_once_what_was_written_and_when(driving):
    watchdog, steer, device = driving
    watchdog.written()
    told, heard = [], []

    def are_told():
        told.extend(watchdog.written())
        return len(told) > 20 and (0.5, 0.5) in {(one.throttle, one.steering) for one in told}

    def are_heard():
        heard[:] = [t_ns for t_ns, topic, _ in device.log if topic == 101]
        return len(heard) >= len(told) - 1

    wait(are_told, steer)
    times = [one.t_ns for one in told]
    assert times == sorted(set(times))
    wait(are_heard)
    near_ns = round(PATIENCE_S * NS_PER_S)
    assert all(any(abs(t_ns - at) < near_ns for t_ns in heard) for at in times)


def test_a_pulled_cable_is_told_and_drives_again_when_it_is_back(driving):
    watchdog, steer, device = driving
    device.pull()
    clock = WallClock()
    gone = ("unplugged", "no such device")
    wait(lambda: any(w in watchdog.trouble(clock.now_ns()) for w in gone), steer)
    device.log.clear()
    device.plug()
    wait(lambda: device.newest(101) == HALF, every=steer)


@pytest.mark.parametrize("way", [signal.SIGKILL, signal.SIGSTOP, signal.SIGINT])
def test_a_keeper_that_dies_or_hangs_is_replaced_and_its_port_is_opened_at_once(driving, way):
    watchdog, steer, device = driving
    old = watchdog._process
    old.send_signal(way)
    wait(lambda: watchdog._fallback._port is not None, steer)
    wait(lambda: watchdog._process is not old, steer)
    wait(lambda: watchdog._fallback._port is None, steer)
    device.log.clear()
    wait(lambda: device.newest(101) == HALF, every=steer)


def test_a_stopped_keeper_has_zeros_said_beside_it_and_drives_on_without_a_reset(
    driving, monkeypatch
):
    monkeypatch.setattr(client_module, "HANG_NS", round(PATIENCE_S * NS_PER_S))
    watchdog, steer, device = driving
    old = watchdog._process
    os.kill(old.pid, signal.SIGSTOP)
    device.log.clear()
    wait(lambda: device.newest(101) == ZERO, steer)
    os.kill(old.pid, signal.SIGCONT)
    wait(lambda: device.newest(101) == HALF, steer)
    assert watchdog._process is old
    assert watchdog._fallback._port is None


def test_an_agent_that_leaves_while_its_keeper_hangs_says_the_zeros_itself(driving, monkeypatch):
    watchdog, _, device = driving
    monkeypatch.setattr(client_module, "EXIT_TIMEOUT_S", 0.5)
    kill, killed = watchdog._process.kill, []

    def kill_later():
        wait(lambda: device.newest(101) == ZERO)  # the keeper cannot have said it
        killed.append(1)
        kill()

    monkeypatch.setattr(watchdog._process, "kill", kill_later)
    os.kill(watchdog._process.pid, signal.SIGSTOP)
    device.log.clear()
    watchdog.close()
    assert killed


AGENT = """
import sys, threading
from scm.clock import WallClock
from vehicle_agent.nigel.watchdog_client import SUSPECT_NS, WatchdogClient
from vehicle_agent.nigel.host import NigelCommand
client, clock, never = WatchdogClient(sys.argv[1], 57600), WallClock(), threading.Event()
while True:
    client.command(NigelCommand(0.5, 0.5), clock.now_ns())
    never.wait(0.02)
"""


@pytest.mark.parametrize("way", [signal.SIGKILL, signal.SIGSTOP])
def test_an_agent_that_is_killed_or_stopped_leaves_zeros(plugged, way):
    agent = subprocess.Popen([sys.executable, "-c", AGENT, str(plugged.path)])
    try:
        wait(lambda: plugged.newest(101) == HALF)
        agent.send_signal(way)
        plugged.log.clear()
        wait(lambda: plugged.newest(101) == ZERO)
    finally:
        agent.kill()
        agent.wait(PATIENCE_S)


class Alone:
    """The agent's end of a line on which only the test speaks."""

    def __init__(self, told):
        self.said, self.killed = [], []
        ours, self.its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ours.setblocking(False)
        self.watchdog = WatchdogClient("x", 57600)
        self.watchdog._socket, self.watchdog._process = (
            ours,
            types.SimpleNamespace(kill=lambda: self.killed.append(1), poll=lambda: None),
        )
        self.watchdog._fallback.write_beside = self.said.append
        self.its.send(msgspec.msgpack.encode(told))
        self.watchdog.command(NigelCommand(), 0)

    def steer(self, turns, at_ns):
        """Steer some turns with hardly any time between them; return the trouble after them."""
        for turn in range(turns):
            self.watchdog.command(NigelCommand(), at_ns + turn)
        return self.watchdog.trouble(at_ns + turns)


@pytest.fixture
def alone():
    made = []

    def make(rest=b"zeros"):
        made.append(Alone(WatchdogReport("ready", "", 1, 0, None, None, rest=rest)))
        return made[-1]

    yield make
    for one in made:
        one.its.close()
        one.watchdog._disconnect()


def test_an_agent_that_stalled_does_not_take_the_keeper_for_silent_or_dead(alone):
    one = alone()
    assert (one.steer(2, 3 * NS_PER_S), one.said, one.killed) == ("", [], [])
    assert "silent" in one.steer(7, 3 * NS_PER_S)
    assert (len(one.said), one.killed) == (7, [])
    one.steer(1, 3 * NS_PER_S)
    assert one.killed == [1]


def test_zeros_are_said_beside_a_keeper_that_left_three_wishes_unanswered(alone):
    one = alone()
    assert one.steer(9, SUSPECT_NS - 9) == ""
    assert "silent" in one.steer(1, SUSPECT_NS + 1)
    assert (one.said, one.killed) == ([b"zeros"], [])


def test_nothing_is_said_to_an_arduino_that_starts_and_could_take_it_for_a_program(alone):
    one = alone(rest=b"")
    one.steer(4, NS_PER_S)
    assert one.said == []
