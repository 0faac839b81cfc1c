"""What people see of a network that drives: by which cells it steers, and how often that comes."""

import numpy as np
import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.network_view import NetworkView
from vehicle_agent.autonomy.control import Command
from vehicle_agent.cloning.network import SKY
from vehicle_agent.cloning.saliency import COLUMNS, ROWS, NetworkWatch, Occlusion

VIEW = np.random.default_rng(0).integers(0, 256, (50, 120, 3)).astype(np.uint8)
VIEW[20:30, 20:30], VIEW[20:30, 90:100] = 255, 255  # row 2, columns 2 and 9


def commands_of(view):
    """A network that steers left for light in one cell, and half as much right in another."""
    return (float(view[20:30, 20:30].mean() - 0.5 * view[20:30, 90:100].mean()) / 255.0,)


@pytest.fixture
def watch():
    watch = NetworkWatch("n1", "paper", "model.onnx", commands_of)
    watch.is_wanted = True
    watch.requests = []

    def is_wanted(kind, where):
        watch.requests.append((kind, where))
        return watch.is_wanted

    watch.attach(is_wanted)
    return watch


def frame(t_ns):
    return CameraFrame(
        vehicle="n1", camera="front", t_ns=t_ns, width_px=4, height_px=4, payload=b""
    )


def offered(watch, t_ns):
    watch.begin(frame(t_ns), VIEW, Command(0.9, 0.25), t_ns + 30 * NS_PER_MS, 0.004)


def published(watch, steps=ROWS * COLUMNS):
    return [message for _ in range(steps) for message in watch.step(is_idle=True)]


def test_saliency_is_by_how_much_a_blurred_cell_changes_the_steering():
    occlusion = Occlusion(commands_of, VIEW)
    occlusion.advance(60.0)
    changes = np.array(occlusion.changes).reshape(ROWS, COLUMNS)
    strongest = np.unravel_index(np.argmax(np.abs(changes)), changes.shape)
    assert strongest == (2, 2)
    assert changes[2, 2] < -0.2  # without it the car steers less to the left
    assert changes[2, 9] == pytest.approx(-0.5 * changes[2, 2], rel=0.3)
    assert np.abs(changes[:, 5:7]).max() == 0.0


def test_saliency_of_a_stack_of_frames_blurs_all_of_them():
    occlusion = Occlusion(lambda stack: commands_of(stack[:, :, 3:]), np.dstack([VIEW, VIEW]))
    occlusion.advance(60.0)
    assert occlusion.changes[2 * COLUMNS + 2] < -0.2


def test_no_step_computes_longer_than_its_budget():
    occlusion = Occlusion(commands_of, VIEW)
    occlusion.advance(0.0)
    assert len(occlusion.changes) == 1
    assert not occlusion.is_complete


def test_a_message_has_the_frame_s_time_and_how_long_its_command_took(watch):
    offered(watch, 5 * NS_PER_S)
    (message,) = published(watch)
    assert (message.vehicle, message.camera, message.t_ns) == ("n1", "front", 5 * NS_PER_S)
    assert (message.network, message.file) == ("paper", "model.onnx")
    assert (message.steering, message.throttle) == (0.25, 0.9)
    assert message.delay_s == pytest.approx(0.034)
    assert message.inference_s == 0.004
    assert message.top == SKY
    assert (message.rows, message.columns) == (ROWS, COLUMNS)
    assert np.argmin(message.saliency) == 2 * COLUMNS + 2
    assert watch.requests == [(NetworkView, {"vehicle": "n1"})]


def test_frames_are_passed_over_for_a_quarter_of_a_second(watch):
    for t_ns in range(0, NS_PER_S, 50 * NS_PER_MS):
        offered(watch, 5 * NS_PER_S + t_ns)
        published(watch)
    assert len(watch.requests) == 4


def test_a_step_with_a_frame_computes_nothing_more(watch):
    offered(watch, 5 * NS_PER_S)
    watch._run = None
    assert watch.step(is_idle=False) == []


def test_nothing_is_computed_while_nobody_subscribes(watch):
    watch.is_wanted = False
    offered(watch, 5 * NS_PER_S)
    watch._run = None
    assert published(watch) == []
