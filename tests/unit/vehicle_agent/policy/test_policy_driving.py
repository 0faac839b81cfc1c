"""A policy that was written in training drives a car of the city, on the lanes that it knows."""

import msgspec
import numpy as np
import onnx
import pytest
from msgspec.structs import replace

from scm.errors import LearningError
from scm.gym.policy_file import describe_policy, write_policy
from scm.maps.load import load_map
from scm.records.policy import POLICY_KEY, PolicyMetadata
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.signals.part import TrafficPart
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.drivers.course import Course
from scm.world.part import WorldPart
from vehicle_agent.policy.driving import PolicyPart
from vehicle_agent.policy.model import Policy, is_policy
from vehicle_agent.policy.senses import Senses
from vehicle_agent.trained_driver import STAND

SCHOOL = load_map("driving_school")
OPEN = replace(SCHOOL, junctions=(), stop_lines=(), lights=())
ROUND_M = 6.92


def driven(policy, city_map, lasts_s, vehicle="n1", car="nigel", **options):
    """Return how far the car came, how far off its lane it was, and the part that drove it."""
    part = PolicyPart("policy", vehicle, policy, **options)
    world = WorldPart(city_map, 1, ((vehicle, car),) if "spawn" not in options else ())
    course, off, began = Course(OPEN, 1), [], False
    with Lockstep([TrafficPart(city_map), world, part]) as city:
        states = city.subscribe(Subscription(VehicleState, {"vehicle": vehicle}))
        for _ in range(round(lasts_s / 0.5)):
            city.run_for(0.5)
            for state in (item.message for item in states.drain()):
                if not began:
                    began = True
                    senses = Senses(part.policy.metadata, OPEN, vehicle)
                    senses.look(state, STAND, 0)
                    course = senses._course
                course.follow(*(np.array([v]) for v in (state.x_m, state.y_m, state.yaw_rad)))
                off.append(course.known[0, 0])
    return course.known[0, 3], np.abs(off).max(initial=0.0), part


def metadata_of(policy):
    """Return the metadata of a policy's file."""
    (entry,) = onnx.load(policy).metadata_props
    return msgspec.json.decode(entry.value)


def with_metadata(policy, metadata, path):
    """Write a policy with other metadata."""
    model = onnx.load(policy)
    model.metadata_props[0].value = msgspec.json.encode(metadata).decode()
    onnx.save(model, path)


def policy_of(names, low, high):
    """Return the metadata of a policy that observes some columns, all of one range."""
    count = len(names)
    return PolicyMetadata(
        policy=1, task="", observations=tuple(names), low=(low,) * count, high=(high,) * count,
        car="nigel", period_s=0.05, agents=1, scm="",
    )  # fmt: skip


def test_policy_drives_round_as_it_did_in_training(envs, policy):
    way_m, off_m, part = driven(policy, OPEN, 20.0)
    assert (way_m, off_m) == (pytest.approx(4.2, abs=0.6), pytest.approx(0.0, abs=0.03))
    assert part.actions == pytest.approx(20.0 / 0.06, rel=0.35)  # states come each 20 ms
    action, seen = Policy(policy), envs.reset(seed=3)[0]
    began_m = envs.worlds.course.known[:, 3].copy()
    for _ in range(400):
        seen = envs.step(np.array([list(action(row))[:2] for row in seen.astype(float)]))[0]
    came_m = envs.worlds.course.known[:, 3] - began_m
    assert came_m == pytest.approx(way_m, abs=0.6)


def test_policy_of_speed_and_curvature_drives_as_it_did_in_training(cruising):
    envs, path = cruising
    way_m, off_m, part = driven(path, OPEN, 20.0)
    assert (way_m, off_m) == (pytest.approx(0.15 * 19.0, abs=0.25), pytest.approx(0.0, abs=0.03))
    assert part._speed_mps == pytest.approx(0.15, abs=0.01)
    action, seen = Policy(path), envs.reset(seed=3)[0]
    began_m = envs.worlds.course.known[:, 3].copy()
    for _ in range(400):
        seen = envs.step(np.array([action(row) for row in seen.astype(float)]))[0]
    assert envs.worlds.course.known[:, 3] - began_m == pytest.approx(0.15 * 20.0, abs=0.1)


def test_policy_of_speed_and_curvature_stops_at_red_and_goes_on_smoothly(cruising):
    _, path = cruising
    _, _, part = driven(path, SCHOOL, 12.0)
    assert part._waits_for.startswith("waits for green")
    assert part._action.throttle < 0.5  # it does not press on against the rule that holds the car
    free = driven(path, SCHOOL, 12.0, ignore_signals=True)[2]
    assert free._speed_mps == pytest.approx(0.15, abs=0.01)


def test_older_policy_commands_throttle_and_steering(policy, tmp_path):
    path = tmp_path / "older.onnx"
    metadata = metadata_of(policy)
    for name in ("actions", "action_low", "action_high"):
        del metadata[name]
    with_metadata(policy, metadata, path)
    seen = np.zeros(len(metadata["observations"]))
    assert Policy(path)(seen) == pytest.approx([0.8, 0.0])
    way_m, _, _ = driven(path, OPEN, 10.0)
    assert way_m == pytest.approx(driven(policy, OPEN, 10.0)[0], abs=1e-12)


