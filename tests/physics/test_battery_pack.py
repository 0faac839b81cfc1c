"""The battery that a simulated car tells of: its balance of charge, its sag, its end."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.geometry import Pose2
from scm.vehicles.battery_pack import CUT_OFF_V, Packs, pack_of
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import plain
from scm.vehicles.lipo import cell_voltage
from tests.every_effect import car_with

HERE = Pose2(0.0, 0.0, 0.0)
ROW = np.array([0])


def driven(car=None, **numbers):
    """Return a nigel with a battery as given, and the packs of its fleet."""
    values = {f"battery.{key}": value for key, value in numbers.items()}
    fleet = Fleet((car or load_car("nigel")).with_terms([], values), 1)
    packs = Packs(fleet)
    packs.renew(fleet.add(HERE))
    return fleet, packs


def test_the_charge_drawn_under_a_constant_load_is_that_of_the_closed_form():
    fleet, packs = driven(start_charge=0.79)
    pack, u, hours, dt = pack_of(fleet.car), 0.8, 0.5, 0.5
    fleet.throttle[0] = u
    for _ in range(round(3600.0 * hours / dt)):
        packs.drain(ROW, dt)
    # Between 0.5 and 0.8 a cell's voltage is a straight line, so the current falls exponentially.
    pull = pack.motor_current * u * u / pack.nominal
    pull /= 1.0 + pack.resistance * pull
    slope = pack.cells * 0.6 / (3600.0 * pack.capacity)
    full = pack.cells * plain(cell_voltage)(pack.start_charge)
    first = pack.idle_current + pull * (full - pack.resistance * pack.idle_current)
    drawn = first / (pull * slope) * -math.expm1(-pull * slope * 3600.0 * hours)
    left = pack.start_charge - drawn / (3600.0 * pack.capacity)
    assert 0.5 < left < 0.7
    assert_allclose(packs.charge[0], left, atol=3e-6)  # Euler's steps of half a second


def test_over_a_drive_ohm_s_law_holds_between_what_is_told_of_voltage_and_charge():
    fleet, packs = driven(start_charge=0.6)
    pack, drawn = pack_of(fleet.car), 0.0
    for step in range(600):
        fleet.throttle[0] = (0.0, 1.0, 0.4, -0.6)[step // 50 % 4]
        fleet.advance(0.02)
        packs.drain(ROW, 0.02)
        rest = pack.cells * plain(cell_voltage)(packs.charge[0])
        drawn += 0.02 * (rest - packs.volts[0]) / pack.resistance
    assert fleet.speed[0] != 0.0
    told = 3600.0 * pack.capacity * (pack.start_charge - packs.charge[0])
    assert_allclose(told, drawn, rtol=1e-5)


def test_the_voltage_sags_under_throttle_and_comes_back():
    fleet, packs = driven()
    pack, rest = pack_of(fleet.car), 12.6
    at_rest = packs.volts[0]
    assert_allclose(at_rest, rest - pack.resistance * pack.idle_current, atol=0.02)
    fleet.throttle[0] = 1.0
    packs.drain(ROW, 0.0)
    current = (rest - packs.volts[0]) / pack.resistance
    stalled = pack.motor_current * packs.volts[0] / pack.nominal
    assert_allclose(current, pack.idle_current + stalled, rtol=0.2)
    fleet.advance(2.0)
    packs.drain(ROW, 0.0)
    assert at_rest - 0.05 < packs.volts[0] < at_rest, "a fast motor draws little"
    fleet.throttle[0] = 0.0
    packs.drain(ROW, 0.0)
    assert packs.volts[0] == at_rest


def test_an_empty_pack_ends_at_its_cut_off_and_nothing_more_is_drawn():
    fleet, packs = driven(start_charge=0.001, resistance_ohm=2.0)
    fleet.throttle[0] = 1.0
    for _ in range(100):
        packs.drain(ROW, 1.0)
        assert packs.volts[0] >= 3 * CUT_OFF_V
        assert packs.charge[0] >= 0.0
    assert (packs.volts[0], packs.charge[0]) == (9.0, 0.0)
    packs.renew(0)
    assert packs.charge[0] == 0.001


def test_each_car_of_a_fleet_drains_its_own_pack_by_its_own_throttle():
    fleet = Fleet(load_car("nigel"), 3)
    packs = Packs(fleet)
    rows = np.array([fleet.add(HERE) for _ in range(3)])
    for row in rows:
        packs.renew(row)
    fleet.throttle[rows] = (0.0, 1.0, 1.0)
    packs.drain(rows[:2], 600.0)
    idle, driven_hard, left_out = 1.0 - packs.charge[rows]
    assert 0.0 == left_out < idle < 0.2 * driven_hard


def test_motors_that_feel_their_battery_count_the_same_charge():
    fleet, packs = driven(car_with(["battery_charge", "battery_curve", "battery_resistance"]))
    for step in range(300):
        fleet.throttle[0] = 1.0 if step < 200 else 0.5
        fleet.advance(0.01)
        packs.drain(ROW, 0.01)
    drawn = 3600.0 * pack_of(fleet.car).capacity * (1.0 - packs.charge[0])
    assert_allclose(drawn, fleet._view("charge_drawn")[0], rtol=5e-3)  # steps of 10 ms and of 1 ms


def test_what_is_told_moves_no_car():
    fleet, packs = driven(start_charge=0.01)
    other = Fleet(load_car("nigel"), 1)
    other.add(HERE)
    for one in (fleet, other):
        one.throttle[0] = 1.0
    for _ in range(50):
        fleet.advance(0.02)
        packs.drain(ROW, 600.0)
        other.advance(0.02)
    assert packs.charge[0] == 0.0
    assert fleet.pose(0) == other.pose(0)


@pytest.mark.parametrize("throttle", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("charge", [0.03, 0.2, 0.45, 1.0])
def test_a_measured_voltage_tells_the_charge_whatever_the_motors_draw(charge, throttle):
    fleet, packs = driven(start_charge=charge)
    fleet.throttle[0] = throttle
    fleet.advance(1.0)
    packs.drain(ROW, 0.0)
    speed = float(fleet.wheel_speed[0, 2:].mean())
    told = pack_of(fleet.car).charge_at(float(packs.volts[0]), throttle, speed)
    assert_allclose(told, charge, atol=1e-9)


def test_a_car_whose_file_tells_of_no_motors_has_no_battery():
    fleet = Fleet(load_car("dart"), 1)
    packs = Packs(fleet)
    packs.renew(fleet.add(HERE))
    packs.drain(ROW, 1.0)
    assert np.isnan([packs.volts[0], packs.charge[0]]).all()
