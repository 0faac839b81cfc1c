import math

import cv2
import numpy as np
import pytest
from msgspec.structs import replace

from scm.camera.optics import optics_of
from scm.camera.part import CameraPart
from scm.clock import NS_PER_MS
from scm.errors import LearningError
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Path, roads_of
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, Subscription
from scm.traffic.signals.part import TrafficPart
from scm.v2x.exchange import Incoming
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.network_view import NetworkView
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.vehicles.car import load_car
from scm.vehicles.drivers.limits import limits_of
from scm.world.part import WorldPart
from vehicle_agent.cloning.demonstration import Demonstration
from vehicle_agent.cloning.demonstrator import Demonstrator
from vehicle_agent.cloning.driving import NetworkPart
from vehicle_agent.cloning.learning import write
from vehicle_agent.cloning.model_file import Metadata
from vehicle_agent.cloning.network import NETWORKS
from vehicle_agent.cloning.recording import Laps, RecordDemoPart

SCHOOL = load_map("driving_school")
OPEN = replace(SCHOOL, junctions=(), stop_lines=(), lights=())
NIGEL = limits_of(load_car("nigel"))
FRONT = {"front": optics_of(load_car("nigel"), "front").of_width(320)}
PAPER = NETWORKS["paper"]
START = Pose2(1.747806, 0.291194, -0.785398)


