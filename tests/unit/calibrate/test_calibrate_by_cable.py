"""A real Nigel's body on the published firmware, byte for byte in virtual time, is calibrated."""

from types import SimpleNamespace

import pytest

from scm.clock import NS_PER_MS
from scm.v2x.exchange import Incoming
from scm.vehicles.car import load_car
from tests.unit.calibrate.rig import LIMITS, START, STEP_NS, T0, Eye, Hidden
from tests.unit.test_real_guard import track
from vehicle_agent.bodies.nigel import NigelBody
from vehicle_agent.calibrate.fit import fit
from vehicle_agent.calibrate.part import CalibrationPart
from vehicle_agent.emulate.firmware import Firmware
from vehicle_agent.emulate.sketches import SKETCHES
from vehicle_agent.emulate.wheels import Wheels
from vehicle_agent.nigel.host import REST, Host

LINE_NS = 10 * NS_PER_MS
DEADBAND = 0.2
LONGEST = 9000
STARTS = "the Arduino starts"


class Line:
    """What a helm is to a body: the host's conversation with the device, and what that moves."""

    def __init__(self):
        self.host, self.board = Host(), Firmware(SKETCHES["2wd"], T0)
        self.wheels = Wheels(SKETCHES["2wd"].at_setup, deadband=DEADBAND)
        self.wheels.place(START, T0)
        self.host.open(T0)
        self.wish, self.told, self._now_ns, self._back = REST, None, T0, b""

    def trouble(self, now_ns):
        return self.host.trouble

    def steer(self, wish, now_ns):
        self.wish = wish

    def close(self):
        self.wish = REST

    def run_to(self, now_ns):
        while self._now_ns < now_ns:
            self._now_ns += LINE_NS
            frames = self.host.hear(self._back, self._now_ns)
            frames += self.host.say(self.wish, self._now_ns)
            self._back = self.board.step(self._now_ns, b"".join(frames))
            self.wheels.advance(self.board.outputs, self._now_ns)

    @property
    def seen(self):
        """The car as the rig's Eye looks at one."""
        motion = self.wheels.motion()
        return SimpleNamespace(pose=motion.pose, fleet=SimpleNamespace(speed=[motion.speed]))


class Street:
    """The part, its body, the line and the Eye, step by step."""

    def __init__(self, car="nigel"):
        self.line, self.eye = Line(), Eye(Hidden(late_ms=0.0))
        body = NigelBody(load_car(car), self.line, raw=True)
        self.part = CalibrationPart("n7", body, LIMITS)
        self.now_ns, self.said = T0, []

    def step(self, count=LONGEST):
        for _ in range(count):
            self.line.run_to(self.now_ns)
            self.said += self.part.step(self.now_ns, self.eye.look(self.line.seen, self.now_ns))
            if self.part.done.is_set():
                return
            self.now_ns += STEP_NS


def test_the_dead_band_of_an_emulated_nigel_is_found_through_its_cable():
    street = Street()
    street.step()
    assert street.part.done.is_set()
    found = fit(load_car("nigel"), *street.part.recorded.arrays()).numbers
    assert found["drive.deadband"].value == pytest.approx(DEADBAND, abs=0.004)
    assert found["drive.gain"].value == pytest.approx(1.0, abs=0.015)
    assert found["steering.gain"].value == pytest.approx(1.0, abs=0.02)


def test_a_dead_band_that_its_file_has_already_is_not_undone_while_it_is_measured(tmp_path):
    path = tmp_path / "car.toml"
    plain = load_car("nigel").path.read_text(encoding="utf-8")
    known = 'deadband = { value = 0.2, std = 0.02, source = "a guess" }'
    path.write_text(plain.replace("\n[drive]", f"\n[drive]\n{known}\n#"), encoding="utf-8")
    assert load_car(path).value("drive.deadband") == DEADBAND
    street = Street(path)
    told = []
    for _ in range(300):
        street.step(1)
        told.append((street.line.wish.throttle, street.line.wish.steering))
    assert max(abs(throttle) for throttle, _ in told) == pytest.approx(0.3)
    assert [row[1:] for row in street.part.recorded.command] == told[-len(
        street.part.recorded.command):]  # fmt: skip


def test_it_waits_while_the_cable_is_in_trouble_and_says_why():
    street = Street()
    street.step(50)
    assert street.said[-1].detail.startswith(f"calibrates: waits ({STARTS})")
    street.step(250)
    assert street.line.wish.throttle != 0.0
    before = street.part._pattern.progress
    street.line.host.open(street.now_ns)
    street.step(100)
    assert street.line.wish == REST
    assert street.said[-1].detail.startswith(f"calibrates: waits ({STARTS})")
    assert street.part.recorded.command[-1][1:] == (0.0, 0.0)
    assert street.part._pattern.progress == before


def test_a_car_that_is_carried_away_rests_and_begins_another_leg():
    street = Street()
    street.step(200)
    assert street.line.wish.throttle != 0.0
    pose, now_ns = street.line.wheels.motion().pose, street.now_ns
    before = street.part._pattern.progress
    street.part.step(now_ns, [Incoming(track(now_ns, pose.x, pose.y - 0.4), now_ns)])
    assert street.line.wish.throttle == 0.0
    street.line.wheels.place(START, now_ns)
    street.step(35)  # its leg would not have ended yet
    assert street.part._pattern.progress > before
