from dataclasses import replace

import numpy as np
import pytest

from scm.errors import LearningError
from vehicle_agent.cloning.network import NETWORKS, FrameStack, network_named


@pytest.mark.parametrize(
    ("name", "outputs", "parameters"),
    [("paper", 1, 14_065), ("pilotnet", 2, 252_230), ("pilotnet", 1, 252_219)],
)
def test_networks_have_as_many_parameters_as_published(name, outputs, parameters):
    assert NETWORKS[name].parameters(outputs) == parameters


@pytest.mark.parametrize("network", NETWORKS.values(), ids=NETWORKS)
def test_view_is_red_first_and_without_sky(network):
    frame = np.zeros((180, 320, 3), np.uint8)
    frame[:54], frame[54:] = (0, 255, 0), (255, 0, 10)
    view = network.view([frame])
    assert view.shape == (network.height_px, network.width_px, 3)
    assert (view == (10, 0, 255)).all()


def test_stack_has_the_newest_frame_first_and_the_oldest_repeats():
    stack, ms = FrameStack(3), 1_000_000
    assert stack.add(0, "a") == ["a", "a", "a"]
    assert stack.add(100 * ms, "b") == ["b", "a", "a"]
    assert stack.add(200 * ms, "c") == ["c", "a", "a"]
    for number in range(3, 8):
        seen = stack.add(100 * number * ms, "abcdefgh"[number])
    assert seen == ["h", "f", "d"]
    assert stack.add(50 * ms, "i") == ["i", "i", "i"]  # another clock
    assert stack.add(9000 * ms, "j") == ["j", "j", "j"]  # those before are of long ago


def test_stack_is_seen_side_by_side():
    network = replace(NETWORKS["paper"], stack=2)
    frames = [np.full((180, 320, 3), grey, np.uint8) for grey in (10, 200)]
    view = network.view(frames)
    assert view.shape == (64, 64, 6)
    assert (view[..., :3] == 10).all()
    assert (view[..., 3:] == 200).all()
    assert network.parameters(1) == 14_065 + 3 * 8 * 11 * 11


def test_unknown_network_is_named():
    with pytest.raises(LearningError, match=r"got 'pilotnett' \(did you mean 'pilotnet'\?\)"):
        network_named("pilotnett")
