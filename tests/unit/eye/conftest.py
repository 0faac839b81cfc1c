"""The empty city through one lens is drawn once: it takes longer than most tests' frames."""

import msgspec
import pytest

from scm.eye.render import shots
from scm.eye.render.floor import draw_scenery
from scm.eye.sources import synthetic


@pytest.fixture(scope="package", autouse=True)
def sceneries_drawn_once():
    drawn = {}

    def draw_once(city_map, model, rng):
        arrays = (model.matrix, model.distortion, model.position, model.camera_R_map)
        lens = (repr(model.camera), *(array.tobytes() for array in arrays))
        key = (msgspec.json.encode(city_map), lens, str(rng.bit_generator.state))
        if key not in drawn:
            drawn[key] = draw_scenery(city_map, model, rng), rng.bit_generator.state
        scenery, rng.bit_generator.state = drawn[key]
        return scenery

    with pytest.MonkeyPatch.context() as patch:
        for module in (shots, synthetic):
            patch.setattr(module, "draw_scenery", draw_once)
        yield


@pytest.fixture
def sceneries_drawn_anew(monkeypatch):
    """Draw each by itself, where a test is about its grain as well."""
    for module in (shots, synthetic):
        monkeypatch.setattr(module, "draw_scenery", draw_scenery)