def test_action_beyond_its_range_is_clipped(cruising, policy):
    for path, names, high in (
        (policy, ("throttle", "steering"), [1.0, 1.0]),
        (cruising[1], ("speed_mps", "curvature_per_m"), cruising[0].single_action_space.high),
    ):
        loaded = Policy(path)
        assert loaded.metadata.actions == names
        beside = loaded.metadata.observations.index("beside_m")
        seen = np.zeros(len(loaded.metadata.observations))
        seen[beside] = -9.0
        assert loaded(seen)[1] == pytest.approx(high[1])


def test_policy_of_unknown_actions_says_what_was_expected(policy, tmp_path):
    path = tmp_path / "unknown.onnx"
    with_metadata(policy, {**metadata_of(policy), "actions": ["speed_mps", "steering"]}, path)
    words = "its actions are speed_mps, steering: expected throttle, steering or speed_mps, curv"
    with pytest.raises(LearningError, match=words):
        Policy(path)


def test_car_that_was_carried_elsewhere_is_found_there():
    def state(x_m, y_m, yaw_rad):
        return VehicleState(
            vehicle="n1", t_ns=0, seq=1, x_m=x_m, y_m=y_m, yaw_rad=yaw_rad, speed_mps=0.2,
            yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.5, source="simulated",
        )  # fmt: skip

    names = "beside_m", "turned_rad", "lane_turn_0.8m_rad"
    senses = Senses(policy_of(names, -4.0, 4.0), SCHOOL, "n1")
    course = Course(SCHOOL, 2)
    poses = course.begin(np.arange(2), np.array([[0.1, 0.5, 0.5, 0.0], [0.6, 0.5, 0.5, 0.0]]), 0, 0)
    course.follow(*poses.T)
    for pose, known in zip(poses.tolist(), course.known, strict=True):
        senses.look(state(*pose), STAND, 0)  # the first look after it was carried finds it off
        assert senses.look(state(*pose), STAND, 0) == pytest.approx(known[[0, 1, 6]], abs=1e-3)
    for _ in range(2):
        beside_all = senses.look(state(1.4, -5.0, 0.0), STAND, 0)
    assert beside_all is None
    assert senses.missing == "a lane: it is beside all of them"


def test_policy_stops_at_red(policy):
    free_m, _, _ = driven(policy, SCHOOL, 12.0, ignore_signals=True)
    way_m, _, part = driven(policy, SCHOOL, 12.0)
    assert way_m < free_m - 0.5
    assert part._waits_for.startswith("waits for green")


def test_car_is_put_onto_the_map_if_requested(policy):
    way_m, _, part = driven(policy, OPEN, 6.0, spawn="")
    assert way_m > 0.5
    assert part.detail().endswith("actions")


def test_policy_drives_no_other_car_than_it_was_trained_on(policy):
    _, _, part = driven(policy, OPEN, 2.0, car="f1tenth")
    assert part.actions == 0
    assert part.problem == "the network was trained on a nigel, n1 is a f1tenth"


def test_policy_that_observes_what_no_car_knows_says_so(policy, tmp_path, envs):
    path = tmp_path / "more.onnx"
    metadata = metadata_of(policy)
    metadata["observations"][0] = "fuel_m"
    with_metadata(policy, metadata, path)
    with pytest.raises(LearningError, match="observes fuel_m: a car knows speed_mps, "):
        PolicyPart("policy", "n1", path)


def test_policy_of_lanes_says_that_a_map_has_none(policy):
    part = PolicyPart("policy", "n1", policy)
    with Lockstep([WorldPart(load_map("parking_school"), 1, (("n1", "nigel"),)), part]) as city:
        statuses = city.subscribe(Subscription(PartStatus, {"station": "policy"}))
        city.run_for(2.0)
        (*_, last) = [item.message for item in statuses.drain()]
    assert last.detail.startswith("map parking_school: expected a lane from which cars can drive")


def test_file_that_is_no_policy_says_what_was_expected(policy, tmp_path, envs):
    nothing, text = tmp_path / "none.onnx", tmp_path / "text.onnx"
    text.write_text("hello")
    bare = tmp_path / "bare.onnx"
    model = onnx.load(policy)
    del model.metadata_props[:]
    onnx.save(model, bare)
    for path, words in ((nothing, "no such file"), (text, "expected"), (bare, POLICY_KEY)):
        assert not is_policy(path)
        with pytest.raises(LearningError, match=words):
            Policy(path)
    describe_policy(bare, envs)
    assert Policy(bare).metadata.observations == envs.observation_names
    weights = np.full((len(envs.observation_names), 2), np.nan)
    broken = tmp_path / "nan.onnx"
    ones = np.ones(len(weights))
    write_policy(broken, [(weights, np.zeros(2))], 0.0 * ones, ones, envs)
    with pytest.raises(LearningError, match="are its weights NaN"):
        Policy(broken)
