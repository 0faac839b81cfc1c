import asyncio
import re

import httpx
import pytest
from fastapi.responses import StreamingResponse

from scm.api.app import create_app
from scm.api.auth_throttle import Brake
from scm.api.gate import Gate, check_bind, content_policy, is_loopback
from scm.api.known_keys import KnownKeys
from scm.api.roles import ROLES
from scm.clock import NS_PER_S, StepClock
from scm.errors import RunError
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.monitor_reset import MonitorReset
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.stop_request import StopRequest
from tests.unit.api.conftest import bearer

STOP = "/api/v1/stop"


def put_stop(client, **headers):
    return client("PUT", STOP, json={"engaged": True}, headers=headers)


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.4", "::", "city.example"])
def test_a_public_address_without_a_key_is_refused(host, ring, key_of):
    with pytest.raises(RunError, match="API key"):
        check_bind(host, None)
    with pytest.raises(RunError, match="API key"):
        check_bind(host, ring)
    key_of("viewer")
    check_bind(host, ring)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "localhost", "::1"])
def test_loopback_needs_no_key(host):
    assert is_loopback(host)
    check_bind(host, None)


class TestWithoutKey:
    @pytest.mark.parametrize("url", ["http://localhost:8000", "http://127.0.0.1", "http://[::1]:1"])
    def test_this_machine_may_call(self, app, client_of, url):
        assert client_of(app, url)("GET", "/healthz").status_code == 200

    @pytest.mark.parametrize(
        "url", ["http://evil.example:8000", "http://127.0.0.1.evil.example", "http://10.0.0.1"]
    )
    def test_a_page_that_renamed_itself_to_us_may_not_even_read(self, app, client_of, url):
        response = client_of(app, url)("GET", "/api/v1/vehicles")
        assert (response.status_code, response.json()["code"]) == (403, "host")

    @pytest.mark.parametrize(
        "headers",
        [
            {"Origin": "http://evil.example"},
            {"Origin": "null"},
            {"Origin": "http://127.0.0.1:9999"},
            {"Origin": "http://[::1"},
            {"Origin": ""},
            {"Sec-Fetch-Site": "cross-site"},
        ],
    )
    def test_a_change_from_another_site_is_refused(self, client, fake_city, headers):
        response = put_stop(client, **headers)
        assert (response.status_code, response.json()["code"]) == (403, "origin")
        assert fake_city.asked == []

    @pytest.mark.parametrize("site", ["cross-site", "same-site"])
    def test_pictures_and_frames_of_another_site_cost_us_nothing(self, client, site):
        shown = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"}
        refused = client("GET", "/api/v1/vehicles", headers=shown)
        assert (refused.status_code, refused.json()["code"]) == (403, "origin")
        framed = shown | {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"}
        assert client("GET", "/api/v1/vehicles", headers=framed).status_code == 403
        link = shown | {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}
        assert client("GET", "/map", headers=link).status_code == 200

    def test_a_change_from_our_own_page_passes(self, client, fake_city):
        fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
        assert put_stop(client, Origin="http://127.0.0.1:8000").status_code == 200

    def test_a_form_of_another_site_cannot_pass_as_json(self, client, fake_city):
        headers = {"Content-Type": "text/plain"}
        response = client("POST", "/api/v1/vehicles", content=b"{}", headers=headers)
        assert response.status_code == 415
        assert fake_city.asked == []


class TestWithKeys:
    @pytest.mark.parametrize("path", ["/", "/docs", "/healthz", "/api/v1/openapi.json"])
    def test_what_tells_nothing_of_the_city_is_open(self, keyed_app, client_of, path):
        assert client_of(keyed_app, "http://city.example")("GET", path).status_code == 200

    @pytest.mark.parametrize("path", ["/api/v1/vehicles", "/api/v1/stream", "/api/v1/keys"])
    def test_nobody_reads_without_a_key(self, keyed_app, client_of, path):
        response = client_of(keyed_app)("GET", path)
        assert (response.status_code, response.json()["code"]) == (401, "unauthorised")

    @pytest.mark.parametrize("headers", [{}, {"Authorization": "Bearer wrong"}])
    def test_a_change_without_a_key_is_refused(self, keyed_app, client_of, fake_city, headers):
        response = put_stop(client_of(keyed_app), **headers)
        assert (response.status_code, response.json()["code"]) == (401, "unauthorised")
        assert response.headers["www-authenticate"] == "Bearer"
        assert fake_city.asked == []

    def test_a_key_is_a_bearer_and_nothing_else(self, keyed_app, client_of, key_of):
        headers = {"Authorization": f"Basic {key_of('admin')}"}
        assert put_stop(client_of(keyed_app), **headers).status_code == 401

    @pytest.mark.parametrize(
        ("method", "path", "body", "least"),
        [
            ("GET", "/api/v1/vehicles", None, "viewer"),
            ("PUT", STOP, {"engaged": True}, "operator"),
            ("POST", "/api/v1/signals/crossing/monitor/reset", {"reason": "seen"}, "engineer"),
            ("GET", "/api/v1/keys", None, "admin"),
        ],
    )
    def test_each_role_may_do_what_those_below_may_and_more(
        self, keyed_app, client_of, fake_city, key_of, method, path, body, least
    ):
        fake_city.answers[MonitorReset] = MonitorStatus(
            junction="crossing", t_ns=1, since_ns=1, fault=None, detail=""
        )
        client = client_of(keyed_app, "http://city.example")
        for role in ROLES:
            response = client(method, path, json=body, headers=bearer(key_of(role)))
            may = ROLES.index(role) >= ROLES.index(least)
            assert response.status_code == (200 if may else 403), (role, response.text)
            assert may or least in response.json()["detail"]

    def test_a_revoked_key_ends_at_once(self, keyed_app, client_of, key_of, ring):
        client, key = client_of(keyed_app), key_of("operator")
        assert put_stop(client, **bearer(key)).status_code == 200
        ring.revoke(key.split("_")[1])
        assert put_stop(client, **bearer(key)).status_code == 401

    @pytest.mark.parametrize("ends", [True, False])
    def test_a_key_that_ends_takes_its_endless_answers_with_it(self, ring, key_of, ends):
        key, clock = key_of("viewer"), StepClock()

        async def beats():
            for number in range(4):
                yield f"{number}\n"
                clock.set_ns(clock.now_ns() + NS_PER_S)
                if ends and number == 1:
                    ring.revoke(key.split("_")[1])

        async def answer(scope, receive, send):
            await StreamingResponse(beats())(scope, receive, send)

        gate = Gate(answer, keys=KnownKeys(ring, clock), policy="", clock=clock)

        async def ask():
            transport = httpx.ASGITransport(gate)
            async with httpx.AsyncClient(transport=transport, base_url="http://city") as client:
                return await client.get("/api/v1/stream", headers=bearer(key))

        told = asyncio.run(ask()).text.split()
        assert told == (["0", "1"] if ends else ["0", "1", "2", "3"])

    def test_an_admin_ends_a_key(self, keyed_app, client_of, key_of):
        client, admin, other = client_of(keyed_app), key_of("admin"), key_of("viewer")
        listed = client("GET", "/api/v1/keys", headers=bearer(admin))
        assert {row["role"] for row in listed.json()["keys"]} == {"admin", "viewer"}
        assert other.split("_", 2)[2] not in listed.text
        path = f"/api/v1/keys/{other.split('_')[1]}"
        once = bearer(admin) | {"Idempotency-Key": "k1"}
        assert client("DELETE", path, headers=once).status_code == 200
        assert client("DELETE", path, headers=once).status_code == 200  # its answer was lost
        assert client("DELETE", path, headers=bearer(admin)).status_code == 404
        assert client("GET", "/api/v1/vehicles", headers=bearer(other)).status_code == 401

    @pytest.mark.parametrize("given", ["1", "k" * 128])
    def test_two_callers_with_one_idempotency_key_ask_for_two_things(
        self, keyed_app, client_of, key_of, fake_city, given
    ):
        once, client = {"Idempotency-Key": given}, client_of(keyed_app)
        for key in (key_of("operator"), key_of("operator")):
            for replayed in (None, "true"):
                answer = put_stop(client, **bearer(key), **once)
                assert answer.status_code == 200
                assert answer.headers.get("idempotency-replayed") == replayed
        assert len(fake_city.asked) == len({one.request_id for one in fake_city.asked}) == 2

    def test_a_page_reads_with_a_cookie_and_changes_with_its_key_alone(
        self, keyed_app, client_of, key_of, fake_city
    ):
        client = client_of(keyed_app)
        begun = client("PUT", "/api/v1/session", headers=bearer(key_of("operator")))
        cookie = begun.headers["set-cookie"]
        assert {"HttpOnly", "SameSite=strict", "Path=/api"} <= set(cookie.split("; "))
        with_cookie = {"Cookie": cookie.split(";")[0]}
        assert client("GET", "/api/v1/vehicles", headers=with_cookie).status_code == 200
        who = client("GET", "/api/v1/session", headers=with_cookie).json()
        assert who == {"owner": "anna", "role": "operator"}
        assert put_stop(client, **with_cookie).status_code == 401
        assert fake_city.asked == []

    def test_guessing_a_key_is_slowed_down_for_the_address_it_comes_from(
        self, view, fake_city, city_map, ring, key_of
    ):
        clock = StepClock()
        fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
        inner = create_app(view, fake_city.ask, city_map, keys=ring)
        gate = Gate(inner, keys=KnownKeys(ring, clock), policy="", brake=Brake(clock))
        key, other = key_of("operator"), key_of("viewer")
        guess = bearer(key[:-4] + "AAAA")
        codes = [call_from(gate, "10.0.0.9", guess).status_code for _ in range(12)]
        assert codes == [401] * 10 + [429] * 2
        assert call_from(gate, "10.0.0.9", guess).headers["retry-after"] == "5"
        for right in (key, other):
            assert call_from(gate, "10.0.0.9", bearer(right)).status_code == 200
        assert call_from(gate, "10.0.0.8", guess).status_code == 401
        clock.set_ns(6 * NS_PER_S)
        assert call_from(gate, "10.0.0.9", guess).status_code == 401

    def test_nobody_is_kept_from_the_red_stop_by_who_guesses_with_the_public_part_of_a_key(
        self, view, fake_city, city_map, ring, key_of
    ):
        fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
        inner = create_app(view, fake_city.ask, city_map, keys=ring)
        clock = StepClock()
        gate = Gate(inner, keys=KnownKeys(ring, clock), policy="", brake=Brake(clock))
        key = key_of("operator")
        guess = bearer(key[:-4] + "AAAA")
        for _ in range(30):
            assert call_from(gate, "10.0.0.9", guess, stops=True).status_code == 401
        assert call_from(gate, "10.0.0.9", bearer(key), stops=True).status_code == 200


def call_from(app, address, headers, *, stops=False):
    async def call():
        transport = httpx.ASGITransport(app, client=(address, 1))
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            if stops:
                body = {"engaged": True, "by": "anna", "reason": ""}
                return await client.put("/api/v1/stop", json=body, headers=headers)
            return await client.get("/api/v1/vehicles", headers=headers)

    return asyncio.run(call())


def test_addresses_of_one_ipv6_network_are_one_guesser():
    brake = Brake(StepClock())
    for i in range(10):
        brake.note_wrong(f"2001:db8::{i + 1}", "wrong")
    assert brake.wait_s("2001:db8::ffff", "wrong") == pytest.approx(5.0)
    assert brake.wait_s("2001:db8:0:1::1", "wrong") == 0.0


def test_nobody_calls_a_route_without_a_key_and_no_viewer_changes_anything(keyed_app, key_of):
    paths = keyed_app.openapi()["paths"]
    calls = [
        (method.upper(), re.sub(r"{[^}]*}", "x", path))
        for path, methods in paths.items()
        for method in methods
        if path.startswith(("/api/", "/ngsi-ld/", "/metrics"))
    ]
    viewer = bearer(key_of("viewer"))

    async def status(client, method, path, headers):
        return (await client.request(method, path, headers=headers)).status_code

    async def all_statuses():
        transport = httpx.ASGITransport(keyed_app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            nobody = {call: await status(client, *call, {}) for call in calls}
            changes = [call for call in calls if call[0] != "GET"]
            return nobody, {call: await status(client, *call, viewer) for call in changes}

    nobody, changes = asyncio.run(all_statuses())
    assert len(changes) > 30
    assert {call for call, got in nobody.items() if got != 401} == set()
    own = {("PUT", "/api/v1/session"), ("DELETE", "/api/v1/session")}
    assert {call for call, got in changes.items() if got != 403} == own


def test_a_viewer_cannot_fill_the_memory_with_a_body(keyed_app, client_of, key_of):
    async def endless():
        for _ in range(100):
            yield b" " * 2**20
            sent.append(1)

    sent = []
    headers = bearer(key_of("viewer")) | {"Content-Type": "application/json"}
    answer = client_of(keyed_app)("PUT", STOP, content=endless(), headers=headers)
    assert (answer.status_code, answer.json()["code"]) == (403, "forbidden")  # nobody read it
    assert len(sent) < 5


@pytest.mark.parametrize(
    "path", ["/", "/docs", "/api/v1/vehicles", "/nothing", "/static/js/app.js"]
)
def test_every_answer_carries_the_security_headers(client, path):
    headers = client("GET", path).headers
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "http" not in policy
    assert headers["x-content-type-options"] == "nosniff"


def test_the_policy_names_inline_scripts_by_their_hash():
    # printf 'a' | openssl sha256 -binary | base64
    policy = content_policy('<script type="importmap">a</script><script src="/b.js"></script>')
    assert "script-src 'self' 'sha256-ypeBEsobvcr6wjGzmiPcTaeG7/gUfE5yuYB3ha/uSLs=';" in policy


def test_with_keys_a_deed_is_signed_by_the_owner_of_the_key(
    keyed_app, client_of, key_of, fake_city
):
    call, headers = client_of(keyed_app), bearer(key_of("admin"))
    deeds = {
        STOP: {"engaged": True},
        "/api/v1/signals/crossing/plan": {"plan": "flash"},
        "/api/v1/signals/crossing/policy": {"policy": "actuated", "expires_s": 60.0},
        "/api/v1/signals/crossing/flash": {"engaged": True, "expires_s": 60.0},
    }
    wishes = ("calls", "holds", "force-offs", "omits", "preempts")
    for path, body in deeds.items():
        call("PUT", path, json={**body, "by": "bob"}, headers=headers)
    for noun in wishes:
        body = {"groups": ["south_east"], "expires_s": 60.0, "by": "bob"}
        call("POST", f"/api/v1/signals/crossing/{noun}", json=body, headers=headers)
    for path, body in (("clear", {}), ("monitor/reset", {"reason": "looked at"})):
        named = {**body, "by": "bob"}
        call("POST", f"/api/v1/signals/crossing/{path}", json=named, headers=headers)
    assert len(fake_city.asked) == len(deeds) + len(wishes) + 2
    assert {request.by for request in fake_city.asked} == {"anna"}
