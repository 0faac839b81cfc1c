import msgspec
import pytest

from scm.api.app import create_app
from scm.api.wire import BusWire
from scm.clock import StepClock
from scm.records.city_map import CityMap
from scm.v2x.bus import Mailbox
from scm.v2x.bus_memory import MemoryNetwork
from scm.v2x.message import Refused
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_tags import EyeTags
from scm.v2x.messages.light_request import LightReply, LightRequest
from scm.v2x.messages.monitor_reset import MonitorReset
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.remove_request import RemoveReply, RemoveRequest
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.stop_request import StopRequest

API = "/api/v1"


def is_problem(response, status, code):
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    body = response.json()
    assert (body["status"], body["code"]) == (status, code)
    assert body["title"]
    return body


class TestCars:
    def test_all_cars_are_listed(self, client, hear, snapshot):
        hear(1.0, snapshot(n1=(0.1, 0.2, 0.3), n2=(0.0, 0.0, 0.0)))
        body = client("GET", f"{API}/vehicles").json()
        assert [car["vehicle"] for car in body["vehicles"]] == ["n1", "n2"]
        assert body["vehicles"][0]["yaw_rad"] == 0.3

    def test_one_car_is_found_by_name(self, client, hear, snapshot):
        hear(1.0, snapshot(n1=(0.1, 0.2, 0.3)))
        assert client("GET", f"{API}/vehicles/n1").json()["x_m"] == 0.1

    def test_a_car_that_is_not_there_is_not_found(self, client):
        body = is_problem(client("GET", f"{API}/vehicles/n1"), 404, "not_found")
        assert "n1" in body["detail"]
        assert body["instance"] == f"{API}/vehicles/n1"

    def test_a_name_that_no_key_could_carry_is_invalid(self, client):
        is_problem(client("GET", f"{API}/vehicles/N 1"), 422, "invalid")

    def test_spawning_asks_the_world_and_says_where_to_look(self, client, fake_city):
        reply = SpawnReply(vehicle="n5", x_m=1.0, y_m=2.0, yaw_rad=0.0, tag_id=5)
        fake_city.answers[SpawnRequest] = reply
        response = client(
            "POST", f"{API}/vehicles", json={"car": "dart"}, headers={"Idempotency-Key": "k1"}
        )
        assert response.status_code == 201
        assert response.headers["location"] == f"{API}/vehicles/n5"
        assert response.json()["tag_id"] == 5
        assert fake_city.asked == [SpawnRequest(request_id="k1", car="dart")]

    def test_removing_passes_the_reason_on(self, client, fake_city):
        fake_city.answers[RemoveRequest] = RemoveReply(vehicle="n5")
        response = client("DELETE", f"{API}/vehicles/n5?reason=tidy")
        assert response.json() == {"vehicle": "n5"}
        assert fake_city.asked == [RemoveRequest(vehicle="n5", reason="tidy")]

    def test_a_route_is_passed_on_as_given(self, client, fake_city):
        fake_city.answers[RouteRequest] = RouteReply(
            vehicle="n5", trip_id="t1", route=("a", "b"), length_m=3.0
        )
        body = {"via": ["a", "b"], "laps": 2, "speed_mps": 0.2, "then": "circulate"}
        response = client("POST", f"{API}/vehicles/n5/route", json=body)
        assert response.json()["route"] == ["a", "b"]
        assert fake_city.asked == [
            RouteRequest(vehicle="n5", via=("a", "b"), laps=2, speed_mps=0.2, then="circulate")
        ]

    @pytest.mark.parametrize(
        "body",
        [
            {"laps": 0},
            {"then": "fly"},
            {"speed_mps": -1},
            {"via": "a"},
            {"vias": ["a"]},
            {"laps": "two"},
        ],
    )
    def test_a_wrong_route_is_refused_before_anybody_is_asked(self, client, fake_city, body):
        problem = is_problem(client("POST", f"{API}/vehicles/n5/route", json=body), 422, "invalid")
        (field,) = body
        assert problem["errors"][0]["where"] == f"body.{field}"
        assert problem["errors"][0]["expected"]
        assert fake_city.asked == []

    def test_lights_are_switched_one_or_both(self, client, fake_city):
        fake_city.answers[LightRequest] = LightReply(
            vehicle="n5", headlights="low", indicators="off"
        )
        response = client("PUT", f"{API}/vehicles/n5/lights", json={"headlights": "low"})
        assert response.json()["headlights"] == "low"
        assert fake_city.asked == [LightRequest(vehicle="n5", headlights="low")]

    def test_a_light_that_does_not_exist_is_refused(self, client, fake_city):
        response = client("PUT", f"{API}/vehicles/n5/lights", json={"indicators": "up"})
        is_problem(response, 422, "invalid")
        assert fake_city.asked == []

    def test_what_is_not_json_is_a_problem_too(self, client):
        headers = {"Content-Type": "application/json"}
        response = client("POST", f"{API}/vehicles", content=b"{", headers=headers)
        is_problem(response, 422, "invalid")


