"""Least times follow from the car files of the fleet, the worst of each."""

import math
import subprocess
import sys

import pytest

from scm.errors import CarError, PlanError
from scm.traffic.car_facts import facts_of, slowest_of
from scm.traffic.signals.timing import NIGEL, CarFacts, clearance_s, yellow_s


def test_the_nominal_car_is_what_the_defaults_say():
    nigel = facts_of("nigel")
    assert nigel.speed_mps == pytest.approx(NIGEL.speed_mps, abs=1e-3)
    assert nigel.slow_mps == pytest.approx(NIGEL.slow_mps, abs=1e-3)
    assert nigel.length_m == pytest.approx(NIGEL.length_m)
    assert nigel.reaction_s == NIGEL.reaction_s


def test_a_car_without_a_table_drives_as_the_lane_allows():
    car = facts_of("f1tenth")
    assert math.isinf(car.speed_mps)
    assert car.length_m == pytest.approx(0.5)
    assert yellow_s(car, 0.25) == pytest.approx(0.3 + 1.1 * 0.25)
    with pytest.raises(PlanError, match="neither"):
        yellow_s(car)


def test_a_fleet_is_as_bad_as_its_worst_in_everything():
    fleet = slowest_of([facts_of("nigel"), facts_of("f1tenth")])
    assert fleet.length_m == pytest.approx(0.5)
    assert fleet.slow_mps == pytest.approx(NIGEL.slow_mps, abs=1e-3)
    assert clearance_s(fleet, 1.0, 0.25) > clearance_s(NIGEL, 1.0, 0.25)
    with pytest.raises(CarError, match="at least one"):
        slowest_of([])


def test_a_delay_in_the_file_is_waited_for(tmp_path):
    path = tmp_path / "late.toml"
    path.write_text(
        "[body]\nfootprint_x_m = { value = [-0.1, 0.2] }\n[drive]\ndelay_s = { value = 0.2 }\n"
    )
    assert facts_of(str(path)).reaction_s == pytest.approx(NIGEL.reaction_s + 0.2)
    assert facts_of(str(path)) == CarFacts(math.inf, math.inf, reaction_s=0.5, length_m=0.1 + 0.2)


def test_what_is_no_car_is_refused(tmp_path):
    with pytest.raises(CarError, match="did you mean 'nigel'"):
        facts_of("nigle")
    path = tmp_path / "flat.toml"
    path.write_text("[body]\n")
    with pytest.raises(CarError, match="footprint_x_m"):
        facts_of(str(path))


def test_the_traffic_process_needs_no_compiler():
    code = (
        "import sys, scm.traffic.signals.part, scm.traffic.car_facts; print('numba' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
