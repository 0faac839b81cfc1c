"""A bank makes all cars' readings: at their rates, late, noisy, sometimes lost, each by itself."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from scm.clock import NS_PER_MS, NS_PER_S
from scm.vehicles.bank import Bank
from scm.vehicles.car import load_car
from scm.vehicles.external_vehicles import ExternalVehicles
from scm.vehicles.sensor import Device, Sensor

TICK = 20 * NS_PER_MS
NIGEL = load_car("nigel")
QUIET = Device(rate_hz=50.0)


def sensor_of(device):
    """Return a device of three values that reads x, y and yaw."""

    def measure(car, truth, rows, around):
        return np.column_stack((truth.x[rows], truth.y[rows], truth.yaw[rows]))

    return Sensor("made_up", ("x", "y", "yaw"), ("body.mass_kg",), lambda car: device, measure)


def placed(count=8):
    truth = ExternalVehicles(count)
    truth.x[:] = 1.5 + np.arange(count)
    truth.y[:] = -2.25
    return truth


def filled(device, cars=("ann",), seed=1, offset=0.0):
    bank, truth = Bank(sensor_of(device), seed), placed(len(cars))
    for slot, name in enumerate(cars):
        bank.fit(slot, name, NIGEL, truth, slot, 0, offset)
    return bank


def run(bank, seconds=1.0, tick=TICK, start=0):
    """Return (now, readings) of every step."""
    steps = range(start, start + round(seconds * NS_PER_S), tick)
    return [(now, readings) for now in steps for readings in bank.step(now)]


def values_of(bank, slot=0, **how):
    return np.array(
        [r.values[list(r.indices).index(slot)] for _, r in run(bank, **how) if slot in r.indices]
    )


def test_without_noise_a_reading_is_the_truth():
    (first, *_) = run(filled(QUIET))
    assert_array_equal(first[1].values, [[1.5, -2.25, 0.0]])


@pytest.mark.parametrize("rate", [1.0, 7.0, 50.0])
def test_a_device_keeps_its_rate(rate):
    assert len(run(filled(Device(rate)), seconds=10)) == round(10 * rate)


def test_a_device_faster_than_the_tick_reads_once_a_tick():
    assert len(run(filled(Device(100.0)))) == 50


def test_an_instant_that_no_step_came_near_is_not_made_up_for():
    bank = filled(Device(10.0))
    times = [0, 990 * NS_PER_MS, 995 * NS_PER_MS, NS_PER_S]
    assert [len(bank.step(now)) for now in times] == [1, 1, 0, 1]


def test_latency_delays_a_reading_but_not_its_time_stamp():
    now, reading = run(filled(Device(5.0, latency_s=0.04)))[0]
    assert (reading.t_ns, now) == (0, 40 * NS_PER_MS)


def test_latency_beyond_a_period_loses_nothing_and_keeps_the_order():
    out = run(filled(Device(10.0, latency_s=0.5)), seconds=2)
    assert [r.t_ns for _, r in out] == [i * NS_PER_S // 10 for i in range(15)]


def test_the_offset_moves_the_first_reading_within_its_period():
    assert run(filled(Device(5.0), offset=0.5))[0][1].t_ns == 100 * NS_PER_MS


def test_one_step_returns_all_cars_of_a_file_together_by_slot():
    (_, readings), *_ = run(filled(QUIET, ("ann", "bob", "cid")))
    assert_array_equal(readings.indices, [0, 1, 2])
    assert_array_equal(readings.values[:, 0], [1.5, 2.5, 3.5])


def test_cars_of_two_truths_come_out_apart():
    bank = filled(QUIET)
    bank.fit(5, "far", NIGEL, placed(), 7, 0)
    assert [(list(r.indices), r.values[0, 0]) for r in bank.step(0)] == [([0], 1.5), ([5], 8.5)]


def test_a_car_reads_the_same_alone_in_company_and_in_any_slot():
    device = Device(50.0, noise=(0.1,), drop_out=0.3, walk=(0.1,))
    alone = values_of(filled(device, ("ann",)), seconds=3)
    bank, truth = Bank(sensor_of(device), 1), placed(1)
    for slot, name in ((3, "zoe"), (70, "ann"), (1, "bob")):
        bank.fit(slot, name, NIGEL, truth, 0, 0)
    bank.step(0)
    bank.unfit(3)
    bank.fit(3, "yul", NIGEL, truth, 0, 0)
    bank = bank_again = Bank(sensor_of(device), 1)
    for slot, name in ((3, "zoe"), (70, "ann"), (1, "bob")):
        bank_again.fit(slot, name, NIGEL, truth, 0, 0)
    assert_array_equal(values_of(bank, slot=70, seconds=3), alone)


def test_one_seed_one_noise_and_another_car_or_seed_other_noise():
    device = Device(50.0, noise=(0.1,))
    first, again = values_of(filled(device)), values_of(filled(device))
    assert_array_equal(first, again)
    assert (values_of(filled(device, seed=2)) != first).all()
    assert (values_of(filled(device, ("bob",))) != first).all()


def test_noise_has_the_spread_of_each_value():
    values = values_of(filled(Device(50.0, noise=(0.1, 0.4, 0.0))), seconds=60)
    # 3000 readings: the spread is known to 1.3 % (one sigma).
    assert np.std(values, axis=0) == pytest.approx([0.1, 0.4, 0.0], rel=0.06)


def test_drop_out_loses_its_share_of_readings():
    got = len(run(filled(Device(50.0, drop_out=0.25)), seconds=60))
    assert got == pytest.approx(0.75 * 3000, rel=0.05)


def test_a_bias_is_added_and_wanders_like_the_root_of_time():
    names = [f"car{i}" for i in range(400)]
    device = Device(1.0, bias=(10.0, 0.0, 0.0), walk=(0.0, 0.2, 0.0))
    bank, truth = Bank(sensor_of(device), 1), ExternalVehicles(1)
    for slot, name in enumerate(names):
        bank.fit(slot, name, NIGEL, truth, 0, 0)
    bank.step(0)
    late = bank.step(100 * NS_PER_S)[0].values
    assert_array_equal(late[:, 0], 10.0)
    assert_array_equal(late[:, 2], 0.0)
    # 400 cars: the spread is known to 3.5 % (one sigma).
    assert np.std(late[:, 1]) == pytest.approx(0.2 * np.sqrt(100), rel=0.15)


def test_unwanted_readings_are_skipped_without_changing_later_noise():
    device = Device(10.0, noise=(0.1,), drop_out=0.2, walk=(0.1,))
    whole = {r.t_ns: r.values for _, r in run(filled(device), seconds=6)}
    bank = filled(device)
    bank.wanted[0] = False
    assert run(bank, seconds=3.05) == []
    bank.wanted[0] = True
    rest = run(bank, seconds=2.9, start=3100 * NS_PER_MS)
    assert {r.t_ns for _, r in rest} == {t for t in whole if t >= 3100 * NS_PER_MS}
    for _, readings in rest:
        assert_array_equal(readings.values, whole[readings.t_ns])


def test_becoming_wanted_waits_for_the_next_instant_of_the_schedule():
    bank = filled(Device(1.0))
    bank.wanted[0] = False
    run(bank, seconds=0.5)
    bank.wanted[0] = True
    assert run(bank, start=NS_PER_S // 2)[0][0] == NS_PER_S


def test_readings_in_transit_are_dropped_with_their_car():
    bank = filled(Device(5.0, latency_s=0.04), ("ann", "bob"))
    bank.step(0)
    bank.unfit(0)
    bank.fit(0, "eve", NIGEL, placed(), 0, TICK)
    out = bank.step(2 * TICK)
    assert [list(r.indices) for r in out] == [[1]]


def test_a_car_whose_file_describes_no_device_gets_none():
    sensor = Sensor("made_up", ("x",), ("sonar.rate_hz",), lambda car: QUIET, lambda *a: a)
    bank = Bank(sensor, 0)
    assert not bank.fit(0, "ann", NIGEL, placed(), 0, 0)
    assert not bank.is_fitted(0)
    assert bank.step(0) == []


def test_readings_are_limited_after_noise_then_rounded():
    device = Device(50.0, noise=(5.0,), saturates_at=(3.0,), quantum=0.5)
    values = values_of(filled(device), seconds=5)
    assert values.max() == 3.0
    assert values.min() == -3.0
    assert_array_equal(values % 0.5, 0.0)


def test_what_noise_carries_beyond_the_range_is_a_miss():
    device = Device(50.0, noise=(1.0,), seen=(0.0, 2.0))
    values = values_of(filled(device), seconds=20)
    assert np.isinf(values).any()
    assert values[np.isfinite(values)].max() <= 2.0
    assert values.min() >= 0.0


def test_angles_are_wrapped_after_noise():
    bank, truth = Bank(sensor_of(Device(50.0, noise=(0.5,), angles=(2,))), 0), placed(1)
    truth.yaw[0] = np.pi
    bank.fit(0, "ann", NIGEL, truth, 0, 0)
    yaw = values_of(bank, seconds=5)[:, 2]
    assert (np.abs(yaw) <= np.pi).all()
    assert 0.3 < np.mean(yaw < 0.0) < 0.7


def test_a_quantum_rounds_towards_minus_infinity():
    assert_array_equal(values_of(filled(Device(50.0, quantum=1.0)))[0], [1.0, -3.0, 0.0])


def test_slots_grow_and_what_was_fitted_stays():
    bank = filled(QUIET)
    bank.fit(1000, "far", NIGEL, placed(), 3, 0)
    assert [r.values[0, 0] for r in bank.step(0)] == [1.5, 4.5]


def test_readings_under_way_are_bounded_by_the_latency():
    bank = filled(Device(50.0, latency_s=0.2))
    run(bank, seconds=20)
    assert len(bank._models[0].under_way) <= 0.2 * 50 + 1
