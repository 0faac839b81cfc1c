"""Waiting for long work of the city."""

import httpx
import msgspec
import pytest

from scm.client import work as module
from scm.client.connection import Connection
from scm.client.work import WorkError, finished
from scm.errors import LinkError
from scm.records.operations import Operation

BEGUN = Operation(
    id="m-1",
    kind="mismatch",
    what="a drive",
    state="waiting",
    progress=None,
    doing="",
    result="",
    error="",
    owner="anna",
    asked_ns=1,
    began_ns=None,
    ended_ns=None,
)


@pytest.fixture
def waiting(monkeypatch):
    """Wait for work that passes through states."""
    monkeypatch.setattr(module, "LOOK_S", 0.001)

    def wait(*states, hear=None, timeout_s=60.0):
        told = [msgspec.structs.replace(BEGUN, **state) for state in states]

        def handle(request):
            assert request.url.path == "/api/v1/operations/m-1"
            row = told.pop(0) if len(told) > 1 else told[0]
            return httpx.Response(200, content=msgspec.json.encode(row))

        connection = Connection("http://city", transport=httpx.MockTransport(handle))
        return finished(connection, BEGUN, hear, timeout_s)

    return wait


def test_it_is_returned_when_done_and_every_step_is_told_once(waiting):
    runs = {"state": "running", "progress": 0.5, "doing": "fits"}
    heard = []
    done = {"state": "done", "progress": 1.0, "doing": "", "result": "/mismatch/x"}
    work = waiting({}, runs, runs, done, hear=lambda row: heard.append((row.doing, row.progress)))
    assert work.result == "/mismatch/x"
    assert heard == [("fits", 0.5), ("", 1.0)]


@pytest.mark.parametrize(("state", "error"), [("failed", "no drive in it"), ("cancelled", "")])
def test_what_fails_or_is_called_off_is_raised_in_its_words(waiting, state, error):
    with pytest.raises(WorkError, match=f"mismatch of a drive: {state}") as raised:
        waiting({"state": state, "error": error})
    assert raised.value.work.error == error
    assert str(raised.value).endswith(error or state)


def test_what_takes_too_long_is_not_waited_for(waiting):
    with pytest.raises(LinkError, match=r"mismatch of a drive: not over after 0\.05 s: fits"):
        waiting({"state": "running", "doing": "fits"}, timeout_s=0.05)
