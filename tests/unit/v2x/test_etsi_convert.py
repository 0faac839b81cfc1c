"""CAM and SPATEM say in the standards' units what the native messages say in ours."""

import math
from datetime import UTC, datetime

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S
from scm.records.city_map import Conflict, Group, Junction
from scm.records.signals import SignalGroup
from scm.v2x.etsi import convert as ec
from scm.v2x.etsi.cam_spatem import (
    PHASE_STATES,
    SCALE,
    HighFrequencyContainer,
    MovementEvent,
    SpatemBody,
    VehicleHighFrequency,
    VehicleLength,
)
from scm.v2x.etsi.parts import Heading, Speed
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_state import VehicleState

MOVE = Conflict(lane="l", from_m=0.0, to_m=0.5)
JUNCTION = Junction(
    name="centre",
    number=7,
    groups=(Group(name="a", number=1, movement=MOVE), Group(name="b", number=2, movement=MOVE)),
    plan="calm",
)
NOW = int(datetime(2026, 11, 21, 14, 3, 5, tzinfo=UTC).timestamp()) * NS_PER_S


def a_state(**changes):
    fields = {
        "vehicle": "n1",
        "t_ns": NOW,
        "seq": 0,
        "x_m": 0.0,
        "y_m": 0.0,
        "yaw_rad": 0.0,
        "speed_mps": 0.26,
        "yaw_rate_radps": 0.0,
        "steering_rad": 0.0,
        "throttle": 0.0,
        "source": "simulated",
    }
    return VehicleState(**{**fields, **changes})


def a_cam(**changes):
    return ec.cam_of(a_state(**changes), length_m=0.26, width_m=0.2, front_m=0.2)


def a_spat(t_ns=NOW, mode="plan", colour="green", min_end_ns=None, max_end_ns=None, revision=1):
    end = t_ns + NS_PER_S if min_end_ns is None else min_end_ns
    groups = tuple(
        SignalGroup(group=g, colour=colour, since_ns=t_ns, min_end_ns=end, max_end_ns=max_end_ns)
        for g in ("a", "b")
    )
    return Spat(
        junction="centre",
        t_ns=t_ns,
        seq=0,
        mode=mode,
        plan="calm",
        groups=groups,
        revision=revision,
    )


def test_a_station_number_is_the_same_on_every_machine():
    assert ec.station_id("n1") == 3494972671
    assert ec.station_id("n1") != ec.station_id("n2")


@given(
    x=st.floats(-5, 5),
    y=st.floats(-5, 5),
    yaw=st.floats(-math.pi, math.pi),
    speed=st.floats(-3, 3),
    rate=st.floats(-5, 5),
)
def test_a_cam_read_back_is_the_car_within_the_fields_resolution(x, y, yaw, speed, rate):
    view = ec.read_cam(a_cam(x_m=x, y_m=y, yaw_rad=yaw, speed_mps=speed, yaw_rate_radps=rate))
    assert view.x_m == pytest.approx(x + 0.2 * math.cos(yaw), abs=5e-4)
    assert view.y_m == pytest.approx(y + 0.2 * math.sin(yaw), abs=5e-4)
    assert math.remainder(view.yaw_rad - yaw, math.tau) == pytest.approx(0.0, abs=1e-3)
    # below standstill the direction is not told, so the sign may be lost there
    assert view.speed_mps == pytest.approx(speed, abs=4e-4 if abs(speed) > 0.02 else 0.041)
    assert view.yaw_rate_radps == pytest.approx(rate, abs=1e-4)
    assert view.length_m == pytest.approx(0.26, abs=0.1 / SCALE)
    assert view.width_m == pytest.approx(0.2, abs=0.1 / SCALE)


def test_the_air_knows_the_enlarged_city():
    cam = a_cam(x_m=1.0, y_m=2.0, accel_mps2=0.5)
    assert cam.motion.speed.value == 364
    assert (cam.motion.vehicle_length.value, cam.motion.vehicle_width) == (36, 28)
    assert cam.motion.longitudinal_acceleration.value == 70
    assert cam.position.longitude == pytest.approx(1.2 * 14 / 111_319.49 * 1e7, abs=1)
    assert cam.position.latitude == pytest.approx(2.0 * 14 / 110_574.28 * 1e7, abs=1)


@pytest.mark.parametrize(
    ("yaw", "heading"), [(0.0, 900), (math.pi / 2, 0), (math.pi, 2700), (-math.pi / 2, 1800)]
)
def test_heading_runs_clockwise_from_north(yaw, heading):
    assert a_cam(yaw_rad=yaw).motion.heading.value == heading


