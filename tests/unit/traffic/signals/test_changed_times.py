"""Signals follow the cars' versions in force: never shorter than given by hand, and back again."""

import math
import random

import pytest

from scm.maps.load import load_map
from scm.records.signal_plans import SignalStage
from scm.records.twins import TwinParameter, TwinVersion
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.changed_cars import MAX_FACTOR, ChangedCars
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.controller_state import Timing
from scm.traffic.signals.custom_plans import table_of
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.part import TrafficPart
from scm.traffic.signals.plan import load_timetable, plan_names
from scm.traffic.signals.program import STEP_NS as S
from scm.traffic.signals.timing import NIGEL
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanRequest
from scm.v2x.messages.signal_site import SignalSite
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.twin_status import TwinStatus

MAP = load_map("driving_school")
CONFLICTS = frozenset({frozenset("ab"), frozenset("bc"), frozenset("ac")})
SHORT = Program(
    ("a", "b", "c"),
    (GroupTimes(29 * S, 6 * S, 46 * S), GroupTimes(20 * S, 6 * S, 30 * S), GroupTimes(S, S, S)),
    CONFLICTS,
)
LONG = SHORT._replace(
    times=(
        GroupTimes(35 * S, 9 * S, 60 * S),
        GroupTimes(22 * S, 9 * S, 40 * S),
        GroupTimes(S, S, S),
    )
)


def timing(program):
    tables = {name: (load_timetable(name, program), None) for name in plan_names()}
    return Timing(program, tables, NIGEL)


def ability(name, low, value, high, before):
    return TwinParameter(name=name, value=value, low=low, high=high, before=before)


def version(number, *abilities, after=0):
    return TwinVersion(
        number=number, car="nigel", file=f"{number}.toml", made_ns=1, state="adopted", after=after,
        abilities=abilities,
    )  # fmt: skip


def status(*versions, vehicle="n3", number=None):
    return TwinStatus(
        vehicle=vehicle, t_ns=0, car="nigel", state="watching", driven_s=1.0, versions=versions,
        version=versions[-1].number if number is None else number,
    )  # fmt: skip


LONG_STOP = ability("stopping_m", 0.08, 0.09, 0.10, 0.007)
SLOW = ability("cruise_mps", 0.16, 0.17, 0.18, 0.217)
ORIGINAL = version(0)


