"""NGSI-LD entities: names and units of the models, places of the enlarged city, and the floor's."""

import math

import msgspec
import pytest

from scm.records.traffic import LaneCount
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.etsi.convert import place_of
from scm.v2x.messages.traffic_counts import TrafficCounts

WHERE = "/ngsi-ld/v1/entities"
LD = {"Accept": "application/ld+json"}


@pytest.fixture
def city_of_two(hear, snapshot):
    hear(2.0, snapshot(at_s=1.0, n1=(1.384, 0.655, -math.pi / 2), n2=(0.2, 0.1, 0.0)))


def test_a_car_is_a_vehicle_in_the_units_of_the_model(client, city_of_two):
    car = client("GET", f"{WHERE}/urn:ngsi-ld:Vehicle:driving_school:n1").json()
    assert car["type"] == "Vehicle"
    assert car["speed"]["value"] == pytest.approx(0.2 * SCALE * 3.6, abs=1e-3)
    assert (car["speed"]["unitCode"], car["heading"]["value"]) == ("KMH", 180.0)
    assert car["floorPose"]["value"] == {"x_m": 1.384, "y_m": 0.655, "yaw_rad": -1.5708}
    longitude, latitude = car["location"]["value"]["coordinates"]
    place = place_of(round(latitude * 1e7), round(longitude * 1e7))
    assert place == pytest.approx((1.384, 0.655), abs=1e-3)
    assert car["location"]["observedAt"] == "1970-01-01T00:00:02.000Z"


def test_who_stands_has_no_heading_and_who_is_lost_is_broken(client, hear, snapshot):
    told = snapshot(at_s=1.0, n1=(0.0, 0.0, 0.0), n2=(1.0, 0.0, 0.0))
    n1, n2 = told.vehicles
    stands = msgspec.structs.replace(n1, speed_mps=0.0)
    lost = msgspec.structs.replace(n2, alive=False)
    hear(2.0, msgspec.structs.replace(told, vehicles=(stands, lost)))
    one, other = client("GET", f"{WHERE}?type=Vehicle&options=keyValues").json()
    assert (one["heading"], one["serviceStatus"]) == (-1, "parked")
    assert (other["heading"], other["serviceStatus"]) == (90.0, "broken")


def test_a_lane_is_a_road_segment_of_full_size(client, city_map):
    found = client("GET", f"{WHERE}?type=RoadSegment&limit=100").json()
    assert [one["name"]["value"] for one in found] == [lane.name for lane in city_map.lanes]
    loop = next(one for one in found if one["name"]["value"] == "east_loop")
    assert loop["length"]["value"] == pytest.approx(0.5145 * 4.014257 * SCALE / 1000.0, abs=1e-5)
    assert loop["maximumAllowedSpeed"]["value"] == pytest.approx(0.25 * SCALE * 3.6)
    assert loop["location"]["value"]["coordinates"][0] == loop["startPoint"]["value"]["coordinates"]


def test_counts_of_a_lane_are_a_traffic_flow(client, hear):
    lane = LaneCount(lane="east_loop", passed=14, flow_hz=0.05, headway_s=20.0, speed_mps=0.2)
    hear(2.0, TrafficCounts(t_ns=400 * 10**9, window_s=300.0, lanes=(lane,)))
    (flow,) = client("GET", f"{WHERE}?type=TrafficFlowObserved").json()
    assert flow["intensity"]["value"] == 14
    assert flow["averageVehicleSpeed"]["value"] == pytest.approx(10.08)
    assert flow["refRoadSegment"]["object"].endswith(":east_loop")
    assert flow["dateObservedFrom"]["value"]["@value"] == "1970-01-01T00:01:40.000Z"


def test_pages_are_cut_by_offset_and_counted_when_asked(client, city_of_two):
    answer = client("GET", f"{WHERE}?type=Vehicle&limit=1&offset=1&count=true")
    assert [one["id"][-2:] for one in answer.json()] == ["n2"]
    assert answer.headers["ngsild-results-count"] == "2"
    assert client("GET", f"{WHERE}?type=Vehicle&limit=1&offset=5").json() == []


def test_links_lead_through_all_pages_and_back(client, city_map):
    path, seen = f"{WHERE}?type=RoadSegment&limit=3&options=keyValues", []
    while path:
        answer = client("GET", path)
        seen += [one["name"] for one in answer.json()]
        path = links_of(answer).get("next")
    assert seen == [lane.name for lane in city_map.lanes]
    before = links_of(answer)["prev"]
    assert [one["name"] for one in client("GET", before).json()] == seen[-4:-1]
    inside = client("GET", f"{WHERE}?type=RoadSegment&limit=3", headers=LD)
    assert set(links_of(inside)) == {"next"}


def links_of(answer):
    return {name: link["url"] for name, link in answer.links.items()}


@pytest.mark.parametrize(
    "query", ["q=speed>1000", "id=urn:x", "attrs=speed", "georel=near", "options=concise"]
)
def test_a_query_that_is_not_offered_is_refused_and_not_left_out(client, city_of_two, query):
    refused = client("GET", f"{WHERE}?type=Vehicle&{query}")
    assert (refused.status_code, refused.json()["code"]) == (422, "invalid")
    assert query.split("=")[0] in refused.json()["detail"]


def test_the_context_is_inside_or_in_link_as_the_reader_wants(client, city_of_two):
    plain = client("GET", f"{WHERE}?type=Vehicle")
    assert "ngsi-ld-core-context" in plain.headers["link"]
    assert "@context" not in plain.json()[0]
    inside = client("GET", f"{WHERE}?type=Vehicle", headers=LD)
    assert inside.headers["content-type"] == "application/ld+json"
    assert "link" not in inside.headers
    assert inside.json()[0]["@context"][0]["floorPose"] == "urn:scm:floorPose"


def test_the_short_form_holds_values_alone(client, city_of_two):
    short = client("GET", f"{WHERE}?type=Vehicle&options=keyValues").json()[0]
    assert (short["name"], short["vehicleType"], short["tagId"]) == ("n1", "car", 1)


def test_what_is_not_there_is_refused_in_words(client):
    assert client("GET", f"{WHERE}?type=Vehikle").json()["detail"].startswith("type: got 'Vehikle'")
    assert client("GET", f"{WHERE}/urn:ngsi-ld:Vehicle:driving_school:n9").status_code == 404
    assert client("GET", f"{WHERE}/nonsense").status_code == 404
    assert client("GET", f"{WHERE}?type=Vehicle").json() == []