class TestRefusals:
    @pytest.mark.parametrize(
        ("code", "status"),
        [
            ("not_found", 404),
            ("owned", 409),
            ("invalid", 422),
            ("offline", 503),
            ("timeout", 504),
            ("full", 409),
        ],
    )
    def test_the_city_s_no_becomes_a_problem(self, client, fake_city, code, status):
        fake_city.answers[RemoveRequest] = Refused(code=code, detail="because")
        body = is_problem(client("DELETE", f"{API}/vehicles/n5"), status, code)
        assert body["detail"] == "because"

    @pytest.fixture
    def network(self):
        return MemoryNetwork(StepClock())

    @pytest.fixture
    def remove(self, network, view, city_map, client_of):
        """Take a car off the map over a real bus; an answer has no time to come."""
        wire = BusWire(network.bus("lab", "api"))

        def ask(request, _timeout_s):
            return wire.request_once(request, 0.05)

        return lambda: client_of(create_app(view, ask, city_map))("DELETE", f"{API}/vehicles/n5")

    def test_who_is_not_there_is_told_to_people_and_the_key_to_engineers(self, remove):
        body = is_problem(remove(), 503, "offline")
        assert body["detail"] == "the world is not running, or cannot be reached"
        assert body["asked"] == "RemoveRequest on scm/@v1/lab/v/n5/remove"

    def test_who_does_not_answer_is_told_to_people_and_the_key_to_engineers(self, remove, network):
        network.bus("lab", "world").serve(RemoveRequest, {}, Mailbox(10))
        body = is_problem(remove(), 504, "timeout")
        assert body["detail"] == "the world did not answer within 0.05 s"
        assert body["asked"] == "RemoveRequest on scm/@v1/lab/v/n5/remove"

    def test_a_reply_of_the_wrong_kind_is_a_problem(self, client, fake_city):
        fake_city.answers[RemoveRequest] = CityStop(t_ns=0, engaged=False)
        is_problem(client("DELETE", f"{API}/vehicles/n5"), 409, "invalid_reply")

    def test_a_path_that_does_not_exist_is_a_problem(self, client):
        is_problem(client("GET", f"{API}/nothing"), 404, "not_found")

    def test_a_person_who_mistyped_an_address_sees_the_dashboard_and_programs_a_problem(
        self, client
    ):
        person = {"Accept": "text/html,*/*;q=0.8"}
        shown = client("GET", "/typo", headers=person)
        assert (shown.status_code, shown.headers["content-type"]) == (
            404,
            "text/html; charset=utf-8",
        )
        assert "js/app.js" in shown.text
        is_problem(client("GET", "/typo"), 404, "not_found")
        is_problem(client("POST", "/typo", headers=person), 404, "not_found")
        for path in (f"{API}/nothing", "/static/nothing.js"):
            is_problem(client("GET", path, headers=person), 404, "not_found")

    @pytest.mark.parametrize(
        ("path", "offered"),
        [
            ("/healthz", "GET, HEAD"),
            (f"{API}/leases/n1", "GET, HEAD, POST, PUT, DELETE"),
            (f"{API}/vehicles/n1/route", "POST"),
            ("/ngsi-ld/v1/entities", "GET, HEAD"),
        ],
    )
    def test_a_method_that_is_not_offered_is_a_problem_which_says_those_that_are(
        self, client, path, offered
    ):
        refused = client("PATCH", path)
        is_problem(refused, 405, "method_not_allowed")
        assert refused.headers["allow"] == offered

    @pytest.mark.parametrize("media", [None, "text/plain", "application/x-www-form-urlencoded"])
    def test_a_body_that_is_not_called_json_is_refused_for_that(self, client, media):
        headers = {"Content-Type": media} if media else {}
        refused = client("PUT", f"{API}/stop", content=b'{"engaged": true}', headers=headers)
        body = is_problem(refused, 415, "media_type")
        assert body["detail"] == f"Content-Type: got {media or ''!r}, expected application/json"

    @pytest.mark.parametrize(
        ("content", "status", "said"),
        [
            (b'{"engaged": true,}', 422, "body: JSON: Expecting property name"),
            (b"[]", 422, "body: a JSON object"),
            (b"[" * 100_000, 400, "There was an error parsing the body"),
        ],
    )
    def test_a_body_that_is_no_such_json_is_refused_in_words(self, client, content, status, said):
        headers = {"Content-Type": "application/json"}
        refused = client("PUT", f"{API}/stop", content=content, headers=headers)
        assert is_problem(refused, status, "invalid")["detail"].startswith(said)

    def test_our_own_failure_is_a_problem_that_tells_no_secrets(self, client, fake_city):
        fake_city.answers = None  # asking it is a bug of ours now
        body = is_problem(client("DELETE", f"{API}/vehicles/n5"), 500, "internal")
        assert "NoneType" not in body["detail"]


