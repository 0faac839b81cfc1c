"""The device behind a true pseudo-terminal, opened by pyserial, in virtual time."""

import logging

import pytest
import serial

from scm.clock import NS_PER_MS
from scm.errors import LinkError
from vehicle_agent.emulate.device import Device
from vehicle_agent.emulate.faults import FaultInjector, read_faults
from vehicle_agent.emulate.firmware import Firmware
from vehicle_agent.emulate.pty import Cable
from vehicle_agent.emulate.sketches import SKETCHES, Outputs
from vehicle_agent.nigel.rosserial import (
    REQUEST_TOPICS,
    Decoder,
    Frame,
    pack,
    pack_float,
    unpack_topic_info,
)

STEP_MS = 5
DRIVE = pack(Frame(101, pack_float(0.4)))


class Desk:
    """A device, its cable and a clock; `port()` is what a host opens."""

    def __init__(self, folder, kind="2wd", faults=()):
        self.link = folder / "nigel"
        self.now_ns = 0
        self.board = Firmware(SKETCHES[kind])
        self.device = Device(self.board, Cable(self.link), FaultInjector(read_faults(faults), 1, 0))
        self.baud = SKETCHES[kind].baud
        self.ports = []

    def port(self, baud=None):
        port = serial.Serial(str(self.link), baud or self.baud, timeout=0)
        self.ports.append(port)
        return port

    def run(self, ms):
        for _ in range(0, ms, STEP_MS):
            self.now_ns += STEP_MS * NS_PER_MS
            self.device.step(self.now_ns)


def read_frames(port, count):
    """Read until so many frames are there: the kernel hands bytes over when it has the time."""
    decoder, frames = Decoder(), []
    port.timeout = 5.0
    while len(frames) < count and (got := port.read()):
        frames += decoder.feed(got, 0)
    return frames


@pytest.fixture
def desk(tmp_path):
    made = []

    def make(*args, **more):
        made.append(Desk(tmp_path, *args, **more))
        return made[-1]

    yield make
    for one in made:
        for port in one.ports:
            port.close()
        one.device.close()


@pytest.mark.parametrize("kind", ["2wd", "4wd"])
def test_a_host_learns_the_topics_and_drives(desk, kind):
    car = desk(kind)
    port = car.port()
    car.run(2100)
    port.write(pack(REQUEST_TOPICS))
    car.run(300)
    frames = read_frames(port, 3)
    assert [frame.topic for frame in frames] == [10, 1, 1]
    infos = [unpack_topic_info(frame.payload) for frame in frames[1:]]
    assert tuple(info.name for info in infos) == SKETCHES[kind].topics
    port.write(DRIVE)
    car.run(30)
    assert car.board.outputs.pwm == 102


def test_opening_the_port_resets_the_board_and_closing_does_not(desk):
    car = desk()
    first = car.port()
    car.run(2100)
    first.write(DRIVE)
    car.run(30)
    first.close()
    car.run(3000)
    assert (car.board.outputs.pwm, car.board.resets) == (102, 1)
    car.port()
    car.run(STEP_MS)
    assert (car.board.outputs, car.board.resets) == (Outputs(), 2)


def test_a_frame_sent_before_closing_is_obeyed(desk):
    car = desk()
    port = car.port()
    car.run(2100)
    port.write(DRIVE)
    port.close()
    car.run(30)
    assert car.board.outputs.pwm == 102


@pytest.mark.parametrize("baud", [9600, 115200, 250000])
def test_at_another_speed_nothing_is_understood_and_it_says_so(desk, caplog, baud):
    car = desk()
    port = car.port(baud)
    with caplog.at_level(logging.WARNING):
        car.run(2100)
        for _ in range(20):
            port.write(DRIVE + pack(REQUEST_TOPICS))
            car.run(50)
    assert car.board.outputs == SKETCHES["2wd"].at_setup
    assert Decoder().feed(port.read(1000), 0) == []
    assert [record.message.split()[0] for record in caplog.records] == ["wrong_baud"]


def test_what_it_says_at_another_speed_is_garbled(desk):
    car = desk()
    port = car.port()
    car.run(2100)
    port.write(pack(REQUEST_TOPICS))
    car.run(STEP_MS)
    port.baudrate = 115200
    car.run(300)
    port.timeout = 5.0
    got = port.read() + port.read(port.in_waiting)
    assert got
    assert Decoder().feed(got, 0) == []


def test_a_pulled_cable_is_an_error_at_the_host_and_comes_back_at_the_same_path(desk):
    car = desk(faults=["unplug@3:2"])
    port = car.port()
    car.run(2100)
    port.write(DRIVE)
    car.run(1000)
    assert not car.link.is_symlink()
    with pytest.raises(serial.SerialException):
        port.write(DRIVE)
    port.close()
    car.run(1500)
    assert car.board.outputs.pwm == 102  # it has power of its own, and nobody told it to stop
    car.run(1000)
    car.port()
    car.run(2100)
    assert car.board.outputs == SKETCHES["2wd"].at_setup


@pytest.mark.parametrize(("fault", "deaf_ms"), [("reset", 2000), ("brownout", 2200)])
def test_a_reset_and_a_brown_out_let_go_of_the_motor_and_are_deaf(desk, fault, deaf_ms):
    car = desk(faults=[f"{fault}@3"])
    port = car.port()
    car.run(2100)
    port.write(DRIVE)
    car.run(890)
    assert car.board.outputs.pwm == 102
    car.run(10)
    assert car.board.outputs == Outputs()
    for _ in range(0, deaf_ms - 50, 50):
        port.write(DRIVE)
        car.run(50)
    assert car.board.outputs == Outputs()
    car.run(100)
    assert car.board.outputs == SKETCHES["2wd"].at_setup


def test_on_a_bad_cable_most_commands_still_come_and_none_is_made_up(desk):
    car = desk(faults=["flip=0.002", "lose=0.002", "cut=0.02", "noise=2"])
    port = car.port()
    car.run(2100)
    sent, seen = set(), []
    for n in range(400):
        pwm = 1 + n % 200
        sent.add(pwm)
        port.write(pack(Frame(101, pack_float((pwm + 0.5) / 255))))
        car.run(20)
        seen.append(car.board.outputs.pwm == pwm)
        assert car.board.outputs.pwm in sent | {0}
    assert 0.75 < sum(seen) / len(seen) < 0.99


def test_a_path_that_is_taken_is_refused_and_an_old_link_replaced(tmp_path):
    taken, old = tmp_path / "taken", tmp_path / "old"
    taken.write_text("")
    with pytest.raises(LinkError, match="got a file that is there already"):
        Cable(taken)
    with pytest.raises(LinkError, match="No such file"):
        Cable(tmp_path / "nowhere" / "nigel")
    old.symlink_to("/dev/pts/gone")
    cable = Cable(old)
    assert str(old.readlink()) == cable.target
    cable.pull()
    assert not old.is_symlink()
