"""A real Nigel's body on the published firmware, byte for byte in virtual time, is calibrated."""

import math

import pytest

from scm.v2x.exchange import Incoming
from scm.vehicles.car import load_car
from tests.unit.calibrate.cable import DEADBAND, PLAIN, Emulated, Street
from tests.unit.calibrate.rig import START
from tests.unit.test_real_guard import track
from vehicle_agent.calibrate.fit import fit
from vehicle_agent.calibrate.pattern import SHORT
from vehicle_agent.nigel.host import REST

STARTS = "the Arduino starts"
DEGREE = math.radians(1.0)


NEAR = {
    "steering.trim_rad": 0.0025,
    "steering.gain": 0.012,
    "drive.deadband": 0.003,
    "drive.gain": 0.006,
    "steering.rate_rad_s": 0.01,
}


def test_a_nigel_is_found_through_its_cable_and_what_its_firmware_cuts_off_too():
    street = Street()
    street.step()
    assert street.part.done.is_set()
    found = fit(load_car("nigel"), *street.part.recorded.arrays()).numbers
    assert PLAIN.numbers["steering.trim_rad"] == pytest.approx(-0.5 * DEGREE, abs=0.1 * DEGREE)
    assert PLAIN.numbers["drive.deadband"] == pytest.approx(DEADBAND - 0.3 / 255, abs=1e-4)
    for key, truth in PLAIN.numbers.items():
        assert abs(found[key].value - truth) < NEAR[key], key
        assert abs(found[key].value - truth) < 4.0 * found[key].std, key


def test_a_dead_band_that_its_file_has_already_is_not_undone_while_it_is_measured(tmp_path):
    path = tmp_path / "car.toml"
    plain = load_car("nigel").path.read_text(encoding="utf-8")
    known = 'deadband = { value = 0.2, std = 0.02, source = "a guess" }'
    path.write_text(plain.replace("\n[drive]", f"\n[drive]\n{known}\n#"), encoding="utf-8")
    assert load_car(path).value("drive.deadband") == DEADBAND
    street = Street(path)
    commanded = []
    for _ in range(300):
        street.step(1)
        commanded.append((street.line.wish.throttle, street.line.wish.steering))
    assert 0.28 < max(abs(throttle) for throttle, _ in commanded) <= 0.3
    assert {row[1:] for row in street.part.recorded.command} <= {(0.0, 0.0), *commanded}
    assert max(row[1] for row in street.part.recorded.command) > 0.28


def test_legs_begin_late_and_end_at_once_on_the_line_and_yet_the_gain_is_right():
    street = Street(moved=Emulated(drive=0.95), plan=SHORT)
    street.step()
    found = fit(load_car("nigel"), *street.part.recorded.arrays()).numbers["drive.gain"]
    truth = street.moved.numbers["drive.gain"]
    assert abs(found.value - truth) < 0.004  # by the times of wishes it came out 0.007 too small
    assert found.low <= truth <= found.high


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
    silent_s = street.part.recorded.at(street.now_ns) - street.part.recorded.command[-1][0]
    assert silent_s > 1.9  # nothing was written, so nothing is known: no leg of this time counts
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
