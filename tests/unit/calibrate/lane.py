"""What calibration is worth on a lane: `python -m tests.unit.calibrate.lane`.

An emulated Nigel with hidden numbers is calibrated through its cable, then drives round the Proving
Ground by the Eye, in virtual time. Prints what was found, and for each car file how far the rear
axle was from the lane's middle while the car moved.
"""

import tempfile
from pathlib import Path

import numpy as np

from scm.clock import NS_PER_S
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.mismatch.report.own_files import listed_terms
from scm.mismatch.report.toml_text import set_entry, set_list
from scm.vehicles.car import load_car
from tests.unit.calibrate.rig import START, STEP_NS, T0, Eye, Hidden
from tests.unit.calibrate.test_calibrate_by_cable import DEADBAND, Line, Street
from vehicle_agent.bodies.nigel import NigelBody
from vehicle_agent.body import Wiring
from vehicle_agent.calibrate.car_file import write_car
from vehicle_agent.calibrate.fit import fit
from vehicle_agent.emulate.part import place_of
from vehicle_agent.emulate.sketches import SKETCHES
from vehicle_agent.emulate.wheels import Wheels
from vehicle_agent.last_word import real_guard
from vehicle_agent.stay import Stay

LASTS_S = 70
MOVES_MPS = 0.02
TERMS = ("steer_trim", "steer_gain", "drive_gain")
HIDDEN = (("steering", "trim_rad", 0.05), ("steering", "gain", 0.9), ("drive", "gain", 0.85))


def hidden_car(path):
    """Write the file of the car that the cable moves."""
    car = load_car("nigel")
    text = set_list(car.path.read_text(), "terms", listed_terms(car.with_terms(TERMS)), "hidden")
    for section, name, value in HIDDEN:
        text = set_entry(text, section, name, f'{{ value = {value}, source = "hidden" }}')
    path.write_text(text)


def put(line, car, pose):
    """Let the cable move such a car, from there."""
    line.wheels = Wheels(SKETCHES["2wd"].at_setup, str(car), DEADBAND)
    line.wheels.place(pose, T0)


def calibrated(hidden, path):
    """Calibrate the hidden car, and write what was found."""
    street = Street()
    put(street.line, hidden, START)
    street.step()
    found = fit(load_car("nigel"), *street.part.recorded.arrays())
    for key, one in found.numbers.items():
        print(f"| {key} | {one.value:.4f} | {one.low:.4f} to {one.high:.4f} |")
    write_car(load_car("nigel"), found, path, "lane")


def distances(hidden, known):
    """Drive the hidden car by what is known of it; return distances from the middle [m], (n,)."""
    city_map = load_map("proving_ground")
    lanes, line, eye = Roads(city_map).lanes, Line(), Eye(Hidden(late_ms=0.0))
    pose = place_of(city_map, "")
    put(line, hidden, pose)
    body = NigelBody(load_car(known), line)
    body.place(pose, T0)
    stay = Stay("n7", "nigel", body, city_map, 1, T0, real_guard(body.limits, city_map, Wiring()))
    out = []
    for now_ns in range(T0 + STEP_NS, T0 + LASTS_S * NS_PER_S, STEP_NS):
        line.run_to(now_ns)
        for item in eye.look(line.seen, now_ns):
            stay.see(item.message, now_ns)
        stay.step(now_ns, 1)
        is_at = line.wheels.motion()
        if is_at.speed > MOVES_MPS:
            beside = [lane.project(is_at.pose.x, is_at.pose.y)[1] for lane in lanes.values()]
            out.append(min(map(abs, beside)))
    return np.array(out)


def main():
    with tempfile.TemporaryDirectory() as folder:
        hidden, found = Path(folder) / "hidden.toml", Path(folder) / "car.toml"
        hidden_car(hidden)
        calibrated(hidden, found)
        for name, known in (("uncalibrated", "nigel"), ("calibrated", found)):
            mm = 1000.0 * distances(hidden, known)
            print(f"| {name} | mean {mm.mean():.1f} mm | largest {mm.max():.1f} mm |")


if __name__ == "__main__":
    main()