class TestFactsOfChangedCars:
    def worst(self, *statuses):
        cars = ChangedCars(NIGEL)
        for one in statuses:
            cars.receive(one)
        return cars

    def test_longer_way_to_stop_counts_as_later_reaction_at_the_slowest_speed(self):
        facts = self.worst(status(version(1, LONG_STOP, SLOW))).worst
        assert facts.reaction_s == pytest.approx(0.3 + (0.10 - 0.007) / 0.16)
        assert facts.slow_mps == 0.16
        assert facts.speed_mps == NIGEL.speed_mps

    def test_faster_car_is_as_much_faster_at_full_throttle(self):
        faster = ability("cruise_mps", 0.22, 0.23, 0.24, 0.2)
        assert self.worst(status(version(1, faster))).worst.speed_mps == pytest.approx(0.267 * 1.2)

    def test_way_before_is_that_of_the_first_version(self):
        later = version(2, ability("stopping_m", 0.10, 0.11, 0.12, 0.09), after=1)
        facts = self.worst(status(version(1, LONG_STOP), later)).worst
        assert facts.reaction_s == pytest.approx(0.3 + (0.12 - 0.007) / 0.217)

    def test_no_version_makes_a_fact_better_than_given_by_hand(self):
        better = [
            ability("stopping_m", 0.001, 0.002, 0.003, 0.007),
            ability("cruise_mps", 0.5, 0.6, 0.7, 0.8),
        ]
        assert self.worst(status(version(1, *better))).worst == NIGEL

    @pytest.mark.parametrize("number", [math.nan, -1.0, math.inf, -math.inf])
    @pytest.mark.parametrize("field", ["low", "value", "high"])
    def test_nonsense_is_named_and_not_followed(self, number, field):
        numbers = {"low": 0.1, "value": 0.2, "high": 0.3} | {field: number}
        cars = ChangedCars(NIGEL)
        wrong = [TwinParameter(name=n, before=0.2, **numbers) for n in ("stopping_m", "cruise_mps")]
        assert "stopping_m: got" in cars.receive(status(version(1, *wrong)))
        assert cars.worst == NIGEL
        assert cars.receive(status(version(1, *wrong))) == ""

    def test_huge_values_and_odd_befores_stay_within_the_largest_factor(self):
        for before in (math.nan, -1.0, 0.0, 1e-300, math.inf):
            huge = [ability(n, 1e-9, 1.0, 1e300, before) for n in ("stopping_m", "cruise_mps")]
            facts = self.worst(status(version(1, *huge))).worst
            assert facts.slow_mps == pytest.approx(NIGEL.slow_mps / MAX_FACTOR)
            assert NIGEL.speed_mps <= facts.speed_mps <= MAX_FACTOR * NIGEL.speed_mps
            assert NIGEL.reaction_s <= facts.reaction_s <= MAX_FACTOR * NIGEL.reaction_s

    def test_version_that_is_not_listed_changes_nothing(self):
        cars = self.worst(status(version(1, SLOW)), status(version(1, SLOW), number=7))
        assert cars.worst.slow_mps == 0.16

    def test_worst_is_of_all_cars_and_goes_with_them(self):
        slower = ability("cruise_mps", 0.12, 0.13, 0.14, 0.217)
        cars = self.worst(
            status(version(1, SLOW)), status(version(1, slower, LONG_STOP), vehicle="n5")
        )
        assert cars.worst.slow_mps == 0.12
        assert cars.why(["slow_mps"]) == "n5 may drive only 0.12 m/s at 0.8 of its throttle"
        cars.leave("n5")
        assert cars.worst.slow_mps == 0.16
        cars.enter("n5")
        assert cars.worst.slow_mps == 0.12
        cars.receive(status(ORIGINAL, version(1, slower), vehicle="n5", number=0))
        assert cars.worst.slow_mps == 0.16


class Guarantees:
    """Checks each sample against what was guaranteed before, and how long colours were shown."""

    def __init__(self):
        self.last, self.shown_s, self.count = {}, {"yellow": set(), "red": set()}, 0

    def check(self, spat, most=1):
        assert sum(group.colour in ("green", "yellow") for group in spat.groups) <= most
        for group in spat.groups:
            before = self.last.get(group.group)
            if before is not None and before.colour == group.colour:
                assert group.min_end_ns >= before.min_end_ns
                assert (group.max_end_ns or math.inf) <= (before.max_end_ns or math.inf)
            elif before is not None and "flashing_red" not in (before.colour, group.colour):
                assert before.min_end_ns <= spat.t_ns <= (before.max_end_ns or math.inf)
                self.count += 1
                if before.colour == "yellow" and before.group == "a":
                    self.shown_s["yellow"].add(round((spat.t_ns - before.since_ns) / S))
            self.last[group.group] = group


@pytest.mark.parametrize("policy", ["fixed", "actuated"])
def test_no_guarantee_is_broken_by_other_least_times(policy):
    dice = random.Random(policy)
    controller, guarantees = Controller("x", SHORT, "calm", policy=policy), Guarantees()
    timings, used = {"short": timing(SHORT), "long": timing(LONG)}, set()
    for k in range(6000):
        controller.step(k * S)
        guarantees.check(controller.spat(k * S))
        used.add(controller.program.times[0].yellow)
        if dice.random() < 0.003:
            controller.request_timing(timings[dice.choice(["short", "long"])])
        if policy == "fixed" and dice.random() < 0.003:
            controller.request_plan(dice.choice(["calm", "brisk"]))
        if dice.random() < 0.001:
            controller.flash("test", on=True)
        elif dice.random() < 0.1:
            controller.flash("test", on=False)
    assert used == {6 * S, 9 * S}
    assert guarantees.shown_s["yellow"] == {6, 9}
    assert guarantees.count > 100
    assert controller.failure == ""


