import msgspec
import pytest

from scm.api.eye_rows import camera_rows, frame_of, tags_of
from scm.api.signal_rows import junction_rows
from scm.api.vehicle_rows import vehicles_topic
from scm.clock import NS_PER_S
from scm.records.eye import TagSeen
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_status import Complaint, EyeStatus
from scm.v2x.messages.eye_tags import EyeTags
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.trip import Trip


def frame(t_ns, body=b"jpeg"):
    return EyeFrame(camera="overhead", t_ns=t_ns, width_px=640, height_px=480, payload=body)


def tags(t_ns, tag_id):
    corners = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    tag = TagSeen(tag_id=tag_id, centre_px=(0.5, 0.5), corners_px=corners, margin=50.0)
    return EyeTags(camera="overhead", t_ns=t_ns, tags=(tag,), latency_ms=20.0)


def junction(view, city_map, plans=None):
    (row,) = junction_rows(view.picture(), city_map.junctions, plans or {})
    return row


class TestCars:
    def test_before_the_world_speaks_nothing_is_known(self, view):
        topic = vehicles_topic(view.picture())
        assert (topic.t_ns, topic.tick, topic.vehicles) == (None, None, ())

    def test_cars_come_by_name_with_an_age_that_grows_with_the_snapshot(self, view, hear, snapshot):
        hear(1.0, snapshot(n2=(1.0, 0.0, 0.0), n1=(0.0, 0.0, 0.0)))
        hear(1.25)
        cars = vehicles_topic(view.picture()).vehicles
        assert [(car.vehicle, car.age_ms) for car in cars] == [("n1", 250.0), ("n2", 250.0)]

    def test_battery_and_command_come_with_their_car(self, view, hear, snapshot):
        told, replace = snapshot(n1=(0.0, 0.0, 0.0)), msgspec.structs.replace
        known = {"battery_v": 11.4567, "battery_charge": 0.456789, "command_age_ms": 20.04}
        hear(1.0, replace(told, vehicles=(replace(told.vehicles[0], **known),)))
        hear(1.1)
        (car,) = vehicles_topic(view.picture()).vehicles
        assert (car.battery_v, car.battery_charge, car.command_age_ms) == (11.46, 0.4568, 120.0)

    @pytest.mark.parametrize("against", [None, (), ("n2", "wall")])
    def test_what_a_stuck_car_pushes_against_comes_with_it(self, view, hear, snapshot, against):
        told, replace = snapshot(n1=(0.0, 0.0, 0.0)), msgspec.structs.replace
        hear(1.0, replace(told, vehicles=(replace(told.vehicles[0], stuck=against),)))
        (car,) = vehicles_topic(view.picture()).vehicles
        assert car.stuck == against

    def test_a_trip_is_shown_until_it_has_not_been_told_for_ten_seconds(self, view, hear, snapshot):
        trip = Trip(
            vehicle="n1",
            trip_id="t1",
            t_ns=0,
            route=("a", "b"),
            done_m=1.234,
            length_m=7.0,
            started_ns=0,
            waiting_for="signal",
        )
        hear(1.0, trip, snapshot(n1=(0.0, 0.0, 0.0)))
        (car,) = vehicles_topic(view.picture()).vehicles
        assert (car.trip.done_m, car.trip.length_m, car.trip.waiting_for) == (1.23, 7.0, "signal")
        hear(12.0, snapshot(n1=(0.0, 0.0, 0.0)))
        assert vehicles_topic(view.picture()).vehicles[0].trip is None

    def test_the_residual_of_the_eye_stands_beside_its_car(self, view, hear, snapshot):
        hear(1.0, snapshot(1.0, n1=(0.0, 0.0, 0.0), n2=(1.0, 0.0, 0.0)))
        pose = EyePose(
            camera="overhead",
            vehicle="n1",
            tag_id=1,
            t_ns=1_000_000_000,
            x_m=0.002,
            y_m=0.0,
            yaw_rad=0.0,
            covariance=(0.0,) * 9,
        )
        hear(1.1, pose)
        first, second = vehicles_topic(view.picture()).vehicles
        assert first.eye.position_mm == 2.0
        assert second.eye is None
        hear(3.5)
        assert vehicles_topic(view.picture()).vehicles[0].eye is None


