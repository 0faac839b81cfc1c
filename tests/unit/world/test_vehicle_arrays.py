"""Slots: the lowest number first, nothing of the last car left in them, and a city that is full."""

import pytest

from scm.errors import RunError
from scm.geometry import Pose2
from scm.world.vehicle_arrays import IDLE, Numbers, VehicleArrays

SOMEWHERE = Pose2(1.0, 2.0, 0.5)


def test_numbers_come_back_lowest_first_and_the_forbidden_one_never():
    numbers = Numbers(3, never=(5,))
    taken = [numbers.acquire() for _ in range(4)]
    numbers.release(6)
    numbers.release(4)
    assert taken == [3, 4, 6, 7]
    assert [numbers.acquire() for _ in range(3)] == [4, 6, 8]


def test_a_claimed_number_is_nobody_elses_until_it_is_given_back():
    numbers = Numbers(1, never=(2,))
    assert numbers.claim(3) == 3
    assert [numbers.acquire() for _ in range(3)] == [1, 4, 5]
    numbers.release(3)
    numbers.release(4)
    numbers.claim(4)
    assert [numbers.acquire(), numbers.acquire()] == [3, 6]
    numbers.release(4)
    assert numbers.acquire() == 4


def test_a_number_below_the_first_is_claimed_and_never_given():
    numbers = Numbers(5)
    numbers.release(numbers.claim(2))
    numbers.release(numbers.claim(9))
    assert [numbers.acquire() for _ in range(6)] == [5, 6, 7, 8, 9, 10]


def test_a_slot_is_given_again_clean():
    vehicles = VehicleArrays(2)
    first = vehicles.add("n1", SOMEWHERE, hosted=True)
    vehicles.driven[first] = vehicles.hazard[first] = vehicles.arrived[first] = True
    vehicles.throttle[first], vehicles.mode[first], vehicles.seq[first] = 0.5, 0, 7
    vehicles.remove(first)
    again = vehicles.add("n2", SOMEWHERE, hosted=False)
    assert (again, vehicles.names[again], bool(vehicles.hosted[again])) == (first, "n2", False)
    left = [bool(flags[again]) for flags in (vehicles.driven, vehicles.hazard, vehicles.arrived)]
    assert left == [False, False, False]
    assert (vehicles.throttle[again], vehicles.mode[again], vehicles.seq[again]) == (0.0, IDLE, 0)


def test_a_full_city_takes_nobody_until_somebody_leaves():
    vehicles = VehicleArrays(1)
    vehicles.add("n1", SOMEWHERE, hosted=True)
    with pytest.raises(RunError, match="1 cars"):
        vehicles.add("n2", SOMEWHERE, hosted=True)
    vehicles.remove(0)
    assert vehicles.add("n2", SOMEWHERE, hosted=True) == 0


def test_the_nearest_car_is_looked_for_among_those_that_are_there():
    vehicles = VehicleArrays(3)
    here = Pose2(0.0, 0.0, 0.0)
    assert vehicles.nearest_m(here) == float("inf")
    gone = vehicles.add("n1", Pose2(0.1, 0.0, 0.0), hosted=True)
    vehicles.add("n2", Pose2(3.0, 2.0, 0.0), hosted=False)
    vehicles.remove(gone)
    assert vehicles.nearest_m(here) == 5.0


def test_a_car_that_comes_counts_from_where_it_soon_will_be_and_one_that_goes_does_not():
    vehicles = VehicleArrays(2)
    place = Pose2(1.0, 0.0, 0.0)
    comes = vehicles.add("n1", Pose2(0.4, 0.0, 0.0), hosted=True)
    vehicles.speed[comes] = 0.25
    assert vehicles.nearest_m(place) == pytest.approx(0.6)
    assert vehicles.nearest_m(place, ahead_s=1.5) == pytest.approx(0.6 - 1.5 * 0.25)
    vehicles.speed[comes] = -0.25
    assert vehicles.nearest_m(place, ahead_s=1.5) == pytest.approx(0.6)
    vehicles.speed[comes] = 0.8  # it will have passed by then: it counts from where it is nearest
    assert vehicles.nearest_m(place, ahead_s=1.5) == pytest.approx(0.0, abs=1e-9)