class TestHead:
    def test_it_says_of_an_answer_what_the_answer_says_of_itself(self, client):
        for path in ("/healthz", f"{API}/map", f"{API}/vehicles/n1", "/ngsi-ld/v1/entities"):
            whole, head = client("GET", path), client("HEAD", path)
            assert (head.status_code, head.content) == (whole.status_code, b"")
            for name in ("content-length", "content-type"):
                assert head.headers[name] == whole.headers[name]

    @pytest.mark.parametrize("path", ["stream", "vehicles.bin"])
    def test_what_is_endless_ends(self, client, path):
        head = client("HEAD", f"{API}/{path}")
        assert (head.status_code, head.content) == (200, b"")
        assert client("GET", "/metrics").text.count("scm_stream_listeners 0.0") == 1


class TestSignals:
    def test_all_junctions_are_listed(self, client, hear, spat):
        hear(1.0, spat())
        (row,) = client("GET", f"{API}/signals").json()["signals"]
        assert row["junction"] == "crossing"
        assert row["groups"][0]["colour"] == "green"
        assert row["plans"] == ["busy", "calm", "flash"]

    def test_one_junction_is_found_by_name(self, client):
        assert client("GET", f"{API}/signals/crossing").json()["fresh"] is False

    @pytest.mark.parametrize(
        ("method", "path", "body"),
        [
            ("GET", "", None),
            ("PUT", "/plan", {"plan": "calm"}),
            ("POST", "/monitor/reset", {"reason": "seen"}),
        ],
    )
    def test_an_unknown_junction_is_not_found(self, client, fake_city, method, path, body):
        is_problem(client(method, f"{API}/signals/moon{path}", json=body), 404, "not_found")
        assert fake_city.asked == []

    def test_a_plan_is_wished_for_with_who_and_why(self, client, fake_city):
        fake_city.answers[PlanRequest] = PlanReply(junction="crossing", plan="calm", pending="busy")
        body = {"plan": "busy", "by": "me", "reason": "rush hour"}
        response = client("PUT", f"{API}/signals/crossing/plan", json=body)
        assert response.json()["pending"] == "busy"
        assert fake_city.asked == [
            PlanRequest(junction="crossing", plan="busy", by="me", reason="rush hour")
        ]

    def test_a_fault_is_cleared_only_with_a_reason(self, client, fake_city):
        path = f"{API}/signals/crossing/monitor/reset"
        is_problem(client("POST", path, json={"reason": ""}), 422, "invalid")
        fake_city.answers[MonitorReset] = MonitorStatus(
            junction="crossing", t_ns=1, fault=None, since_ns=1
        )
        response = client("POST", path, json={"by": "me", "reason": "bulb replaced"})
        assert response.json()["fault"] is None
        assert fake_city.asked == [
            MonitorReset(junction="crossing", by="me", reason="bulb replaced")
        ]


class TestStop:
    def test_before_the_world_speaks_the_stop_is_released(self, client):
        assert client("GET", f"{API}/stop").json()["engaged"] is False

    def test_the_stop_the_world_told_is_shown(self, client, hear):
        hear(1.0, CityStop(t_ns=1, engaged=True, by="me", reason="smoke"))
        body = client("GET", f"{API}/stop").json()
        assert (body["engaged"], body["by"], body["reason"]) == (True, "me", "smoke")

    @pytest.mark.parametrize("engaged", [True, False])
    def test_the_stop_is_set_to_what_is_wished(self, client, fake_city, engaged):
        fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=engaged)
        body = {"engaged": engaged, "by": "me"}
        assert client("PUT", f"{API}/stop", json=body).json()["engaged"] is engaged
        assert fake_city.asked == [StopRequest(engaged=engaged, by="me")]


