"""A body that is too large is refused as a problem, whoever reads it, and files may be larger."""

import asyncio

import pytest

from scm.api.app import create_app
from scm.api.body_limit import LARGEST_BODY
from scm.api.folders import folders_in
from scm.api.keys import KeyRing
from scm.store.memory import MemoryStore

STOP = "/api/v1/stop"
UPLOADS = "/api/v1/mismatch/uploads"
KEY = {"Idempotency-Key": "k1"}
JSON = {"Content-Type": "application/json"}
LARGE = b" " * (LARGEST_BODY + 1)


async def in_pieces():
    for _ in range(4):
        yield LARGE[: LARGEST_BODY // 2]


@pytest.mark.parametrize("content", [LARGE, in_pieces], ids=["announced", "in pieces"])
@pytest.mark.parametrize("headers", [JSON, JSON | KEY], ids=["no key", "key"])
def test_a_body_too_large_is_refused_like_anything_else(client, fake_city, headers, content):
    given = content() if callable(content) else content
    refused = client("PUT", STOP, content=given, headers=headers)
    assert refused.headers["content-type"] == "application/problem+json"
    assert (refused.status_code, refused.json()["code"]) == (413, "too_large")
    assert "at most 1048576 bytes" in refused.json()["detail"]
    assert "content-security-policy" in refused.headers
    assert fake_city.asked == []


def test_what_is_refused_anyway_is_so_for_its_own_reason(view, fake_city, city_map, client_of):
    app = create_app(view, fake_city.ask, city_map, keys=KeyRing(MemoryStore()))
    refused = client_of(app)("POST", UPLOADS, content=LARGE)
    assert (refused.status_code, refused.json()["code"]) == (401, "unauthorised")


@pytest.mark.parametrize("headers", [{}, KEY], ids=["no key", "key"])
def test_a_file_may_be_larger_than_other_bodies(
    view, fake_city, city_map, client_of, tmp_path, headers
):
    app = create_app(view, fake_city.ask, city_map, folders=folders_in(tmp_path))
    read = client_of(app)("POST", UPLOADS, content=LARGE, headers=headers)
    assert (read.status_code, read.json()["code"]) == (422, "invalid")
    assert "zip" in read.json()["detail"]
    seen = "/api/v1/eye/cameras/overhead/views"
    read = client_of(app)("POST", seen, content=LARGE, headers=headers)
    assert "JPEG or PNG" in read.json()["detail"]


def test_a_body_that_breaks_off_is_no_failure_of_ours(view, fake_city, city_map, tmp_path):
    app = create_app(view, fake_city.ask, city_map, folders=folders_in(tmp_path))
    came = iter(
        [{"type": "http.request", "body": b"PK", "more_body": True}, {"type": "http.disconnect"}]
    )
    told = []

    async def receive():
        return next(came)

    async def send(message):
        told.append(message)

    scope = {
        "type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": "POST",
        "scheme": "http", "path": UPLOADS, "raw_path": UPLOADS.encode(), "query_string": b"",
        "root_path": "", "headers": [(b"host", b"127.0.0.1")], "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 8000),
    }  # fmt: skip
    asyncio.run(app(scope, receive, send))
    assert told[0]["status"] == 400
    assert list((tmp_path / "reports").glob("uploads/*")) == []