def test_custom_plan_gets_longer_greens_and_its_own_back():
    controller = Controller("x", SHORT, "calm")
    stages = [SignalStage(groups=(name,), green_s=3.0) for name in "abc"]
    controller.request_custom_plan(table_of("mine", stages, SHORT))
    greens = {}
    for k in range(4000):
        controller.step(k * S)
        if k == 1500:
            controller.request_timing(timing(LONG))
        if k == 2800:
            controller.request_timing(timing(SHORT))
        table, _ = controller.custom_plan or (None, None)
        if table is not None:
            greens[k] = table.timed_stages[0].end_ns / 1e9
    assert (greens[1499], greens[2700], greens[3999]) == (3.0, 3.5, 3.0)


def test_group_that_is_always_green_turns_red_for_other_times():
    free = SHORT._replace(conflicts=frozenset({frozenset("ab")}))
    stages = [SignalStage(groups=(name, "c"), green_s=3.0) for name in "ab"]
    controller, guarantees, colours = Controller("x", free, "calm"), Guarantees(), {}
    controller.request_custom_plan(table_of("mine", stages, free))
    for k in range(1500):
        controller.step(k * S)
        spat = controller.spat(k * S)
        guarantees.check(spat, most=2)
        colours[k] = spat.groups[2].colour
        if k == 900:
            controller.request_timing(timing(LONG._replace(conflicts=free.conflicts)))
    assert controller.program.times == LONG.times
    assert {colours[k] for k in range(600, 900)} == {"green"}
    assert "yellow" in colours.values()


class City:
    def __init__(self, **options):
        self.city = Lockstep([TrafficPart(MAP, "brisk", **options), MonitorPart(MAP)])
        kinds = (CityEvent, SignalSite, Spat, MonitorStatus)
        self.boxes = {kind: self.city.subscribe(Subscription(kind)) for kind in kinds}

    def run(self, seconds, *messages):
        for one in messages:
            self.city.publish(one)
        self.city.run_for(seconds)
        return {kind: [i.message for i in box.drain()] for kind, box in self.boxes.items()}


def yellow_s(seen):
    return max(phase.yellow_s for phase in seen[SignalSite][-1].phases)


@pytest.mark.parametrize("policy", ["fixed", "actuated"])
def test_city_follows_a_version_and_goes_back_with_it(policy):
    city = City(policy=policy)
    with city.city:
        before = city.run(15.0)
        changed = status(ORIGINAL, version(1, LONG_STOP, SLOW))
        longer = city.run(90.0, changed)
        events = [one.text for one in longer[CityEvent] if one.name == "signal_times"]
        assert len(events) == 1
        assert "yellow 0.6 to 1.2 s" in events[0]
        assert "n3 may need 0.1 m to stop, 0.007 before" in events[0]
        assert "n3 may drive only 0.16 m/s" in events[0]
        assert (yellow_s(before), yellow_s(longer)) == (0.6, 1.2)
        again = city.run(90.0, status(ORIGINAL, version(1, LONG_STOP, SLOW), number=0))
        assert yellow_s(again) == 0.6
        events = [one.text for one in again[CityEvent] if one.name == "signal_times"]
        assert "yellow 1.2 to 0.6 s" in events[0]
        assert "no version in force needs more" in events[0]
        faults = {one.fault for seen in (before, longer, again) for one in seen[MonitorStatus]}
        assert faults == {None}


def test_times_go_back_when_the_car_has_left():
    city = City()
    with city.city:
        assert yellow_s(city.run(90.0, status(version(1, LONG_STOP)))) > 0.6
        left = CityEvent(
            severity="info", source="world", t_ns=0, name="vehicle_left", text="", vehicle="n3"
        )
        assert yellow_s(city.run(90.0, left)) == 0.6


def test_nonsense_of_a_twin_neither_shortens_times_nor_ends_the_part():
    city = City()
    with city.city:
        wrong = ability("stopping_m", 0.3, -1.0, 1e300, 0.2)
        seen = city.run(60.0, status(version(1, wrong), vehicle="nobody"))
        names = [one.name for one in seen[CityEvent]]
        assert names.count("abilities_ignored") == 1
        assert "signal_times" not in names
        assert yellow_s(seen) == 0.6


def test_plans_requested_later_run_at_the_new_times():
    city = City()
    with city.city:
        city.run(90.0, status(version(1, LONG_STOP)))
        city.city.call(PlanRequest(junction="crossing", plan="calm", by="test"))
        assert city.run(60.0)[Spat][-1].plan == "calm"
