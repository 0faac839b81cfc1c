"""The part of the cameras: pictures only while somebody asks, at their own times."""

import cv2
import numpy as np
import pytest

from scm.camera.floor import Floor
from scm.camera.part import CameraPart
from scm.camera.tween import between, near
from scm.clock import NS_PER_MS, NS_PER_S
from scm.recorder.mcap_file import read_run
from scm.recorder.part import RecorderPart
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, Subscription
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.world_snapshot import WorldSnapshot

N1_FRONT = Subscription(CameraFrame, {"vehicle": "n1", "camera": "front"})


class Stage(BasePart):
    """A world that only tells where its two cars are, 20 times a second."""

    name, role, period_ns = "world", "part", 50 * NS_PER_MS
    subscriptions = services = ()

    def __init__(self, car):
        self._car = car

    def step(self, now_ns, inbox):
        assert not inbox
        x = 0.3 + 0.2 * now_ns / NS_PER_S
        cars = (self._car(x, 0.3), self._car(x + 0.6, 0.3, name="n2", tag_id=2))
        return [WorldSnapshot(t_ns=now_ns, tick=0, vehicles=cars)]

    def finish(self, now_ns):
        return []


class Spy(CameraPart):
    """Notes what it has had to read."""

    read = 0

    def step(self, now_ns, inbox):
        self.read += len(inbox)
        return super().step(now_ns, inbox)


@pytest.fixture(scope="module")
def floors():
    return {}


@pytest.fixture
def floor_drawn_once(floors, monkeypatch):
    """Share the drawn floor between tests: it takes longer than all frames of most of them."""

    def floor_of(city_map, daylight, seed):
        if seed not in floors:
            floors[seed] = Floor(city_map, daylight, seed)
        return floors[seed]

    monkeypatch.setattr("scm.camera.studio.Floor", floor_of)


@pytest.fixture
def spy(city_map, floor_drawn_once):
    return Spy(city_map)


@pytest.fixture
def city(car, spy):
    with Lockstep([Stage(car), spy]) as city:
        yield city


def test_while_nobody_looks_nothing_is_read_or_sent(city, spy):
    status = city.subscribe(Subscription(PartStatus))
    city.run_for(1.5)
    assert spy.read == 0
    assert status.drain()[-1].message.detail == "nobody looks"


