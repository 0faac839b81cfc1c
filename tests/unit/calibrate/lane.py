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
from scm.vehicles.car import load_car
from tests.unit.calibrate.cable import SHARP, Emulated, Line, Street
from tests.unit.calibrate.rig import STEP_NS, T0, Eye
from vehicle_agent.actuation import real_guard
from vehicle_agent.bodies.nigel import NigelBody
from vehicle_agent.body import Wiring
from vehicle_agent.calibrate.car_file import write_car
from vehicle_agent.calibrate.fit import fit
from vehicle_agent.emulate.part import place_of
from vehicle_agent.session import CitySession

LASTS_S = 70
MOVES_MPS = 0.02
MOVED = Emulated(trim=0.05, gain=0.9, drive=0.85)


def calibrated(path):
    """Calibrate the car, and write what was found."""
    street = Street(moved=MOVED)
    street.step()
    found = fit(load_car("nigel"), *street.part.recorded.arrays())
    for key, one in found.numbers.items():
        print(f"| {key} | {one.value:.4f} | {one.low:.4f} to {one.high:.4f} |")
    write_car(load_car("nigel"), found, path, "lane")


def distances(known):
    """Drive the car by what is known of it; return distances from the middle [m], (n,)."""
    city_map = load_map("proving_ground")
    lanes, line, eye = Roads(city_map).lanes, Line(MOVED), Eye(SHARP)
    pose = place_of(city_map, "")
    line.wheels.place(pose, T0)
    body = NigelBody(load_car(known), line)
    body.place(pose, T0)
    stay = CitySession(
        "n7", "nigel", body, city_map, 1, T0, real_guard(body.limits, city_map, Wiring())
    )
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
        found = Path(folder) / "car.toml"
        calibrated(found)
        for name, known in (("uncalibrated", "nigel"), ("calibrated", found)):
            mm = 1000.0 * distances(known)
            print(f"| {name} | mean {mm.mean():.1f} mm | largest {mm.max():.1f} mm |")


if __name__ == "__main__":
    main()
