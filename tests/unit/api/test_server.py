import json
import socket
import threading
import time
from contextlib import ExitStack, closing, contextmanager, suppress
from http.client import HTTPConnection
from urllib.parse import urlsplit

import httpx
import pytest

from scm.api import server
from scm.api.app import create_app
from scm.api.server import _Impatient, serve
from scm.errors import RunError
from tests.unit.api.conftest import bearer

PATIENCE_S = 60.0
REUSED_S = 5.0  # httpx uses a connection again that has been idle for less


@contextmanager
def served(app, proxies=()):
    ready, stop, urls = threading.Event(), threading.Event(), []

    def note(url):
        urls.append(url)
        ready.set()

    thread = threading.Thread(
        target=serve,
        args=(
            app,
            "127.0.0.1",
            0,
            stop,
        ),
        kwargs={"on_ready": note, "proxies": proxies},
    )
    thread.start()
    try:
        assert ready.wait(PATIENCE_S)
        yield urls[0], stop, thread
    finally:
        stop.set()
        thread.join(PATIENCE_S)


def listening(url):
    return httpx.stream("GET", f"{url}/api/v1/stream", timeout=PATIENCE_S)


def events_of(response):
    fields = {}
    for line in response.iter_lines():
        if line:
            name, _, value = line.partition(": ")
            fields[name] = value
        elif "event" in fields:
            yield fields["event"], json.loads(fields["data"])
            fields = {}


def test_small_answers_do_not_wait_for_what_the_other_side_acknowledges(app, monkeypatch):
    found, made = [], _Impatient.connection_made

    def note(self, transport):
        made(self, transport)
        taken = transport.get_extra_info("socket")
        found.append(taken.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))

    monkeypatch.setattr(_Impatient, "connection_made", note)
    with served(app) as (url, _, _):
        assert httpx.get(f"{url}/api/v1/stop", timeout=PATIENCE_S).status_code == 200
    assert found
    assert all(found)


def test_a_page_over_a_real_socket_gets_a_snapshot_and_then_deltas(app, hear, snapshot):
    with served(app) as (url, _, _), listening(url) as response:
        assert response.headers["content-type"].startswith("text/event-stream")
        events = events_of(response)
        assert next(events)[0] == "snapshot"
        hear(1.0, snapshot(n1=(0.5, 0.0, 0.0)))
        for name, body in events:
            assert name in {"delta", "beat"}
            if "vehicles" in body and body["vehicles"]["vehicles"]:
                break
        assert body["vehicles"]["vehicles"][0]["x_m"] == 0.5


def test_it_stops_even_while_a_page_listens_and_ends_its_stream(app):
    with served(app) as (url, stop, thread), listening(url) as response:
        chunks = response.iter_raw()
        next(chunks)
        stop.set()
        for _ in chunks:
            pass  # to its end: a stream that is cut off a second later raises
        thread.join(PATIENCE_S)
        assert not thread.is_alive()


def test_a_taken_address_is_said_so(app):
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 0))
        holder.listen()
        port = holder.getsockname()[1]
        with pytest.raises(RunError, match=f"127.0.0.1:{port}"):
            serve(app, "127.0.0.1", port, threading.Event())


def test_a_public_address_is_not_bound_without_a_key(app):
    stop = threading.Event()
    stop.set()  # should it bind after all, it returns at once
    with pytest.raises(RunError, match="API key"):
        serve(app, "0.0.0.0", 0, stop)


def test_a_server_told_to_stop_before_it_began_returns(view, fake_city, city_map):
    stop = threading.Event()
    stop.set()
    serve(create_app(view, fake_city.ask, city_map), "127.0.0.1", 0, stop)


@pytest.mark.parametrize("begun", [b"", b"GET / HTTP/1.1\r\nHost: "])
def test_who_never_ends_a_request_s_head_is_let_go(app, monkeypatch, begun):
    monkeypatch.setattr(_Impatient, "patience_s", 0.2)
    with (
        served(app) as (url, _, _),
        socket.create_connection(address_of(url), PATIENCE_S) as idle,
        suppress(ConnectionError),  # it was let go before it said anything
    ):
        idle.sendall(begun)
        assert idle.recv(100) == b""


def test_a_body_that_does_not_come_is_not_waited_for(app, monkeypatch):
    monkeypatch.setattr(_Impatient, "patience_s", 0.2)
    head = b"PUT /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    with (
        served(app) as (url, _, _),
        socket.create_connection(address_of(url), PATIENCE_S) as idle,
        suppress(ConnectionError),
    ):
        idle.sendall(head + b'Content-Length: 100\r\n\r\n{"engaged"')
        assert idle.recv(100) == b""


def test_however_many_hold_connections_the_next_one_is_heard(app, monkeypatch):
    monkeypatch.setattr(server, "MOST_CONNECTIONS", 5)
    listen = b"GET /api/v1/stream HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with served(app) as (url, _, _), ExitStack() as held:
        connections = []
        for _ in range(12):
            connection = socket.create_connection(address_of(url), PATIENCE_S)
            connections.append(held.enter_context(connection))
            connection.sendall(listen)
            assert connection.recv(100).startswith(b"HTTP/1.1 200")
        assert httpx.get(f"{url}/healthz", timeout=PATIENCE_S).status_code == 200
        with suppress(ConnectionError):
            while connections[0].recv(4096):
                pass  # to its end: it was the oldest
        assert connections[-1].recv(100)


def test_who_asks_and_asks_again_is_not_let_go(app, monkeypatch):
    monkeypatch.setattr(_Impatient, "patience_s", 0.2)

    def asks(client):
        try:
            with client.stream("GET", "/api/v1/stream") as response:
                beats = (name for name, _ in events_of(response) if name == "beat")
                assert [next(beats), next(beats)] == ["beat", "beat"]  # a second apart
            return client.get("/healthz").status_code == 200
        except httpx.TransportError:  # a busy machine did not let it ask in time
            return False

    with served(app) as (url, _, _), httpx.Client(base_url=url, timeout=PATIENCE_S) as client:
        assert any(asks(client) for _ in range(10))


def test_an_idle_connection_outlives_its_reuse_by_a_client(app):
    with served(app) as (url, _, _), closing(HTTPConnection(*address_of(url))) as connection:
        for pause_s in (0.0, REUSED_S + 0.5):
            time.sleep(pause_s)
            connection.request("GET", "/healthz")  # where it was closed, no answer comes
            assert connection.getresponse().read()


@pytest.mark.parametrize(
    ("proxies", "noted"),
    [((), "127.0.0.1"), (("10.0.0.0/8",), "127.0.0.1"), (("127.0.0.1",), "10.9.8.7")],
)
@pytest.mark.parametrize("is_keyed", [False, True])
def test_nobody_calls_in_the_name_of_another_address_but_a_trusted_proxy(
    app, keyed_app, key_of, client_of, proxies, noted, is_keyed
):
    asked, who = (keyed_app, bearer(key_of("admin"))) if is_keyed else (app, {})
    with served(asked, proxies) as (url, _, _):
        named = {"X-Forwarded-For": "10.9.8.7", **who}
        httpx.post(f"{url}/api/v1/boxes/reset", headers=named, timeout=PATIENCE_S)
    (deed,) = client_of(asked)("GET", "/api/v1/audit", headers=who).json()["items"]
    assert deed["request"]["address"] == noted


def address_of(url):
    return urlsplit(url).hostname, urlsplit(url).port
