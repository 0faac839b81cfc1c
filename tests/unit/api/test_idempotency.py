"""A change that is asked for twice is done once and answered twice."""

import asyncio

import pytest
from starlette.applications import Starlette
from starlette.responses import JSONResponse, StreamingResponse
from starlette.routing import Route

from scm.api import idempotency
from scm.api.idempotency import STORED_NS, Idempotent
from scm.clock import StepClock

KEY = {"Idempotency-Key": "k1"}


@pytest.fixture
def clock():
    return StepClock()


@pytest.fixture
def done():
    return []


@pytest.fixture
def app(clock, done):
    async def change(request):
        body = await request.body()
        done.append(body)
        status = int(request.query_params.get("status", 201))
        answer = JSONResponse({"done": len(done)}, status, {"Location": "/x/1", "X-Other": "no"})
        if "cookie" in request.query_params:
            answer.set_cookie("scm_key", "secret")
        return answer

    async def long(_request):
        done.append(b"")

        async def pieces():
            for _ in range(3):
                yield b"x" * 200_000

        return StreamingResponse(pieces())

    routes = [
        Route("/x", change, methods=["GET", "POST", "PUT"]),
        Route("/long", long, methods=["POST"]),
    ]
    return Idempotent(Starlette(routes=routes), clock=clock)


@pytest.fixture
def client(app, client_of):
    return client_of(app)


def test_the_same_change_gets_the_stored_answer(client, done):
    first = client("POST", "/x", content=b"a", headers=KEY)
    again = client("POST", "/x", content=b"a", headers=KEY)
    assert (again.status_code, again.json()) == (201, {"done": 1})
    assert again.headers["location"] == "/x/1"
    assert "idempotency-replayed" not in first.headers
    assert again.headers["idempotency-replayed"] == "true"
    assert done == [b"a"]


def test_an_answer_with_a_cookie_is_made_anew_and_never_kept(client, done):
    for number in (1, 2):
        answer = client("POST", "/x?cookie=1", content=b"a", headers=KEY)
        assert answer.headers["set-cookie"].startswith("scm_key=secret")
        assert len(done) == number


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [("POST", "/x", b"b"), ("PUT", "/x", b"a"), ("POST", "/x?q=1", b"a")],
)
def test_another_request_under_the_key_is_a_mistake(client, done, method, path, body):
    client("POST", "/x", content=b"a", headers=KEY)
    refused = client(method, path, content=body, headers=KEY)
    assert (refused.status_code, refused.json()["code"]) == (422, "idempotency_mismatch")
    assert len(done) == 1


def test_without_a_key_and_for_looking_nothing_is_kept(client, done):
    client("POST", "/x", content=b"a")
    client("POST", "/x", content=b"a")
    client("GET", "/x", headers=KEY)
    client("GET", "/x", headers=KEY)
    assert len(done) == 4


def test_a_key_too_long_is_left_to_the_route_to_refuse(client, done):
    for _ in range(2):
        client("POST", "/x", content=b"a", headers={"Idempotency-Key": "k" * 129})
    assert len(done) == 2


def test_a_refusal_is_not_kept_and_its_key_is_free_again(client, done):
    assert client("POST", "/x?status=409", content=b"a", headers=KEY).status_code == 409
    assert client("POST", "/x", content=b"b", headers=KEY).status_code == 201
    assert done == [b"a", b"b"]


def test_after_a_failure_the_same_runs_again_but_nothing_else_may(client, done):
    assert client("POST", "/x?status=504", content=b"a", headers=KEY).status_code == 504
    assert client("POST", "/x?status=504", content=b"a", headers=KEY).status_code == 504
    assert client("POST", "/x?status=504", content=b"b", headers=KEY).status_code == 422
    assert done == [b"a", b"a"]


def test_while_the_first_is_under_way_the_second_has_to_wait(clock):
    entered, go_on = asyncio.Event(), asyncio.Event()

    async def slow(scope, receive, send):
        entered.set()
        await go_on.wait()
        await JSONResponse({})(scope, receive, send)

    app = Idempotent(slow, clock=clock)
    statuses = []

    async def ask():
        scope = {
            "type": "http", "method": "POST", "path": "/x", "query_string": b"",
            "headers": [(b"idempotency-key", b"k1")],
        }  # fmt: skip

        async def receive():
            return {"type": "http.request", "body": b"", "more_body": False}

        async def send(message):
            if message["type"] == "http.response.start":
                statuses.append(message["status"])

        await app(scope, receive, send)

    async def both():
        first = asyncio.create_task(ask())
        await entered.wait()
        await ask()
        go_on.set()
        await first

    asyncio.run(both())
    assert statuses == [409, 200]


def test_two_callers_may_use_one_key(app, client_of):
    def of(owner):
        async def asked(scope, receive, send):
            scope["scm_key"] = f"scm_{owner}_secret"
            await app(scope, receive, send)

        return client_of(asked)

    assert of("ada")("POST", "/x", content=b"a", headers=KEY).json() == {"done": 1}
    assert of("bob")("POST", "/x", content=b"a", headers=KEY).json() == {"done": 2}


def test_answers_are_forgotten_after_an_hour_or_when_there_are_too_many(
    client, clock, done, monkeypatch
):
    client("POST", "/x", content=b"a", headers=KEY)
    clock.set_ns(clock.now_ns() + STORED_NS + 1)
    client("POST", "/x", content=b"a", headers=KEY)
    assert len(done) == 2
    monkeypatch.setattr(idempotency, "MAX_ANSWERS", 1)
    for key in ("k2", "k3", "k4"):
        client("POST", "/x", content=b"a", headers={"Idempotency-Key": key})
    client("POST", "/x", content=b"a", headers=KEY)
    assert len(done) == 6


def test_an_answer_too_long_to_keep_is_given_whole_and_made_again(client, done):
    for _ in range(2):
        assert len(client("POST", "/long", headers=KEY).content) == 600_000
    assert len(done) == 2


def test_a_large_body_arrives_whole(client, done):
    body = bytes(range(256)) * 10_000
    client("POST", "/x", content=body, headers=KEY)
    assert done == [body]
    longer = client("POST", "/x", content=body + b"!", headers=KEY)
    assert longer.status_code == 422
