import sys
import threading

from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.world_definition import WorldDefinition


def trip_of(vehicle):
    return Trip(
        vehicle=vehicle, trip_id="t1", t_ns=0, route=(), done_m=1.0, length_m=None, started_ns=0
    )


def pose_at(t_s, x_m, yaw_rad=0.0, vehicle="n1"):
    return EyePose(
        camera="overhead",
        vehicle=vehicle,
        tag_id=1,
        t_ns=round(t_s * 1e9),
        x_m=x_m,
        y_m=0.0,
        yaw_rad=yaw_rad,
        covariance=(0.0,) * 9,
    )


def frame(number):
    return EyeFrame(
        camera="overhead", t_ns=number, width_px=4, height_px=3, payload=bytes([number])
    )


def test_the_view_says_nothing_and_serves_nothing(view, hear, snapshot):
    assert hear(1.0, snapshot(n1=(0.0, 0.0, 0.0))) == []
    assert not view.services
    assert view.finish(2) == []


def test_the_newest_snapshot_is_kept_with_its_arrival(view, hear, snapshot):
    hear(1.0, snapshot(tick=1))
    hear(2.0, snapshot(tick=2))
    hear(2.5)
    picture = view.picture()
    assert picture.snapshot.message.tick == 2
    assert picture.snapshot.age_s(picture.now_ns) == 0.5


def test_a_picture_does_not_change_when_more_is_heard(view, hear, spat):
    before = view.picture()
    hear(1.0, spat(), trip_of("n1"))
    assert before.spats == {}
    assert set(view.picture().spats) == {"crossing"}


def test_a_stop_whose_release_was_missed_ends_when_the_world_repeats_it_no_more(
    view, hear, snapshot
):
    hear(0.0, snapshot(), CityStop(t_ns=1, engaged=True))
    hear(9.0, snapshot())  # a world that was silent may repeat it soon
    for frame in range(100):
        told = (CityStop(t_ns=1, engaged=True),) if frame % 20 == 0 else ()
        hear(10.0 + 0.05 * frame, snapshot(), *told)
        assert view.picture().stop.engaged
    for frame in range(70):
        hear(15.0 + 0.05 * frame, snapshot())
    assert view.picture().stop is None


def test_definition_and_stop_are_kept(view, hear, city_map):
    hear(1.0, WorldDefinition(t_ns=1, seed=7, map=city_map))
    hear(1.1, CityStop(t_ns=1, engaged=True, by="me"))
    assert view.picture().definition.seed == 7
    assert view.picture().stop.engaged


def test_only_the_last_frames_of_a_camera_are_kept(view, hear):
    hear(1.0, *(frame(number) for number in range(9)))
    assert [held.message.t_ns for held in view.picture().frames["overhead"]] == [5, 6, 7, 8]


def test_the_residual_compares_with_the_truth_of_the_exposure(view, hear, snapshot):
    hear(1.00, snapshot(1.0, n1=(0.0, 0.0, 0.0)))
    hear(1.10, snapshot(1.1, n1=(0.020, 0.0, 0.0)))
    hear(1.12, pose_at(1.05, x_m=0.013))
    seen = view.picture().poses["overhead", "n1"]
    assert seen.residual.position_mm == 3.0


def test_a_pose_older_than_the_truth_known_has_no_residual(view, hear, snapshot):
    hear(1.0, snapshot(1.0, n1=(0.0, 0.0, 0.0)), pose_at(0.9, x_m=0.0))
    assert view.picture().poses["overhead", "n1"].residual is None


def test_a_world_that_starts_again_brings_its_own_truth(view, hear, snapshot):
    hear(9.0, snapshot(9.0, n1=(5.0, 0.0, 0.0)))
    hear(9.1, snapshot(0.1, n1=(0.0, 0.0, 0.0)))
    hear(9.2, pose_at(0.1, x_m=0.001))
    assert view.picture().poses["overhead", "n1"].residual.position_mm == 1.0


def test_what_is_not_heard_of_for_a_minute_is_forgotten(view, hear):
    hear(1.0, trip_of("n1"), pose_at(1.0, 0.0))
    hear(60.9)
    assert "n1" in view.picture().trips
    hear(62.0)
    picture = view.picture()
    assert (picture.trips, picture.poses) == ({}, {})


def test_events_are_numbered_as_they_arrive(view, hear, event):
    hear(1.0, event("first"), event("second"))
    assert [(e.seq, e.text) for e in view.events_after(0, 10)] == [(1, "first"), (2, "second")]
    assert view.picture().event_seq == 2


def test_pictures_may_be_taken_while_another_thread_steps(view, hear, snapshot, spat):
    failures, done = [], threading.Event()

    def read():
        try:
            while not done.is_set():
                view.picture()
                view.events_after(0, 10)
        except RuntimeError as failure:  # a dict that changed size while it was copied
            failures.append(failure)

    reader = threading.Thread(target=read)
    usual_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        reader.start()
        for number in range(300):
            came = Presence(role="v", station=f"n{number}", session="s", alive=True)
            hear(1.0 + number, snapshot(n1=(0.0, 0.0, 0.0)), spat(), trip_of(f"n{number}"), came)
    finally:
        sys.setswitchinterval(usual_s)
        done.set()
        reader.join()
    assert failures == []