def test_a_heading_just_west_of_north_wraps_to_zero_and_never_reaches_3600():
    assert a_cam(yaw_rad=math.pi / 2 + 1e-6).motion.heading.value == 0


def test_a_left_turn_has_positive_curvature_and_a_standing_car_unknown():
    assert a_cam(yaw_rate_radps=0.026).motion.curvature.value == round(0.1 / SCALE * 1e4)
    assert a_cam(yaw_rate_radps=-5.0).motion.curvature.value == -1023
    assert a_cam(speed_mps=0.0).motion.curvature.value == 1023


def test_what_does_not_fit_is_the_largest_value_not_the_unknown_one():
    motion = a_cam(speed_mps=100.0, yaw_rate_radps=1e3, accel_mps2=-99.0).motion
    assert (motion.speed.value, motion.yaw_rate.value) == (16382, 32766)
    assert motion.longitudinal_acceleration.value == -160


def test_driving_backward_is_a_direction_and_not_a_negative_speed():
    cam = a_cam(speed_mps=-0.1)
    assert (cam.motion.speed.value, cam.motion.drive_direction) == (140, 1)
    assert ec.read_cam(cam).speed_mps == pytest.approx(-0.1)


def test_unknown_values_are_none():
    motion = VehicleHighFrequency(
        heading=Heading(value=3601),
        speed=Speed(value=16383),
        vehicle_length=VehicleLength(value=1),
        vehicle_width=1,
    )
    cam = replace(
        a_cam(),
        high_frequency_container=HighFrequencyContainer(
            basic_vehicle_container_high_frequency=motion
        ),
    )
    view = ec.read_cam(cam)
    assert (view.yaw_rad, view.speed_mps, view.yaw_rate_radps) == (None, None, None)


def test_delta_time_counts_milliseconds_since_2004_with_leap_seconds():
    start = int(datetime(2004, 1, 1, tzinfo=UTC).timestamp()) * NS_PER_S
    assert ec.delta_time(start) == 5000
    assert ec.delta_time(start + 60_536 * NS_PER_MS) == 0


@given(late_ms=st.integers(-32_000, 32_000), t_ms=st.integers(0, 10**13))
def test_the_generation_time_is_found_across_the_wrap(late_ms, t_ms):
    t_ns = t_ms * NS_PER_MS
    cam = a_cam(t_ns=t_ns)
    assert ec.generated_ns(cam, t_ns + late_ms * NS_PER_MS) == t_ns


def test_a_spatem_names_junction_groups_phase_and_time():
    body = ec.spatem_of(a_spat(max_end_ns=NOW + 2 * NS_PER_S, revision=130), JUNCTION)
    assert (body.intersection, body.revision, body.status) == (7, 2, ("fixedTimeOperation",))
    assert body.station_id == ec.station_id("rsu-centre")
    junction = body.intersections[0]
    assert body.timestamp == junction.moy == (325 - 1) * 1440 + 843
    assert (junction.timestamp, junction.status) == (5000, "0000010000000000")
    assert [s.signal_group for s in body.states] == [1, 2]
    assert body.states[0].event_state == "protected-Movement-Allowed"
    assert (body.states[0].min_end_time, body.states[0].max_end_time) == (1860, 1870)


def test_minimum_ends_round_down_and_maximum_ends_up():
    body = ec.spatem_of(
        a_spat(min_end_ns=NOW + 1_050_000_000, max_end_ns=NOW + 1_050_000_000), JUNCTION
    )
    assert (body.states[0].min_end_time, body.states[0].max_end_time) == (1860, 1861)


@given(
    t_s=st.integers(0, 10**10),
    t_ms=st.integers(0, 999),
    to_min_ms=st.integers(0, 3_000_000),
    more_ms=st.integers(0, 200_000),
    colour=st.sampled_from(["red", "green", "yellow"]),
)
def test_a_spatem_read_back_is_the_spat_also_across_the_hour(t_s, t_ms, to_min_ms, more_ms, colour):
    t_ns = t_s * NS_PER_S + t_ms * NS_PER_MS
    least, most = to_min_ms / 1000, (to_min_ms + more_ms) / 1000
    spat = a_spat(
        t_ns,
        colour=colour,
        min_end_ns=t_ns + to_min_ms * NS_PER_MS,
        max_end_ns=t_ns + (to_min_ms + more_ms) * NS_PER_MS,
    )
    decoded = ec.colours_of(ec.spatem_of(spat, JUNCTION))[2]
    assert decoded.colour == colour
    assert max(0.0, least - 0.1) <= decoded.min_end_s <= least
    assert most <= decoded.max_end_s < most + 0.1


