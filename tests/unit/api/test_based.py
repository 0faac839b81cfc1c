"""Below a path of another host: addresses lead back there, and the red stop gets through."""

import re

import pytest

from scm.api.app import create_app
from scm.api.based import Site
from scm.errors import RunError
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from tests.unit.api.conftest import bearer

LAB = {"Origin": "https://lab.example", "Sec-Fetch-Site": "same-origin"}


@pytest.fixture
def client(view, fake_city, city_map, client_of):
    fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
    fake_city.answers[SpawnRequest] = SpawnReply(
        vehicle="n7", tag_id=7, x_m=0.0, y_m=0.0, yaw_rad=0.0
    )
    site = Site("/city/", ["https://lab.example"])
    return client_of(create_app(view, fake_city.ask, city_map, site=site))


@pytest.mark.parametrize("before", ["/city", ""])
def test_every_address_of_a_page_lies_below_the_base_whether_the_proxy_takes_it_off_or_not(
    client, before
):
    addresses = set()
    for path in ("/", "/map", "/vehicles/n1", "/docs", "/nowhere"):
        text = client("GET", before + path, headers={"Accept": "text/html"}).text
        assert 'data-base="/city"' in text
        found = re.findall(r'(?:href|src)="(/[^"]*)"|: "(/[^"]*)"', text)
        assert len(found) > 5
        addresses |= set(map("".join, found))
    for address in addresses:
        assert address.startswith("/city/"), address
        assert client("GET", address).status_code == 200 or address.endswith("/"), address
    assert client("GET", before + "/api/v1/vehicles").status_code == 200


def test_places_and_cookies_lie_below_the_base(client, keyed_app, view, fake_city, city_map, ring,
                                               key_of, client_of):  # fmt: skip
    made = client("POST", "/city/api/v1/vehicles", json={"vehicle": "n7"}, headers=LAB)
    assert made.headers["location"] == "/city/api/v1/vehicles/n7"
    assert client("GET", "/api/v1/openapi.json").json()["servers"] == [{"url": "/city"}]
    keyed = client_of(create_app(view, fake_city.ask, city_map, keys=ring, site=Site("/city")))
    begun = keyed("PUT", "/city/api/v1/session", headers=bearer(key_of("operator")))
    assert "Path=/city/api;" in begun.headers["set-cookie"] + ";"


def test_a_page_may_change_things_through_a_proxy_that_calls_us_by_another_name(client):
    stop = {"json": {"engaged": True}}
    assert client("PUT", "/api/v1/stop", headers=LAB, **stop).status_code == 200
    other = {**LAB, "Origin": "https://lab.example.evil"}
    assert client("PUT", "/api/v1/stop", headers=other, **stop).status_code == 403


def test_a_key_in_the_header_gets_the_red_stop_through_any_proxy(keyed_app, key_of, client_of):
    client, stop = client_of(keyed_app), {"json": {"engaged": True}}
    headers = {**LAB, **bearer(key_of("operator"))}
    assert client("PUT", "/api/v1/stop", headers=headers, **stop).status_code == 200
    assert client("PUT", "/api/v1/stop", headers=LAB, **stop).status_code == 403


@pytest.mark.parametrize("base", ["city", "/map", "/api", "/a b", "//x", '/a"b', "/../x"])
def test_a_base_that_cannot_be_is_refused(view, fake_city, city_map, base):
    with pytest.raises(RunError, match="base: got"):
        create_app(view, fake_city.ask, city_map, site=Site(base))
