"""Neighbouring cities over REST."""

import msgspec
import pytest

from scm.api.app import create_app
from scm.records.city_map import Neighbour
from scm.v2x.messages.neighbour_status import NeighbourStatus


@pytest.fixture
def rows(view, fake_city, city_map, client_of):
    """Return a function that returns the rows of a city with one neighbour."""
    neighbour = Neighbour(city="lab_b", messages=("states",))
    joined_map = msgspec.structs.replace(city_map, neighbours=(neighbour,))
    client = client_of(create_app(view, fake_city.ask, joined_map))
    return lambda: client("GET", "/api/v1/neighbours").json()["neighbours"]


def test_neighbour_is_shown_with_its_state_and_what_each_sees(rows, hear):
    status = NeighbourStatus(
        neighbour="lab_b", t_ns=2, state="joined", since_ns=1, shows=("states",), sees=("cams",)
    )
    hear(2.0, status)
    (row,) = rows()
    assert (row["city"], row["state"], row["since_ns"]) == ("lab_b", "joined", 1)
    assert (row["shows"], row["sees"]) == (["states"], ["cams"])


def test_neighbour_is_unknown_before_its_gateway_reports_and_when_it_falls_silent(rows, hear):
    assert [row["state"] for row in rows()] == ["unknown"]
    hear(2.0, NeighbourStatus(neighbour="lab_b", t_ns=2, state="lost", since_ns=1, reason="cut"))
    assert [(row["state"], row["reason"]) for row in rows()] == [("lost", "cut")]
    hear(20.0)
    assert [row["state"] for row in rows()] == ["unknown"]


def test_city_without_neighbours_has_none(client):
    assert client("GET", "/api/v1/neighbours").json() == {"neighbours": []}
