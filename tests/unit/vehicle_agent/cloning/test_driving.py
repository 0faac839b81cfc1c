import pytest
from msgspec.structs import replace

from scm.camera.part import CameraPart
from scm.errors import LearningError
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.part import WorldPart
from vehicle_agent.cloning.demonstration import Demonstration
from vehicle_agent.cloning.demonstrator import Demonstrator
from vehicle_agent.cloning.driving import NetworkPart
from vehicle_agent.cloning.learning import learn
from vehicle_agent.cloning.network import NETWORKS
from vehicle_agent.cloning.recording import Laps, RecordDemoPart
from vehicle_agent.cloning.training import Recipe

SCHOOL = load_map("driving_school")
OPEN = replace(SCHOOL, junctions=(), stop_lines=(), lights=())
START = Pose2(1.747806, 0.291194, -0.785398)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Return what the built-in driver drove in 12 s, and what was sent and seen meanwhile."""
    path = tmp_path_factory.mktemp("demo")
    part = RecordDemoPart("demo", "n1", path / "mine", laps=5)
    beside = RecordDemoPart("beside", "n1", path / "dagger", laps=5, dagger=True)
    world = WorldPart(OPEN, 1, (("n1", "nigel"),))
    with Lockstep([world, CameraPart(OPEN, 1), part, beside]) as city:
        city.run_for(12.0)
    return Demonstration(path / "mine")


@pytest.fixture(scope="module")
def network(recorded, tmp_path_factory):
    path = tmp_path_factory.mktemp("network") / "model.onnx"
    learn([recorded.path], NETWORKS["paper"], Recipe(epochs=1, copies=1, batch=32), path)
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


def driven(part, car="nigel", lasts_s=4.0, with_cameras=True):
    """Let a network drive; return the car and how far it went."""
    world = WorldPart(OPEN, 1)
    cameras = [CameraPart(OPEN, 1)] if with_cameras else []
    with Lockstep([world, *cameras, part]) as city:
        hosted = world.world.host("n1", car, START, 0)
        city.run_for(lasts_s)
        off = START.inverse() @ hosted.pose
        return off, part


def test_network_drives_by_frames_after_its_wheels_have_turned(network):
    off, part = driven(NetworkPart("net", "n1", network))
    assert part.problem == ""
    assert 50 < part.frames <= 60
    assert 0.15 < off.x < 0.75  # at 0.25 m/s, a second later
    assert 0.0 < part.infer_s < 0.5


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
    world, cameras = WorldPart(OPEN, 1), CameraPart(OPEN, 1)
    with Lockstep([world, cameras, NetworkPart("net", "n1", network)]) as city:
        hosted = world.world.host("n1", "nigel", START, 0)
        city.run_for(3.0)
        assert hosted.pose != START
        city.kill(cameras)
        city.run_for(2.5)
        before = hosted.pose
        city.run_for(1.0)
        assert hosted.pose.x == pytest.approx(before.x, abs=1e-3)
