import dataclasses
import shutil

import msgspec
import numpy as np
import onnx
import pytest
from onnx import numpy_helper

from scm.errors import LearningError
from scm.vehicles.car import load_car
from tests.unit.vehicle_agent.cloning.examples import SMALL, demonstration, line
from vehicle_agent.cloning.augmentation import Augmentation
from vehicle_agent.cloning.demonstration import Demonstration
from vehicle_agent.cloning.learning import learn
from vehicle_agent.cloning.model_file import KEY, Model
from vehicle_agent.cloning.training import Recipe, balanced

PLAIN = Augmentation(offset_std_m=0.0, heading_std_rad=0.0, mirrored=0.5, shadow=0.0)
RECIPE = Recipe(epochs=20, copies=4, batch=32, rate=5e-3, how=PLAIN)


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    path = tmp_path_factory.mktemp("learned")
    history = []
    demo = demonstration(path / "demo")
    metadata = learn([demo], SMALL, RECIPE, path / "model.onnx", history.append)
    return path, metadata, history


def test_network_learns_to_steer_by_a_line(learned):
    path, metadata, history = learned
    assert history[0].held_out_error > 2 * history[-1].held_out_error
    assert history[-1].held_out_error < 0.08
    assert metadata.held_out_error == history[-1].held_out_error
    model = Model(path / "model.onnx")
    for steering in (-0.7, -0.2, 0.0, 0.5):
        (command,) = model(SMALL.view([line(steering)]))
        assert command == pytest.approx(steering, abs=0.15)


def test_metadata_say_what_the_network_is(learned):
    path, metadata, _ = learned
    assert Model(path / "model.onnx").metadata == metadata
    assert (metadata.car, metadata.map, metadata.laps, metadata.throttle) == (
        "nigel",
        "driving_school",
        2,
        0.4,
    )
    assert 100 <= metadata.frames <= 120
    assert len(metadata.data_sha256) == 64


@pytest.fixture(scope="module")
def late(tmp_path_factory):
    """Return a demonstration whose commands come 0.2 s after the frames that demand them."""
    return demonstration(tmp_path_factory.mktemp("late") / "demo", late=2)


def test_network_that_sees_earlier_frames_learns_what_they_demand(late, tmp_path):
    network = dataclasses.replace(SMALL, stack=2)
    metadata = learn([late], network, RECIPE, tmp_path / "model.onnx")
    assert metadata.stack == 2
    assert metadata.held_out_error < 0.15
    model = Model(tmp_path / "model.onnx")
    (command,) = model(network.view([line(-0.7), line(0.6)]))  # newest first
    assert command == pytest.approx(0.6, abs=0.25)


def test_car_with_a_late_weak_servo_gets_earlier_stronger_commands(late, tmp_path):
    car = load_car("nigel").with_terms(
        ("steer_delay", "steer_gain"), {"steering.delay_s": 0.2, "steering.gain": 0.6}
    )
    metadata = learn([late], SMALL, RECIPE.fitted_to(car), tmp_path / "model.onnx")
    assert (metadata.steering_delay_s, metadata.steering_gain) == (0.2, 0.6)
    model = Model(tmp_path / "model.onnx")
    for steering in (-0.4, 0.3):
        (command,) = model(SMALL.view([line(steering)]))
        assert command == pytest.approx(steering / 0.6, abs=0.15)
    assert RECIPE.fitted_to(load_car("nigel")) == RECIPE


def test_same_seed_same_network(learned, tmp_path):
    path, _, _ = learned
    brief = dataclasses.replace(RECIPE, epochs=1, copies=1)
    errors = [
        learn([path / "demo"], SMALL, dataclasses.replace(brief, seed=seed), tmp_path / "a.onnx")
        for seed in (0, 0, 1)
    ]
    first, again, other = (one.held_out_error for one in errors)
    assert again == pytest.approx(first, abs=1e-6)
    assert other != pytest.approx(first, abs=1e-6)


def damaged(model, how):
    """Return the bytes of a network that cannot be used."""
    whole = model.read_bytes()
    if how == "truncated":
        return whole[: len(whole) // 2]
    graph = onnx.load_from_string(whole)
    if how == "nan":
        numbers = graph.graph.initializer[-1]
        values = np.full_like(numpy_helper.to_array(numbers), np.nan)
        numbers.CopyFrom(numpy_helper.from_array(values, numbers.name))
    elif how == "no metadata":
        del graph.metadata_props[:]
    elif how == "other metadata":
        metadata = msgspec.json.decode(graph.metadata_props[0].value)
        graph.metadata_props[0].value = msgspec.json.encode(
            {**metadata, "outputs": ["gear"]}
        ).decode()
    elif how == "other input":
        graph.graph.input[0].type.tensor_type.shape.dim[3].dim_value = 4
    return graph.SerializeToString()


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("truncated", "expected a trained network"),
        ("nan", "are its weights NaN?"),
        ("no metadata", f"without metadata ({KEY})"),
        ("other metadata", "its metadata: expected model 1 and outputs"),
        ("other input", "expected"),
    ],
)
def test_network_that_cannot_be_used_is_refused_in_words(learned, tmp_path, how, words):
    path = tmp_path / "bad.onnx"
    path.write_bytes(damaged(learned[0] / "model.onnx", how))
    with pytest.raises(LearningError) as raised:
        Model(path)
    assert str(raised.value).startswith(f"{path}: ")
    assert words in str(raised.value)


def test_network_that_is_missing_is_named(tmp_path):
    with pytest.raises(LearningError, match="got no such file"):
        Model(tmp_path / "none.onnx")


def test_damaged_demonstration_is_named(learned, tmp_path):
    with pytest.raises(LearningError, match=r"demonstration\.json: there is no such file"):
        Demonstration(tmp_path)
    shutil.copytree(learned[0] / "demo", tmp_path / "demo")
    demo = Demonstration(tmp_path / "demo")
    (tmp_path / "demo" / "frames" / "000003.jpg").unlink()
    with pytest.raises(LearningError, match=r"000003\.jpg: expected a frame, got no such file"):
        demo.frame(demo.samples[3])
    (tmp_path / "demo" / "samples.parquet").write_bytes(b"none")
    with pytest.raises(LearningError, match=r"samples\.parquet"):
        Demonstration(tmp_path / "demo")


def test_too_few_frames_and_two_cars_are_refused(learned, tmp_path):
    few = demonstration(tmp_path / "few", count=60)
    with pytest.raises(LearningError, match=r"expected 100 frames or more .* drive more laps"):
        learn([few], SMALL, RECIPE, tmp_path / "few.onnx")
    other = demonstration(tmp_path / "other", car="f1tenth")
    with pytest.raises(LearningError, match="of one car, got f1tenth and nigel"):
        learn([few, other], SMALL, RECIPE, tmp_path / "other.onnx")


def test_most_frames_that_go_straight_are_left_out():
    steering = np.concatenate((np.zeros(1000), np.full(50, 0.3)))
    stays = balanced(steering, np.random.default_rng(0))
    assert stays[1000:].all()
    assert 150 < stays[:1000].sum() < 250