def test_a_subscriber_gets_frames_at_the_cameras_rate_and_times(city):
    frames = city.subscribe(N1_FRONT)
    city.run_for(0.5)
    frames.drain()
    city.run_for(1.0)
    got = [item.message for item in frames.drain()]
    assert len(got) == 15
    assert all(-frame.t_ns * 15 % NS_PER_S < 15 for frame in got)
    picture = cv2.imdecode(np.frombuffer(got[-1].payload, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (720, 1280, 3) == (got[-1].height_px, got[-1].width_px, 3)


def test_only_requested_cameras_are_pictured(city, own_facts):
    own_facts()
    city.subscribe(N1_FRONT)
    every = city.subscribe(Subscription(CameraFrame, {"vehicle": "n2"}))
    city.run_for(0.5)
    assert {item.message.camera for item in every.drain()} == {"front", "rear"}


def test_rendering_ends_with_the_last_subscriber(city, spy, own_facts):
    own_facts()
    frames = city.subscribe(N1_FRONT)
    city.run_for(0.5)
    assert frames.drain()
    city.bus.unsubscribe(frames)
    city.run_for(0.2)
    before = spy.read
    city.run_for(0.5)
    assert spy.read == before
    again = city.subscribe(N1_FRONT)
    city.run_for(0.5)
    assert again.drain()


@pytest.mark.parametrize(
    ("cameras_hz", "cars", "kept"), [(0.0, (), 0), (5.0, (), 4 * 6), (5.0, ("n1",), 2 * 6)]
)
def test_a_recorder_makes_cameras_run_only_when_told_to(
    city, spy, tmp_path, own_facts, cameras_hz, cars, kept
):
    own_facts()
    recorder = RecorderPart(tmp_path / "run.mcap", "city", 1.0, cameras_hz, cars)
    city.add(recorder)
    city.run_for(1.3)
    city.remove(recorder)
    pictures = [one for one in read_run(tmp_path / "run.mcap") if "@camera" in one.key]
    assert abs(len(pictures) - kept) <= kept // 4
    assert not cars or {one.key.split("/")[4] for one in pictures} == set(cars)
    assert (spy.read > 0) is (cameras_hz > 0)


def test_the_same_city_gives_the_same_pictures(city_map, car):
    runs = []
    for _ in range(2):
        with Lockstep([Stage(car), CameraPart(city_map, seed=4)]) as city:
            frames = city.subscribe(N1_FRONT)
            city.run_for(0.5)
            runs.append([(item.message.t_ns, item.message.payload) for item in frames.drain()])
    assert runs[0]
    assert runs[0] == runs[1]


@pytest.fixture
def own_facts(monkeypatch, optics):
    """Put cameras with other facts than Nigel's own on every car."""

    def put(**facts):
        small = {"width_px": 160, "height_px": 90, "focal_px": 130.0, **facts}
        cameras = {name: optics(name, **small) for name in ("front", "rear")}
        monkeypatch.setattr("scm.camera.part.fitted", lambda car: cameras)

    return put


def arrivals(city, seconds=1.5, which=N1_FRONT):
    """Return when each frame was exposed and when it came [ns]."""
    frames = city.subscribe(which)
    city.run_for(seconds)
    return [(item.message.t_ns, item.t_ns) for item in frames.drain()]


def test_a_frame_comes_its_latency_after_its_exposure(city, own_facts):
    own_facts(latency_s=0.3)
    got = arrivals(city)
    assert len(got) >= 12
    late_ms = [(came_ns - t_ns) / NS_PER_MS for t_ns, came_ns in got]
    assert min(late_ms) >= 300.0
    assert max(late_ms) <= 300.0 + 2 * 20.0  # the part looks every 20 ms, and a step passes on
    times = [t_ns for t_ns, _ in got]
    assert times == sorted(times)


def test_a_camera_without_latency_is_a_snapshot_late_at_most(city, own_facts):
    own_facts()
    assert max(came_ns - t_ns for t_ns, came_ns in arrivals(city)) <= 90 * NS_PER_MS


def test_frames_under_way_end_with_the_last_subscriber(city, own_facts):
    own_facts(latency_s=1.0)
    frames = city.subscribe(N1_FRONT)
    city.run_for(0.8)
    city.bus.unsubscribe(frames)
    city.run_for(0.2)
    assert all(t_ns >= NS_PER_S - 50 * NS_PER_MS for t_ns, _ in arrivals(city, 1.4))


@pytest.mark.usefixtures("floor_drawn_once")
def test_drop_out_loses_some_frames_and_no_others_change(city_map, car, own_facts):
    def run(wanted, drop_out):
        own_facts(drop_out=drop_out, read_noise=2.0)
        with Lockstep([Stage(car), CameraPart(city_map, seed=4)]) as city:
            frames = city.subscribe(wanted)
            city.run_for(2.0)
            got = [item.message for item in frames.drain()]
        return {frame.t_ns: frame.payload for frame in got if frame.camera == "front"}

    whole, some = run(N1_FRONT, 0.0), run(N1_FRONT, 0.5)
    assert 0.25 * len(whole) < len(some) < 0.75 * len(whole)
    assert some.items() <= whole.items()
    assert run(Subscription(CameraFrame, {"vehicle": "n1"}), 0.5) == some


def test_between_two_snapshots_cars_are_on_their_way(car):
    def shot(t_ns, *cars):
        return WorldSnapshot(t_ns=t_ns, tick=0, vehicles=cars)

    before = shot(0, car(0.0, 0.0, 3.1), car(0.0, 1.0, name="n2"))
    after = shot(100, car(0.1, 0.2, -3.1), car(2.0, 1.0, name="n2"), car(5.0, 5.0, name="n3"))
    first, second, third = between(before, after, 50)
    assert (first.x_m, first.y_m) == pytest.approx((0.05, 0.1))
    assert abs(first.yaw_rad) == pytest.approx(np.pi)  # the short way round
    assert second.x_m == 2.0  # it was put there
    assert third.x_m == 5.0  # it is new
    assert between(before, after, 100) == after.vehicles


def test_only_cars_nearby_are_pictured(car):
    cars = (car(0.0, 0.0), car(3.0, -3.0, name="n2"), car(0.0, 5.0, name="n3"))
    around = near(WorldSnapshot(t_ns=0, tick=0, vehicles=cars), "n1", 4.0)
    assert [one.vehicle for one in around.vehicles] == ["n1", "n2"]


def test_a_car_that_is_nowhere_is_left_out(car):
    cars = (car(0.0, 0.0), car(0.3, 0.0, float("nan"), name="n2"), car(float("inf"), 0, name="n3"))
    around = near(WorldSnapshot(t_ns=0, tick=0, vehicles=cars), "n1", 4.0)
    assert [one.vehicle for one in around.vehicles] == ["n1"]
    nowhere = near(WorldSnapshot(t_ns=0, tick=0, vehicles=cars), "n2", 4.0)
    assert [one.vehicle for one in nowhere.vehicles] == ["n1"]


def test_cameras_may_be_given_and_change_from_frame_to_frame(
    city_map, car, optics, floor_drawn_once
):
    small = {"width_px": 160, "height_px": 90, "focal_px": 130.0}
    now = [optics(**small)]
    part = CameraPart(city_map, cameras=lambda _: {"front": now[0]})
    with Lockstep([Stage(car), part]) as city:
        frames = city.subscribe(N1_FRONT)
        city.run_for(0.3)
        bright = frames.drain()[-1].message
        now[0] = optics(**small, exposure=0.25)
        city.run_for(0.3)
        dark = frames.drain()[-1].message
    light = [
        cv2.imdecode(np.frombuffer(one.payload, np.uint8), cv2.IMREAD_COLOR).mean()
        for one in (bright, dark)
    ]
    assert light[1] == pytest.approx(light[0] / 4, rel=0.05)