class TestEvents:
    def test_pages_follow_each_other_without_gap_or_repeat(self, client, hear, event):
        hear(1.0, *(event(str(number)) for number in range(1, 8)))
        seen, path = [], f"{API}/events?limit=3"
        while path:
            response = client("GET", path)
            seen += [item["seq"] for item in response.json()["items"]]
            path = response.links.get("next", {}).get("url")
        assert seen == [7, 6, 5, 4, 3, 2, 1]

    def test_only_what_came_after_a_number_is_told(self, client, hear, event):
        hear(1.0, event("one"), event("two"))
        body = client("GET", f"{API}/events?after=1").json()
        assert [row["text"] for row in body["items"]] == ["two"]
        assert client("GET", f"{API}/events?after=2").json() == {"items": [], "next": None}

    @pytest.mark.parametrize("query", ["limit=0", "limit=501", "after=-1", "after=x"])
    def test_a_wrong_page_is_refused(self, client, query):
        is_problem(client("GET", f"{API}/events?{query}"), 422, "invalid")


class TestMap:
    def test_the_map_as_json_reads_back_as_the_map(self, client, city_map):
        body = client("GET", f"{API}/map").content
        assert msgspec.json.decode(body, type=CityMap) == city_map

    def test_the_map_is_drawn_in_metres(self, client):
        response = client("GET", f"{API}/map.svg")
        assert response.headers["content-type"] == "image/svg+xml"
        assert response.text.startswith("<svg")
        assert "viewBox" in response.text

    def test_a_map_already_known_is_not_sent_again(self, client):
        etag = client("GET", f"{API}/map").headers["etag"]
        for known in (etag, f'"x", {etag}', f"W/{etag}"):
            again = client("GET", f"{API}/map", headers={"If-None-Match": known})
            assert (again.status_code, again.content) == (304, b"")


class TestEye:
    def test_a_frame_is_the_jpeg_that_came(self, client, hear):
        hear(1.0, EyeFrame(camera="overhead", t_ns=7, width_px=4, height_px=3, payload=b"jpeg"))
        response = client("GET", f"{API}/eye/cameras/overhead/frame.jpg")
        assert response.content == b"jpeg"
        assert response.headers["content-type"] == "image/jpeg"
        assert response.headers["x-time-ns"] == "7"
        (camera,) = client("GET", f"{API}/eye").json()["cameras"]
        assert camera["frame_t_ns"] == "7"

    def test_tags_are_those_that_came(self, client, hear):
        hear(1.0, EyeTags(camera="overhead", t_ns=7, tags=(), latency_ms=20.0))
        assert client("GET", f"{API}/eye/cameras/overhead/tags").json()["latency_ms"] == 20.0

    @pytest.mark.parametrize("what", ["frame.jpg", "tags"])
    def test_a_camera_never_heard_is_not_found(self, client, what):
        is_problem(client("GET", f"{API}/eye/cameras/overhead/{what}"), 404, "not_found")


class TestRest:
    def test_stations_are_listed(self, client, hear):
        hear(1.0, Presence(role="part", station="world", session="s", alive=True))
        (row,) = client("GET", f"{API}/stations").json()["stations"]
        assert (row["name"], row["alive"], row["lost_ns"]) == ("world", True, None)

    def test_the_server_is_healthy_at_once_and_ready_with_a_fresh_snapshot(
        self, client, hear, snapshot
    ):
        assert client("GET", "/healthz").status_code == 200
        is_problem(client("GET", "/readyz"), 503, "not_ready")
        hear(1.0, snapshot())
        assert client("GET", "/readyz").status_code == 200
        hear(3.5)
        is_problem(client("GET", "/readyz"), 503, "not_ready")

    def test_every_route_says_that_its_errors_are_problems(self, client):
        paths = client("GET", f"{API}/openapi.json").json()["paths"]
        for methods in paths.values():
            for route in methods.values():
                for status in ("400", "404", "422", "503"):
                    assert set(route["responses"][status]["content"]) == {
                        "application/problem+json"
                    }

    def test_every_route_is_described(self, client):
        paths = client("GET", f"{API}/openapi.json").json()["paths"]
        assert {"/api/v1/vehicles", "/api/v1/stop", "/api/v1/stream", "/readyz"} <= set(paths)
        for methods in paths.values():
            assert all(route["summary"] for route in methods.values())
