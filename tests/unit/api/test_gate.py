import pytest

from scm.api.app import create_app
from scm.api.gate import check_bind, content_policy, is_loopback
from scm.errors import RunError
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.stop_request import StopRequest

KEY = "a-long-enough-key"
STOP = "/api/v1/stop"


@pytest.fixture
def keyed_app(view, fake_city, city_map):
    fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
    return create_app(view, fake_city.ask, city_map, api_key=KEY)


def put_stop(client, **headers):
    return client("PUT", STOP, json={"engaged": True}, headers=headers)


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.4", "::", "city.example"])
def test_a_public_address_without_a_key_is_refused(host):
    with pytest.raises(RunError, match="API key"):
        check_bind(host, None)
    with pytest.raises(RunError, match="API key"):
        check_bind(host, "")
    check_bind(host, KEY)


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
        response = client_of(app, url)("GET", "/api/v1/cars")
        assert (response.status_code, response.json()["code"]) == (403, "host")

    @pytest.mark.parametrize(
        "headers",
        [
            {"Origin": "http://evil.example"},
            {"Origin": "null"},
            {"Origin": "http://127.0.0.1:9999"},
            {"Sec-Fetch-Site": "cross-site"},
        ],
    )
    def test_a_change_from_another_site_is_refused(self, client, fake_city, headers):
        response = put_stop(client, **headers)
        assert (response.status_code, response.json()["code"]) == (403, "origin")
        assert fake_city.asked == []

    def test_a_change_from_our_own_page_passes(self, client, fake_city):
        fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
        assert put_stop(client, Origin="http://127.0.0.1:8000").status_code == 200

    def test_a_form_of_another_site_cannot_pass_as_json(self, client, fake_city):
        headers = {"Content-Type": "text/plain"}
        response = client("POST", "/api/v1/cars", content=b"{}", headers=headers)
        assert response.status_code == 422
        assert fake_city.asked == []


class TestWithKey:
    def test_everybody_may_read(self, keyed_app, client_of):
        client = client_of(keyed_app, "http://city.example")
        assert client("GET", "/api/v1/cars").status_code == 200

    @pytest.mark.parametrize(
        "headers",
        [{}, {"Authorization": "Bearer wrong"}, {"Authorization": f"Basic {KEY}"}],
    )
    def test_a_change_without_the_key_is_refused(self, keyed_app, client_of, fake_city, headers):
        response = put_stop(client_of(keyed_app), **headers)
        assert (response.status_code, response.json()["code"]) == (401, "unauthorised")
        assert response.headers["www-authenticate"] == "Bearer"
        assert fake_city.asked == []

    def test_a_change_with_the_key_passes(self, keyed_app, client_of):
        client = client_of(keyed_app, "http://city.example")
        assert put_stop(client, Authorization=f"Bearer {KEY}").status_code == 200


@pytest.mark.parametrize("path", ["/", "/docs", "/api/v1/cars", "/nothing", "/static/js/app.js"])
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