def front_camera():
    """Return what renders the front camera as small as demonstrations store it."""
    return CameraPart(OPEN, 1, cameras=lambda _: FRONT)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Return what the built-in driver drove in 12 s, and what was sent and seen meanwhile."""
    path = tmp_path_factory.mktemp("demo")
    part = RecordDemoPart("demo", "n1", path / "mine", laps=5)
    beside = RecordDemoPart("beside", "n1", path / "dagger", laps=5, dagger=True)
    world = WorldPart(OPEN, 1, (("n1", "nigel"),))
    with Lockstep([world, front_camera(), part, beside]) as city:
        city.run_for(12.0)
    return Demonstration(path / "mine")


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    """Return the file of a network that has not learned yet."""
    path = tmp_path_factory.mktemp("network") / "model.onnx"
    rng = np.random.default_rng(1)
    weights = [
        (rng.normal(0.0, np.prod(one[:-1]) ** -0.5, one), np.zeros(one[-1]))
        for one in PAPER.shapes(1)
    ]
    metadata = Metadata(
        model=1, network="paper", outputs=("steering",), car="nigel", map="driving_school",
        throttle=0.8, delay_s=0.03, frames=0, laps=0, epochs=0, seed=1, error=1.0,
        held_out_error=None, data_sha256="", scm="",
    )  # fmt: skip
    write(path, PAPER, weights, metadata)
    return path


def test_demonstration_has_frames_with_the_commands_in_force_as_they_arrived(recorded):
    assert 150 < len(recorded.samples) < 181  # 15 Hz
    assert recorded.about.car == "nigel"
    assert recorded.about.map == "driving_school"
    assert 0.0 < recorded.about.delay_s < 0.06
    assert recorded.frame(recorded.samples[0]).shape == (180, 320, 3)
    later = [one for one in recorded.samples if one.t_ns > 4e9]
    assert all(0 <= one.arrived_ns - one.t_ns < 60e6 for one in later)
    assert min(one.speed_mps for one in later) > 0.2
    assert max(abs(one.steering) for one in later) > 0.45  # in a loop


def test_demonstrator_would_do_what_the_built_in_driver_does(recorded):
    beside = Demonstration(recorded.path.parent / "dagger")
    same = {one.t_ns: one.steering for one in beside.samples if one.t_ns > 4e9}
    done = {one.t_ns: one.steering for one in recorded.samples if one.t_ns in same}
    assert len(done) > 100
    assert max(abs(same[t_ns] - done[t_ns]) for t_ns in done) < 0.03
    assert max(same.values()) - min(same.values()) > 0.4


def state(pose, t_ns=0):
    return VehicleState(
        vehicle="n1", t_ns=t_ns, seq=1, x_m=pose.x, y_m=pose.y, yaw_rad=pose.yaw, speed_mps=0.2,
        yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.5, source="simulated",
    )  # fmt: skip


def test_demonstrator_leads_back_to_the_lane_and_gives_up_beside_all():
    demonstrator = Demonstrator(OPEN)
    (_, inside), (_, left), (_, right) = (
        demonstrator.commands(state(START @ Pose2(0.0, beside_m, 0.0), n * 10**9))
        for n, beside_m in enumerate((0.0, 0.03, -0.03))
    )
    assert left < inside - 0.05
    assert right > inside + 0.05
    assert demonstrator.commands(state(Pose2(9.0, 9.0, 0.0))) is None
    assert demonstrator.commands(state(START)) is not None


def test_dagger_stores_the_demonstrator_s_commands_and_not_those_in_force(tmp_path):
    part = RecordDemoPart("demo", "n1", tmp_path, laps=1, dagger=True)
    _, jpeg = cv2.imencode(".jpg", np.zeros((36, 64, 3), np.uint8))
    frame = CameraFrame(
        vehicle="n1", camera="front", t_ns=0, width_px=64, height_px=36, payload=jpeg.tobytes()
    )
    where = replace(state(START @ Pose2(0.0, 0.03, 0.0)), steering=0.9)
    for message in (WorldDefinition(t_ns=0, seed=0, map=SCHOOL), frame, where):
        part.step(0, [Incoming(message, 0)])
    part.finish(0)
    (sample,) = Demonstration(tmp_path).samples
    assert sample.steering == pytest.approx(Demonstrator(OPEN).commands(where)[1])
    assert sample.steering < 0.8


def test_demonstration_is_not_overwritten(recorded):
    with pytest.raises(LearningError, match="has a demonstration already"):
        RecordDemoPart("demo", "n1", recorded.path, laps=1)


def test_lap_is_over_where_it_began_the_same_way_round():
    laps = Laps()
    there = [Pose2(0.1 * k, 0.0, 0.0) for k in range(31)]
    for pose in (*there, *(Pose2(one.x, one.y, 3.1) for one in reversed(there))):
        laps.add(pose, 0.2)
    assert laps.done == 0  # it came back the other way round
    for pose in there:
        laps.add(pose, 0.2)
    assert laps.done == 1


class Watcher(BasePart):
    """Receives the frames, and what the network makes of them."""

    name, role, period_ns = "watcher", "client", 20_000_000
    subscriptions = (
        Subscription(NetworkView, {"vehicle": "n1"}),
        Subscription(CameraFrame, {"vehicle": "n1", "camera": "front"}),
    )

    def __init__(self):
        self.views, self.frames_ns = [], []

    def step(self, now_ns, inbox):
        for item in inbox:
            if isinstance(item.message, NetworkView):
                self.views.append(item.message)
            else:
                self.frames_ns.append(item.message.t_ns)
        return []


def driven(part, car="nigel", lasts_s=4.0, with_cameras=True, others=()):
    """Let a network drive; return the car and how far it went."""
    world = WorldPart(OPEN, 1)
    cameras = [front_camera()] if with_cameras else []
    with Lockstep([world, *cameras, part, *others]) as city:
        hosted = world.world.host("n1", car, START, 0)
        city.run_for(lasts_s)
        off = START.inverse() @ hosted.pose
        return off, part


def test_network_drives_by_frames_after_its_wheels_have_turned(network):
    watcher = Watcher()
    off, part = driven(NetworkPart("net", "n1", network), others=[watcher])
    assert part.problem == ""
    assert 50 < part.frames <= 60
    assert 0.15 < off.x < 0.75  # at 0.25 m/s, a second later
    assert 0.0 < part.infer_s < 0.5
    assert 2 <= len(watcher.views) <= 16  # 4 a second, fewer on a busy machine
    assert {view.t_ns for view in watcher.views} <= set(watcher.frames_ns)
    assert watcher.views[-1].throttle > 0.5
    assert any(change != 0.0 for change in watcher.views[-1].saliency)


def test_car_that_stands_turns_its_wheels_first(network):
    off, part = driven(NetworkPart("net", "n1", network), lasts_s=1.1)
    assert part.frames > 10
    assert abs(off.x) < 0.005


def test_network_of_another_car_stands_and_says_so(network):
    off, part = driven(NetworkPart("net", "n1", network), car="f1tenth")
    assert part.problem == "the network was trained on a nigel, n1 is a f1tenth"
    assert abs(off.x) < 0.01


def test_without_frames_the_car_stands(network):
    off, part = driven(NetworkPart("net", "n1", network), with_cameras=False)
    assert part.frames == 0
    assert abs(off.x) < 0.01


def test_car_stands_when_its_frames_stop(network):
    world, cameras = WorldPart(OPEN, 1), front_camera()
    with Lockstep([world, cameras, NetworkPart("net", "n1", network)]) as city:
        hosted = world.world.host("n1", "nigel", START, 0)
        city.run_for(3.0)
        assert hosted.pose != START
        city.kill(cameras)
        city.run_for(2.5)
        before = hosted.pose
        city.run_for(1.0)
        assert hosted.pose.x == pytest.approx(before.x, abs=1e-3)


class Follower:
    """Stands for a network that has learned to steer: it follows the lanes by the true pose."""

    def __init__(self, model, hosted):
        self.metadata, self._hosted = model.metadata, hosted
        self._lanes, self._s = Path.circulation(roads_of(SCHOOL), "crossing_south_east"), 0.0

    def __call__(self, frame):
        pose = self._hosted.pose
        self._s, _ = self._lanes.project(pose.x, pose.y, self._s)
        goal = pose.inverse() @ self._lanes.at(self._s + 0.2)
        curvature = 2.0 * goal.y / (goal.x**2 + goal.y**2)
        return [math.atan(NIGEL.wheelbase * curvature) / NIGEL.steer_limit]


class BlankFrames(BasePart):
    """A front camera that renders nothing."""

    name, role, period_ns, subscriptions = "camera", "client", 60 * NS_PER_MS, ()
    jpeg = cv2.imencode(".jpg", np.zeros((180, 320, 3), np.uint8))[1].tobytes()

    def step(self, now_ns, inbox):
        frame = CameraFrame(
            vehicle="n1", camera="front", t_ns=now_ns, width_px=320, height_px=180,
            payload=self.jpeg,
        )  # fmt: skip
        return [frame]


def beyond_line(network, **options):
    """Let a car drive towards an all-red crossing for 4.6 s, and for 6 s more.

    Returns how far its front was beyond the line then [m], and what the part reported.
    """
    world, part = WorldPart(SCHOOL, 1), NetworkPart("net", "n1", network, **options)
    line = SCHOOL.stop_lines[0]
    lane = roads_of(SCHOOL).lane(line.lane)
    with Lockstep([world, TrafficPart(SCHOOL), BlankFrames(), part]) as city:
        statuses = city.subscribe(Subscription(PartStatus, {"station": "net"}))
        start = lane.at(line.at_m - NIGEL.front - 0.35)
        hosted = world.world.host("n1", "nigel", start, 0)
        part.model = Follower(part.model, hosted)
        beyond, modes = [], []
        for lasts_s in (4.6, 6.0):
            city.run_for(lasts_s)
            s, _ = lane.project(hosted.pose.x, hosted.pose.y)
            beyond.append(s + NIGEL.front - line.at_m)
            modes.append(hosted.mode)
        assert modes == ["drive", "drive"], "its commands never stop, at red either"
        return beyond, [item.message.detail for item in statuses.drain()]


def test_network_stands_at_red_and_goes_on_at_green(network):
    (at_red, later), details = beyond_line(network)
    assert -0.08 < at_red < 0.0
    assert details[4] == "waits for green at south_east of crossing"
    assert later > 0.2
    assert details[-1].endswith("ms a frame")


def test_network_may_ignore_signals(network):
    (at_red, _), _ = beyond_line(network, ignore_signals=True)
    assert at_red > 0.1