@given(
    t_ms=st.integers(0, 10**10),
    to_min_ms=st.integers(0, 3_000_000),
    likely_ms=st.integers(0, 50_000),
    more_ms=st.integers(0, 50_000),
)
def test_a_likely_end_stays_between_the_two_promised_ones(t_ms, to_min_ms, likely_ms, more_ms):
    t_ns, least_ns = t_ms * NS_PER_MS, (t_ms + to_min_ms) * NS_PER_MS
    likely_ns = least_ns + likely_ms * NS_PER_MS
    spat = a_spat(t_ns, min_end_ns=least_ns, max_end_ns=likely_ns + more_ms * NS_PER_MS)
    first = replace(spat.groups[0], likely_end_ns=likely_ns, likely_confidence=0.6)
    decoded = ec.colours_of(ec.spatem_of(replace(spat, groups=(first,)), JUNCTION))[1]
    assert decoded.min_end_s <= decoded.likely_end_s <= decoded.max_end_s
    assert decoded.likely_end_s == pytest.approx((likely_ns - t_ns) / NS_PER_S, abs=0.1001)


@pytest.mark.parametrize(
    ("share", "number", "read"),
    [(1.0, 15, 1.0), (0.98, 14, 0.98), (0.75, 6, 0.73), (0.3, 0, 0.21), (0.1, 0, 0.21)],
)
def test_confidence_is_the_class_that_promises_no_more(share, number, read):
    (group, _) = a_spat().groups
    spat = replace(
        a_spat(),
        groups=(replace(group, likely_end_ns=group.min_end_ns, likely_confidence=share),),
    )
    body = ec.spatem_of(spat, JUNCTION)
    assert body.states[0].state_time_speed[0].timing.confidence == number
    assert ec.colours_of(body)[1].likely_confidence == read


def test_a_likely_end_equal_to_the_earliest_is_sent_as_equal():
    spat = a_spat(min_end_ns=NOW + 1_050_000_000)
    group = replace(spat.groups[0], likely_end_ns=NOW + 1_050_000_000, likely_confidence=1.0)
    decoded = ec.spatem_of(replace(spat, groups=(group,)), JUNCTION).states[0]
    assert (decoded.min_end_time, decoded.likely_time) == (1860, 1860)


def test_who_foresees_nothing_sends_no_likely_end():
    timing = ec.spatem_of(a_spat(), JUNCTION).states[0].state_time_speed[0].timing
    assert (timing.likely_time, timing.confidence) == (None, None)
    assert b"likely" not in msgspec.json.encode(timing)


@pytest.mark.parametrize("ahead_s", [56 * 60, 7200])
def test_an_end_of_an_hour_or_so_ahead_is_far_and_read_as_unknown(ahead_s):
    body = ec.spatem_of(a_spat(max_end_ns=NOW + ahead_s * NS_PER_S), JUNCTION)
    assert body.states[0].max_end_time == 36000
    assert ec.colours_of(body)[1].max_end_s is None


@pytest.mark.parametrize("colour", ["flashing_red", "dark", "red"])
def test_flashing_has_no_guaranteed_end_and_is_sent_as_failure(colour):
    body = ec.spatem_of(a_spat(mode="flash", colour=colour, max_end_ns=NOW), JUNCTION)
    assert body.status == ("failureFlash",)
    assert ec.colours_of(body)[1] == (colour, None, None, None, None)
    assert (body.states[0].min_end_time, body.states[0].max_end_time) == (36001, 36001)


@pytest.mark.parametrize(
    "state",
    ["permissive-Movement-Allowed", "unavailable", "caution-Conflicting-Traffic"],
)
def test_only_a_protected_movement_is_green(state):
    spatem = ec.spatem_of(a_spat(), JUNCTION)
    event = MovementEvent(event_state=PHASE_STATES.index(state))
    group = replace(spatem.states[0], state_time_speed=(event,))
    junction = replace(spatem.intersections[0], states=(group,))
    body = replace(spatem, intersections=(junction,))
    assert ec.colours_of(body)[1] == ("dark", None, None, None, None)


def test_the_records_travel_as_json_with_the_names_of_the_open_json_schemas():
    body = ec.spatem_of(a_spat(), JUNCTION)
    raw = msgspec.json.encode(body)
    assert msgspec.json.decode(raw, type=SpatemBody) == body
    assert set(msgspec.json.decode(raw)) == {
        "protocol_version",
        "station_id",
        "timestamp",
        "intersections",
    }
