"""A green goes on for cars that come while that costs those who wait less than ending it."""

import pytest

from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.traffic.signals.detectors import Detector, JunctionDetectors, reach_of
from scm.traffic.signals.green_extension import is_worth_waiting
from scm.traffic.signals.guaranteed_time import GREEN_NOTICE_NS
from scm.traffic.signals.kernel import GroupState, GroupTimes, Phase, Program
from scm.traffic.signals.policies import max_pressure
from scm.traffic.signals.policy import JunctionView, site_of
from scm.traffic.signals.program import STEP_NS, program_of
from scm.traffic.signals.timing import NIGEL, CarFacts, headway_s, min_green_s

S = 10 * STEP_NS
TIMES = GroupTimes(3 * S, S, 4 * S)  # red that follows: 5 s of change, the other's turn, 5 s
TWO = Program(("a", "b"), (TIMES, TIMES), frozenset((frozenset("ab"),)))
SITE = site_of("x", TWO)


def cars(*arrivals_s, standing=0):
    near = len(arrivals_s) + standing
    return Detector(call=near > 0, near=near, queue=standing, arrivals_s=arrivals_s)


def view(a, b, green_ns=9 * S):
    state = (GroupState(Phase.GREEN, green_ns), GroupState(Phase.RED))
    return JunctionView(0, STEP_NS, state, {"a": a, "b": b}, sees=True)


def goes_on(a, b):
    return is_worth_waiting(SITE, 0, view(a, b))


def test_a_car_that_is_soon_there_is_waited_for_and_a_far_one_is_not():
    assert goes_on(cars(5.0), cars(standing=1))
    assert not goes_on(cars(9.0), cars(standing=1))
    assert not goes_on(cars(5.0), cars(standing=4))


def test_a_far_car_is_waited_for_while_the_others_are_still_on_their_way():
    assert goes_on(cars(9.0), cars(13.5))


def test_nobody_is_waited_for_who_passes_within_what_is_promised():
    promised_s = GREEN_NOTICE_NS / S
    assert not goes_on(cars(promised_s - 0.2), cars(standing=1))
    assert goes_on(cars(promised_s + 0.2), cars(standing=1))
    assert not goes_on(cars(), cars(standing=1))


def test_a_queue_that_sets_off_is_let_go_car_by_car():
    assert goes_on(cars(standing=1), cars(standing=3))
    assert goes_on(cars(standing=3), cars(standing=4))


def test_several_cars_are_worth_a_longer_wait_than_one():
    assert not goes_on(cars(6.0), cars(standing=2))
    assert goes_on(cars(6.0, 6.5, 7.0), cars(standing=2))


def test_the_headway_is_what_one_more_car_of_a_queue_takes():
    more_s = min_green_s(NIGEL, 1.0, queue=3) - min_green_s(NIGEL, 1.0, queue=2)
    assert headway_s(NIGEL, 1.0) == pytest.approx(more_s)
    assert headway_s(CarFacts(length_m=0.6)) > SITE.headway_s
    assert site_of("x", TWO, car=CarFacts(length_m=0.6)).headway_s > SITE.headway_s


def test_max_one_counts_what_is_promised_when_a_green_is_ended():
    assert SITE.layout.phases[0].max1 + GREEN_NOTICE_NS == 3 * TIMES.min_green


@pytest.mark.parametrize(("green_s", "stays"), [(5, True), (7, True), (8, False)])
def test_max_pressure_lets_a_queue_go_before_it_turns_to_a_longer_one_up_to_max_one(green_s, stays):
    memory = max_pressure.Memory(frozenset("a"), green_s * S - STEP_NS, (0, 0))
    _, answer = max_pressure.step(SITE, memory, view(cars(standing=3), cars(standing=5)))
    assert answer.groups == frozenset("a" if stays else "b")


def test_a_car_is_known_from_where_it_comes_just_when_the_others_green_is_over():
    city = load_map("grid:3x3")
    roads, junction = Roads(city), city.junctions[4]
    program = program_of(junction, roads)
    reach_m = reach_of(program, roads)
    change_s = max(t.yellow + t.clearance for t in program.times) / 1e9
    assert reach_m >= 0.25 * (change_s + 2.0)
    for reach in (reach_m, 1.5):
        approaches = {a.line.lane: a for a in JunctionDetectors(junction, roads, reach).approaches}
        approach = next(iter(approaches.values()))
        farthest = max(s.to_line_m - s.from_m for s in approach.before)
        assert farthest == pytest.approx(reach)
