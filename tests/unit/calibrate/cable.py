"""A Nigel on the published firmware, byte for byte in virtual time, is calibrated by the Eye."""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from scm.clock import NS_PER_MS
from scm.vehicles.car import load_car
from scm.vehicles.car_text import set_entry, set_list, term_names
from tests.unit.calibrate.rig import LIMITS, START, STEP_NS, T0, Eye, Hidden
from vehicle_agent.bodies.nigel import NigelBody
from vehicle_agent.calibrate.fit import TERMS
from vehicle_agent.calibrate.part import CalibrationPart
from vehicle_agent.calibrate.pattern import FULL
from vehicle_agent.emulate.firmware import Firmware
from vehicle_agent.emulate.sketches import SKETCHES
from vehicle_agent.emulate.wheels import Wheels, throttle_of, wheel_angle
from vehicle_agent.nigel.host import REST, Host
from vehicle_agent.nigel.serial_watchdog import Written

LINE_NS = 10 * NS_PER_MS
DEADBAND = 0.2
LONGEST = 9000


@dataclass(frozen=True)
class Emulated:
    """What moves at the end of a cable: a car with numbers of its own, and its firmware."""

    trim: float = 0.0
    gain: float = 1.0
    deadband: float = DEADBAND
    drive: float = 1.0
    rate: float = 0.42
    sketch: str = "2wd"

    @property
    def numbers(self):
        """The line through what the firmware, which rounds, makes of all commands."""
        sketch, limit = SKETCHES[self.sketch], load_car("nigel").value("steering.limit_rad")
        commanded = np.linspace(-1.0, 1.0, 20001)
        angles = [wheel_angle(sketch.steer(sketch.at_setup, u), sketch.at_setup) for u in commanded]
        per, straight = np.polyfit(commanded, np.array(angles) / limit, 1)
        commanded = np.linspace(self.deadband + 0.03, 1.0, 20001)
        duty = [throttle_of(sketch.drive(sketch.at_setup, u), 0.0) for u in commanded]
        of, more = np.polyfit(commanded, duty, 1)
        return {
            "steering.trim_rad": self.trim + self.gain * limit * straight,
            "steering.gain": self.gain * per,
            "drive.deadband": (self.deadband - more) / of,
            "drive.gain": self.drive * of,
            "steering.rate_rad_s": self.rate,
        }

    def wheels(self):
        """The car that the board moves, put down."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "hidden.toml"
            self.write(path)
            made = Wheels(SKETCHES[self.sketch].at_setup, str(path), self.deadband)
        made.place(START, T0)
        return made

    def write(self, path):
        """Write its car file, the dead-band left out: the emulator has it as an argument."""
        car = load_car("nigel")
        text = set_list(car.path.read_text(), "terms", term_names(car.with_terms(TERMS)), "mine")
        own = (("steering", "trim_rad", self.trim), ("steering", "gain", self.gain),
               ("drive", "gain", self.drive), ("drive", "deadband", 0.0),
               ("steering", "rate_rad_s", self.rate))  # fmt: skip
        for section, name, value in own:
            text = set_entry(text, section, name, f'{{ value = {value}, source = "hidden" }}')
        path.write_text(text)


def emulated(seed, sketch="2wd"):
    """An emulated car with hidden numbers of the seed's own."""
    rng = np.random.default_rng(seed)
    return Emulated(
        trim=rng.uniform(-0.06, 0.06),
        gain=rng.uniform(0.8, 1.2),
        deadband=rng.uniform(0.05, 0.25),
        drive=rng.uniform(0.85, 1.15),
        rate=rng.uniform(0.35, 0.5),
        sketch=sketch,
    )


PLAIN = Emulated()


class Line:
    """What a helm is to a body: the host's conversation with the device, and what that moves."""

    def __init__(self, moved=PLAIN):
        sketch = SKETCHES[moved.sketch]
        self.host, self.board = Host(sketch.baud), Firmware(sketch, T0)
        self.wheels = moved.wheels()
        self.host.open(T0)
        self.wish, self.summary, self._now_ns, self._back = REST, None, T0, b""
        self._written = []

    def trouble(self, now_ns):
        return self.host.trouble

    def command(self, wish, now_ns):
        self.wish = wish

    def written(self):
        written, self._written = self._written, []
        return written

    def close(self):
        self.wish = REST

    def run_to(self, now_ns):
        while self._now_ns < now_ns:
            self._now_ns += LINE_NS
            frames = self.host.receive(self._back, self._now_ns)
            frames += self.host.frames_due(self.wish, self._now_ns)
            if said := self.host.commanded:
                self._written.append(Written(self._now_ns, said.throttle, said.steering))
            self._back = self.board.step(self._now_ns, b"".join(frames))
            self.wheels.follow(self.board, self._now_ns)

    @property
    def seen(self):
        """The car as the rig's Eye looks at one."""
        motion = self.wheels.motion()
        return SimpleNamespace(pose=motion.pose, fleet=SimpleNamespace(speed=[motion.speed]))


SHARP = Hidden(late_ms=0.0)


class Street:
    """The part, its body, the line and the Eye, step by step."""

    def __init__(self, car="nigel", moved=PLAIN, eye=SHARP, plan=FULL):
        self.moved, self.line, self.eye = moved, Line(moved), Eye(eye)
        body = NigelBody(load_car(car), self.line, raw=True)
        self.part = CalibrationPart("n7", body, LIMITS, plan=plan)
        self.now_ns, self.said = T0, []

    def step(self, count=LONGEST):
        for _ in range(count):
            self.line.run_to(self.now_ns)
            self.said += self.part.step(self.now_ns, self.eye.look(self.line.seen, self.now_ns))
            if self.part.done.is_set():
                return
            self.now_ns += STEP_NS
