"""The client keeps step with the interface: each operation has its method, byte for byte."""

import importlib.util
from pathlib import Path

import pytest

from scm.client import Client

ROOT = Path(__file__).parents[2]
AGAIN = "run `python docs/make/client.py` and commit what it writes"


@pytest.fixture(scope="module")
def maker():
    spec = importlib.util.spec_from_file_location("make_client", ROOT / "docs/make/client.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def document(maker):
    return maker.description()


def test_writing_the_client_again_gives_the_same_bytes(maker, document, tmp_path):
    made = maker.formatted(maker.files(document), tmp_path)
    folder = ROOT / "scm/client"
    there = [*folder.glob("nouns/*.py"), folder / "client.py"]
    assert {str(path.relative_to(folder)) for path in there} == set(made), AGAIN
    changed = [path for path, text in made.items() if (folder / path).read_text("utf-8") != text]
    assert not changed, AGAIN


def test_every_operation_has_a_method_of_its_noun(document):
    client = Client()
    for methods in document["paths"].values():
        for operation in methods.values():
            noun = operation["tags"][0]
            method = operation["operationId"].removeprefix(f"{noun}_")
            assert callable(getattr(getattr(client, noun), method)), operation["operationId"]
    client.close()


def test_a_new_route_would_be_noticed(maker, document):
    """The first test fails for it: it changes what would be written."""
    path = "/api/v1/stations/{name}/mood"
    one = document["paths"]["/api/v1/stations/{name}"]["get"]
    more = {path: {"get": {**one, "operationId": "stations_mood"}}}
    wider = {**document, "paths": {**document["paths"], **more}}
    assert "def mood(self, name: str)" in maker.files(wider)["nouns/stations.py"]
    assert "def mood(" not in maker.files(document)["nouns/stations.py"]
