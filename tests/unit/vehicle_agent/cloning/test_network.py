import numpy as np
import pytest

from scm.errors import LearningError
from vehicle_agent.cloning.network import NETWORKS, network_named


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
    view = network.view(frame)
    assert view.shape == (network.height_px, network.width_px, 3)
    assert (view == (10, 0, 255)).all()


def test_unknown_network_is_named():
    with pytest.raises(LearningError, match=r"got 'pilotnett' \(did you mean 'pilotnet'\?\)"):
        network_named("pilotnett")
