"""The first car of a file must not stop the city while its kernel is compiled."""

from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.vehicles.car import car_names
from scm.vehicles.compiler import kernel_file
from tests.unit.world.conftest import City


def test_on_a_first_start_every_car_file_is_compiled_before_the_world_opens(monkeypatch):
    monkeypatch.setattr(kernel_file, "_COMPILED", {})
    monkeypatch.setattr("scm.world.world.is_first_start", lambda: True)
    city, compiled = City(), []
    monkeypatch.setattr(kernel_file, "write_page", lambda *terms, **_: compiled.append(terms))
    for car in car_names():
        assert isinstance(city.ask(SpawnRequest(car=car)), SpawnReply), car
        city.run(1)
    assert compiled == []
