"""Each argument of a client's method goes where the interface expects it."""

import json

import httpx
import pytest

from scm.client.connection import Connection
from scm.client.nouns.mismatch import MismatchNoun
from scm.client.nouns.scenarios import ScenariosNoun
from scm.client.nouns.vehicles import VehiclesNoun


@pytest.fixture
def sent():
    """Make a noun whose server answers by one response; the requests stand in a list."""
    opened = []

    def make(noun, response):
        requests = []

        def handle(request):
            requests.append(request)
            return response

        connection = Connection("http://city", transport=httpx.MockTransport(handle))
        opened.append(connection)
        return noun(connection), requests

    yield make
    for one in opened:
        one.close()


def test_body_holds_what_has_a_value_and_key_stands_in_its_header(sent):
    reply = {"vehicle": "n1", "trip_id": "n1-1", "route": [], "length_m": None}
    vehicles, requests = sent(VehiclesNoun, httpx.Response(200, json=reply))
    assert vehicles.route("n 1", via=("a", "b"), idempotency_key="once").vehicle == "n1"
    (request,) = requests
    assert (request.method, request.url.raw_path) == ("POST", b"/api/v1/vehicles/n%201/route")
    assert json.loads(request.content) == {"via": ["a", "b"], "laps": 1, "then": "stop"}
    assert request.headers["idempotency-key"] == "once"


def test_body_without_any_value_is_an_empty_object(sent):
    lights = {"vehicle": "n1", "headlights": "low", "indicators": "off"}
    vehicles, requests = sent(VehiclesNoun, httpx.Response(200, json=lights))
    vehicles.lights("n1")
    assert requests[0].content == b"{}"


def test_delete_sends_a_query_and_conditions_as_headers(sent):
    vehicles, requests = sent(VehiclesNoun, httpx.Response(200, json={"vehicle": "n1"}))
    vehicles.remove("n1", reason="wet")
    assert str(requests[0].url) == "http://city/api/v1/vehicles/n1?reason=wet"
    scenarios, requests = sent(ScenariosNoun, httpx.Response(204))
    assert scenarios.remove("lap", if_match='"7"') is None
    assert requests[0].headers["if-match"] == '"7"'
    assert "if-none-match" not in requests[0].headers


def test_bytes_are_sent_as_they_are_beside_a_query(sent):
    upload = {"upload": "u", "files": 1, "size_bytes": 3, "vehicles": []}
    mismatch, requests = sent(MismatchNoun, httpx.Response(201, json=upload))
    assert mismatch.upload(name="run.csv", content=b"t,x").upload == "u"
    assert requests[0].url.params["name"] == "run.csv"
    assert requests[0].content == b"t,x"
    assert requests[0].headers["content-type"] == "application/octet-stream"


def test_wrong_arguments_are_refused_before_anything_is_sent(sent):
    vehicles, requests = sent(VehiclesNoun, httpx.Response(200))
    with pytest.raises(TypeError, match="colour"):
        vehicles.spawn(colour="red")
    assert not requests
