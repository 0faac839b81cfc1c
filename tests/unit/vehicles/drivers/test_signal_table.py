"""What a car believes of the signals."""

import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S
from scm.maps.load import load_map
from scm.records.signals import SignalGroup
from scm.v2x.etsi.convert import spatem_of
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Spat
from scm.vehicles.drivers.signal_table import SignalTable

AT = ("crossing", "south_east")
NOW_NS = 100 * NS_PER_S


@pytest.fixture(scope="module")
def city_map():
    return load_map("driving_school")


@pytest.fixture
def view(city_map):
    return SignalTable(city_map)


@pytest.fixture
def body(city_map):
    def make(colour="green", *, mode="plan", min_end_s=5.0, revision=1):
        groups = tuple(
            SignalGroup(
                group=group.name,
                colour=colour,
                since_ns=0,
                min_end_ns=NOW_NS + round(min_end_s * NS_PER_S),
            )
            for group in city_map.junctions[0].groups
        )
        spat = Spat(
            junction="crossing",
            t_ns=NOW_NS,
            seq=1,
            mode=mode,
            plan="p",
            groups=groups,
            revision=revision,
        )
        return spatem_of(spat, city_map.junctions[0])

    return make


def fault(name, junction="crossing"):
    return MonitorStatus(junction=junction, t_ns=0, fault=name, since_ns=0)


def test_without_messages_no_signal_state_is_known(view):
    assert view.colour(*AT, NOW_NS) is None
    assert not view.may_go(*AT, NOW_NS)
    assert view.time_to_change(*AT, NOW_NS) is None


def test_a_fresh_green_lets_go(view, body):
    view.receive_spatem(body(), NOW_NS)
    assert view.may_go(*AT, NOW_NS)


@pytest.mark.parametrize("colour", ["red", "yellow", "flashing_red", "dark"])
def test_only_green_lets_go(view, body, colour):
    view.receive_spatem(body(colour), NOW_NS)
    assert view.colour(*AT, NOW_NS) == colour
    assert not view.may_go(*AT, NOW_NS)


@pytest.mark.parametrize(("age_ms", "believed"), [(0, True), (1000, True), (1001, False)])
def test_a_green_is_believed_for_one_second_from_its_arrival(view, body, age_ms, believed):
    view.receive_spatem(body(), NOW_NS)
    assert view.may_go(*AT, NOW_NS + age_ms * NS_PER_MS) is believed


def test_a_message_from_the_future_is_not_believed(view, body):
    view.receive_spatem(body(), NOW_NS + 2 * NS_PER_S)
    assert view.colour(*AT, NOW_NS) is None


def test_a_message_that_arrives_while_a_step_runs_is_believed(view, body):
    view.receive_spatem(body(), NOW_NS + NS_PER_MS)
    assert view.may_go(*AT, NOW_NS)


def test_failure_flash_overrides_every_colour(view, body):
    view.receive_spatem(body(mode="flash"), NOW_NS)
    assert view.colour(*AT, NOW_NS) == "flashing_red"
    assert view.time_to_change(*AT, NOW_NS) is None


def test_a_known_monitor_fault_overrides_green_until_it_is_lifted(view, body):
    view.receive_spatem(body(), NOW_NS)
    view.receive_monitor_status(fault("conflict"))
    assert not view.may_go(*AT, NOW_NS)
    view.receive_monitor_status(fault(None))
    assert view.may_go(*AT, NOW_NS)


def test_a_fault_of_another_junction_changes_nothing(view, body):
    view.receive_spatem(body(), NOW_NS)
    view.receive_monitor_status(fault("conflict", junction="elsewhere"))
    assert view.may_go(*AT, NOW_NS)


def test_signals_of_another_revision_of_the_map_are_ignored_and_counted(view, body):
    view.receive_spatem(body(revision=2), NOW_NS)
    assert not view.may_go(*AT, NOW_NS)
    assert view.ignored == 1


def test_an_unknown_group_is_never_green(view, body):
    view.receive_spatem(body(), NOW_NS)
    assert not view.may_go("crossing", "north", NOW_NS)


def test_a_group_that_a_message_leaves_out_is_never_green(view, body):
    full = body()
    junction = replace(full.intersections[0], states=full.states[1:])
    view.receive_spatem(replace(full, intersections=(junction,)), NOW_NS)
    assert view.colour(*AT, NOW_NS) is None


def test_a_green_past_its_promised_end_counts_as_yellow(view, body):
    view.receive_spatem(body(min_end_s=0.5), NOW_NS)
    assert view.colour(*AT, NOW_NS + 500 * NS_PER_MS) == "green"
    assert view.colour(*AT, NOW_NS + 601 * NS_PER_MS) == "yellow"


def test_time_to_change_counts_down_from_the_arrival(view, body):
    view.receive_spatem(body(min_end_s=0.5), NOW_NS)
    assert view.time_to_change(*AT, NOW_NS + 200 * NS_PER_MS) == pytest.approx(0.3)
    assert view.time_to_change(*AT, NOW_NS + 900 * NS_PER_MS) == 0.0


def test_a_change_that_is_not_promised_is_not_known(view, body):
    view.receive_spatem(body("dark"), NOW_NS)
    assert view.time_to_change(*AT, NOW_NS) is None
