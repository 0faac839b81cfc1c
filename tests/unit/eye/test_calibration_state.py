"""A calibration put in force while the Eye runs: checked, believed from the next frame, kept."""

import msgspec
import numpy as np
import pytest

from scm.clock import NS_PER_MS
from scm.eye.calibration_state import MAX_STATES, CalibrationHistory
from scm.eye.camera import camera_model
from scm.eye.part import EyePart
from scm.eye.source import Frame
from scm.eye.sources.synthetic import SyntheticSource
from scm.maps.load import load_map
from scm.records.eye import Calibrated
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.store.audit import AuditLog
from scm.store.memory import MemoryStore
from scm.store.records import record
from scm.v2x.message import Refused
from scm.v2x.messages.calibration_request import CalibrationRequest, MeasuredLens
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_status import EyeStatus
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

CITY = load_map("driving_school")
MAPPED = CITY.cameras[0]
WELL_KNOWN = (1e-3, 1e-3, 1e-3, 5e-4, 3e-4, 3e-4)
TRUE = msgspec.structs.replace(
    MAPPED, x_m=MAPPED.x_m + 0.03, yaw_rad=MAPPED.yaw_rad + 0.008, z_m=MAPPED.z_m + 0.02,
    place_std=WELL_KNOWN,
)  # fmt: skip
CAR = SnapshotVehicle(
    vehicle="n7", kind="hosted", car="nigel", tag_id=7, x_m=2.2, y_m=0.9, yaw_rad=-0.8,
    speed_mps=0.0, steering_rad=0.0,
)  # fmt: skip
LENS = MeasuredLens(
    lens="pinhole", width_px=MAPPED.width_px, height_px=MAPPED.height_px,
    fx_px=MAPPED.fx_px, fy_px=MAPPED.fy_px, cx_px=MAPPED.cx_px, cy_px=MAPPED.cy_px,
    distortion=MAPPED.distortion, rms_px=0.1, views=14,
    covariance=tuple(map(tuple, np.diag([0.3, 0.3, 0.3, 0.3, *[1e-8] * 5]).tolist())),
)  # fmt: skip


class Still:
    """A camera that gives the same picture all the time, but for one pixel."""

    problem = None

    def __init__(self, picture):
        self.shown = picture.copy()
        self.frames = 0
        self.due_ns = 0

    def cover(self):
        self.shown[:] = 90

    def read(self, now_ns, light):
        del light
        if now_ns < self.due_ns:
            return None
        self.due_ns = now_ns + 100 * NS_PER_MS
        self.frames += 1
        self.shown[0, 0] = self.frames % 251
        return Frame(now_ns, self.shown)

    def close(self):
        self.due_ns = 1 << 62


@pytest.fixture(scope="module")
def picture():
    """Return what the true camera sees of one car that stands."""
    source = SyntheticSource(CITY, camera_model(TRUE), np.random.default_rng(1))
    return source.render(WorldSnapshot(t_ns=0, tick=0, vehicles=(CAR,))).copy()


@pytest.fixture
def still(picture):
    return Still(picture)


class City:
    """An Eye alone in lockstep, and what it tells."""

    def __init__(self, still, city_map=CITY, state=None):
        still.due_ns = 0
        self.eye = EyePart(city_map, source=still, restored=restored_from(state))
        self.lockstep = Lockstep(())
        self.poses = self.lockstep.subscribe(Subscription(EyePose))
        self.statuses = self.lockstep.subscribe(Subscription(EyeStatus))
        self.tracks = self.lockstep.subscribe(Subscription(EyeTrack))
        self.events = self.lockstep.subscribe(Subscription(CityEvent))
        self.lockstep.add(self.eye, state)
        self.lockstep.publish(WorldSnapshot(t_ns=0, tick=0, vehicles=(CAR,)))
        self.lockstep.run_for(0.3)

    def pose(self):
        """Return the newest pose after half a second more."""
        self.lockstep.run_for(0.5)
        return self.poses.drain()[-1].message

    def off_mm(self):
        return off_mm(self.pose())

    def in_force(self):
        self.lockstep.run_for(0.6)
        return self.statuses.drain()[-1].message.in_force

    def ask(self, **asked):
        wish = {"camera": "overhead", "by": "ada", "reason": "it was moved", **asked}
        return self.lockstep.call(CalibrationRequest(**wish))

    def told(self):
        return [item.message.name for item in self.events.drain()]


def off_mm(seen):
    return 1e3 * np.hypot(seen.x_m - CAR.x_m, seen.y_m - CAR.y_m)


def restored_from(state):
    return state and record(state, "calibrations", "eye", "overhead", CalibrationHistory)


def moved(**change):
    return msgspec.structs.replace(TRUE, **change)


def test_poses_follow_the_place_put_in_force_from_the_next_frame_on(still):
    city = City(still)
    before = city.pose()
    assert city.off_mm() > 3.0
    assert "bumped" in before.flags
    assert city.in_force().now == Calibrated()
    reply = city.ask(calibration="lab", place=TRUE)
    assert (reply.in_force.now.place, reply.in_force.by) == ("lab", "ada")
    assert city.off_mm() < 1.5
    assert off_mm(city.tracks.drain()[-1].message) < 1.5
    after = city.pose()
    assert after.flags == ()
    assert after.covariance[0] < 0.5 * before.covariance[0]
    told = city.in_force()
    assert (told.now, told.reason) == (Calibrated(place="lab"), "it was moved")
    assert told.before == Calibrated()
    assert city.told() == ["calibration_in_force"]