class TestSignals:
    def test_times_count_from_now_whatever_the_clock_of_the_controller(
        self, view, hear, spat, city_map
    ):
        hear(7.0, spat(at_s=5000.0))
        hear(7.5)
        group = junction(view, city_map).groups[0]
        assert (group.colour, group.min_s, group.max_s) == ("green", 3.5, 5.5)
        assert group.next_colour == "yellow"

    def test_a_forecast_counts_from_now_and_says_how_far_to_trust_it(
        self, view, hear, spat, city_map
    ):
        told = spat(at_s=5000.0)
        likely_ns = told.t_ns + 5 * NS_PER_S
        forecast = {"likely_end_ns": likely_ns, "likely_confidence": 0.8}
        group = msgspec.structs.replace(told.groups[0], **forecast)
        hear(7.0, msgspec.structs.replace(told, groups=(group,)))
        hear(7.5)
        row = junction(view, city_map).groups[0]
        assert (row.likely_s, row.likely_confidence) == (4.5, 0.8)

    def test_every_group_of_the_map_has_a_row_even_unheard(self, view, city_map):
        row = junction(view, city_map)
        assert [(group.group, group.colour) for group in row.groups] == [
            ("south_east", None),
            ("south_west", None),
        ]
        assert (row.fresh, row.plan, row.monitor) == (False, None, None)

    def test_a_controller_silent_for_over_a_second_shows_no_colour(
        self, view, hear, spat, city_map
    ):
        hear(1.0, spat())
        hear(2.1)
        row = junction(view, city_map)
        assert not row.fresh
        assert row.groups[0].colour is None

    def test_flashing_red_promises_no_time(self, view, hear, spat, city_map):
        hear(1.0, spat(colour="flashing_red", mode="flash"))
        group = junction(view, city_map).groups[0]
        assert (group.colour, group.min_s, group.max_s) == ("flashing_red", None, None)

    def test_plans_are_those_offered_the_map_s_own_the_one_seen_and_flash(
        self, view, hear, spat, city_map
    ):
        hear(1.0, spat(plan="rush"))
        row = junction(view, city_map, {"crossing": ("busy",)})
        assert row.plans == ("busy", "calm", "rush", "flash")

    def test_the_monitor_s_verdict_has_an_age(self, view, hear, city_map):
        status = MonitorStatus(junction="crossing", t_ns=1, fault="conflict", since_ns=1)
        hear(1.0, status)
        hear(3.0)
        monitor = junction(view, city_map).monitor
        assert (monitor.fault, monitor.age_s) == ("conflict", 2.0)


class TestEye:
    def test_tags_of_the_newest_frame_are_preferred_to_newer_ones(self, view, hear):
        hear(1.0, frame(10), tags(10, 1), tags(20, 2))
        assert tags_of(view.picture(), "overhead").message.t_ns == 10

    def test_without_tags_of_that_frame_the_newest_are_shown(self, view, hear):
        hear(1.0, frame(15), tags(10, 1), tags(20, 2))
        assert tags_of(view.picture(), "overhead").message.t_ns == 20

    def test_a_frame_is_found_by_its_time_or_else_the_newest_is_given(self, view, hear):
        hear(1.0, frame(10), frame(20))
        picture = view.picture()
        assert frame_of(picture, "overhead", 10).message.t_ns == 10
        assert frame_of(picture, "overhead", 11).message.t_ns == 20
        assert frame_of(picture, "nowhere") is None

    def test_a_camera_that_sent_only_tags_is_listed_without_a_frame(self, view, hear):
        hear(1.0, tags(10, 1))
        (row,) = camera_rows(view.picture())
        assert (row.frame_t_ns, row.tags[0].tag_id) == (None, 1)

    def test_what_a_camera_complains_of_is_told_even_without_a_frame(self, view, hear):
        lens_cap = Complaint(code="black", said="the picture is black: lens cap on, or no light")
        hear(1.0, EyeStatus(camera="overhead", t_ns=1, good=False, complaints=(lens_cap,)))
        (row,) = camera_rows(view.picture())
        assert (row.good, row.complaints) == (False, (lens_cap.said,))
        hear(1.5, EyeStatus(camera="overhead", t_ns=2, good=True))
        (row,) = camera_rows(view.picture())
        assert (row.good, row.complaints) == (True, ())
        hear(4.5)
        (row,) = camera_rows(view.picture())
        assert (row.good, row.complaints) == (False, ("no word from this camera for 3 s",))

    @pytest.mark.parametrize(("later_s", "count"), [(1.0, 1), (3.0, 0)])
    def test_poses_not_seen_for_two_seconds_go(self, view, hear, later_s, count):
        pose = EyePose(
            camera="overhead",
            vehicle="n1",
            tag_id=1,
            t_ns=1,
            x_m=0.0,
            y_m=0.0,
            yaw_rad=0.0,
            covariance=(0.0,) * 9,
        )
        hear(1.0, frame(10), pose)
        hear(1.0 + later_s)
        (row,) = camera_rows(view.picture())
        assert len(row.seen) == count