def test_what_was_before_is_put_back_and_is_the_last_that_can_be(still):
    city = City(still)
    first = city.off_mm()
    city.ask(calibration="lab", place=TRUE)
    back = city.ask(verb="back", reason="worse")
    assert (back.in_force.now, back.in_force.before) == (Calibrated(), None)
    assert city.off_mm() == pytest.approx(first, abs=0.5)
    assert "nothing to restore" in city.ask(verb="back").detail


def test_the_doubt_of_place_and_lens_is_the_doubt_of_poses(still):
    city = City(still)
    city.ask(calibration="lab", place=TRUE)
    sure = city.pose().shared_covariance
    rough = moved(place_std=tuple(5.0 * std for std in WELL_KNOWN))
    refusal = city.ask(calibration="rough", place=rough)
    assert (refusal.code, "mm only (at most 5 mm)" in refusal.detail) == ("unsure", True)
    assert city.in_force().now.place == "lab"
    city.ask(calibration="rough", place=rough, accept_unsure=True)
    unsure = city.pose().shared_covariance
    city.ask(calibration="both", place=TRUE, lens=LENS)
    lens = city.pose().shared_covariance
    assert unsure[0] > 4.0 * sure[0]
    assert sure[0] < lens[0] < unsure[0]
    city.ask(calibration="glass", lens=LENS)
    assert city.in_force().now == Calibrated(lens="glass", place="both")


WRONG = {
    "another camera's place": (
        {"place": moved(name="south")},
        "expected one of camera 'overhead', got one of 'south'",
    ),
    "a place of other frames": (
        {"place": moved(width_px=640, cx_px=300.0)},
        "expected a place found in frames of 1280 x 720 px, got 640 x 720 px",
    ),
    "a lens of other frames": (
        {"lens": msgspec.structs.replace(LENS, width_px=640)},
        "expected a calibration for frames of 1280 x 720 px",
    ),
    "what is no camera": ({"place": moved(z_m=-1.0)}, "z_m: expected above the floor, got -1"),
    "a lens that missed its board": (
        {"lens": msgspec.structs.replace(LENS, rms_px=3.0)},
        "rms_px: expected a residual of at most 0.64 px at the board's points, got 3.00 px",
    ),
    "a lens without doubt": (
        {"lens": msgspec.structs.replace(LENS, covariance=())},
        "covariance: expected nine rows of nine",
    ),
    "a place and another lens": (
        {"place": TRUE, "lens": msgspec.structs.replace(LENS, fx_px=1200.0)},
        "expected the one that the place was found with",
    ),
    "a place where the tags are not": (
        {"place": moved(x_m=TRUE.x_m + 0.5)},
        "is it another camera's?",
    ),
    "a place a little off": ({"place": moved(x_m=TRUE.x_m + 0.02)}, "standard deviations (at most"),
    "a lens that makes tags too large": (
        {"place": moved(fx_px=1200.0, fy_px=1200.0)},
        "larger than it should",
    ),
    "nothing": ({}, "expected a lens or a place to use, got neither"),
}


@pytest.fixture(scope="module")
def running(picture):
    city = City(Still(picture))
    city.ask(calibration="lab", place=TRUE)
    return city


@pytest.mark.parametrize("what", WRONG)
def test_what_cannot_be_is_refused_in_words_and_the_old_stays(running, what):
    asked, said = WRONG[what]
    running.told()
    refused = running.ask(calibration="bad", **asked)
    assert isinstance(refused, Refused)
    assert refused.code == "invalid"
    assert said in refused.detail
    assert running.in_force().now == Calibrated(place="lab")
    assert running.off_mm() < 1.5
    assert running.told() == []


def test_without_a_map_tag_in_view_nothing_can_be_checked(still):
    still.cover()
    refused = City(still).ask(calibration="lab", place=TRUE)
    assert "expected a map tag (0) in view" in refused.detail


def test_a_tag_seen_long_ago_is_no_check(still):
    city = City(still)
    still.cover()
    city.lockstep.run_for(2.0)
    assert "expected a map tag (0) in view" in city.ask(calibration="lab", place=TRUE).detail


def test_it_outlives_the_process_with_who_and_why_in_the_audit_log(still):
    state = MemoryStore()
    city = City(still, state=state)
    for _ in range(2):
        city.ask(calibration="lab", place=TRUE, request_id="once")
    assert city.told() == ["calibration_in_force"]
    (deed,) = [deed for _, deed in AuditLog(state).deeds()]
    assert (deed.kind, deed.by) == ("CalibrationRequest", "ada")
    assert msgspec.json.decode(deed.request)["reason"] == "it was moved"
    city.lockstep.kill(city.eye)
    again = City(still, state=state)
    assert again.off_mm() < 1.5
    repeated = again.ask(calibration="lab", place=TRUE, request_id="once")
    assert again.in_force() == repeated.in_force
    assert again.told() == []


def test_what_was_kept_lapses_when_the_map_file_is_changed(still):
    state = MemoryStore()
    city = City(still, state=state)
    city.ask(calibration="lab", place=TRUE)
    camera = msgspec.structs.replace(MAPPED, x_m=MAPPED.x_m + 0.001)
    again = City(still, msgspec.structs.replace(CITY, cameras=(camera,)), state)
    assert again.in_force().now == Calibrated()
    assert again.told() == ["calibration_lapsed"]
    assert restored_from(state) is None


def test_of_many_the_last_and_the_first_can_be_put_back(still):
    city = City(still)
    for number in range(MAX_STATES + 3):
        city.ask(calibration=f"lab-{number}", place=TRUE)
    back = [city.ask(verb="back").in_force.now.place for _ in range(MAX_STATES - 1)]
    assert back == [f"lab-{number}" for number in range(MAX_STATES + 1, 3, -1)] + [""]
