"""What the client makes of answers, refusals, silence and broken streams."""

import json

import httpx
import msgspec
import pytest

from scm.client import connection
from scm.client.connection import Connection, ProblemError, part
from scm.client.stream import events_of, parse, states
from scm.errors import AccessError, LinkError, MessageError


class Row(msgspec.Struct):
    vehicle: str
    laps: int = 1


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    monkeypatch.setattr(connection, "PAUSE_S", 0.001)


@pytest.fixture
def served():
    """Build a connection to a function; what it was asked is in the list beside."""
    opened = []

    def build(*answers, key=""):
        asked, left = [], list(answers)

        def handle(request):
            asked.append(request)
            answer = left.pop(0) if len(left) > 1 else left[0]
            if isinstance(answer, Exception):
                raise answer
            return answer

        own = Connection("http://city", key, transport=httpx.MockTransport(handle))
        opened.append(own)
        return own, asked

    yield build
    for own in opened:
        own.close()


def row(**fields):
    return httpx.Response(200, json={"vehicle": "n1", **fields})


def problem(status, code, **headers):
    body = {"status": status, "code": code, "detail": "because", "trace_id": "ab"}
    return httpx.Response(status, json=body, headers=headers)


def test_an_answer_is_typed_and_what_is_new_in_it_is_left_out(served):
    own, asked = served(row(mood="good"), key="scm_1_x")
    assert own.request("GET", "/v", Row, query={"a": 1, "b": None}) == Row("n1")
    assert str(asked[0].url) == "http://city/v?a=1"
    assert asked[0].headers["authorization"] == "Bearer scm_1_x"
    assert "idempotency-key" not in asked[0].headers


def test_a_key_comes_from_a_file_that_only_its_owner_reads(served, tmp_path, monkeypatch):
    file = tmp_path / "anna.key"
    monkeypatch.setenv("SCM_API_KEY_FILE", str(file))
    with pytest.raises(AccessError, match=r"anna\.key: No such file"):
        served(row())
    file.write_text("scm_1_file\n")
    file.chmod(0o640)
    with pytest.raises(AccessError, match=r"got -rw-r-----, .*chmod 600"):
        served(row())
    file.chmod(0o600)
    for given, sent in (("", "scm_1_file"), ("scm_2_said", "scm_2_said")):
        own, asked = served(row(), key=given)
        own.request("GET", "/v", Row)
        assert asked[0].headers["authorization"] == f"Bearer {sent}"
    for wrong, why in ((b"\n", "got nothing"), (b"\xff", "no ASCII")):
        file.write_bytes(wrong)
        with pytest.raises(AccessError, match=why):
            served(row())
    monkeypatch.delenv("SCM_API_KEY_FILE")
    own, asked = served(row())
    own.request("GET", "/v", Row)
    assert "authorization" not in asked[0].headers


def test_an_answer_of_another_kind_says_where_and_what_was_expected(served):
    own, _ = served(row(laps="many"))
    with pytest.raises(MessageError, match=r"GET /v: .*int.*laps"):
        own.request("GET", "/v", Row)


def test_a_refusal_is_raised_with_its_code_and_words(served):
    own, asked = served(problem(409, "owned"))
    with pytest.raises(ProblemError, match="409 owned: because") as refused:
        own.request("PUT", "/v", Row, body={}, key="")
    assert refused.value.problem.trace_id == "ab"
    assert len(asked) == 1


def test_a_refusal_that_is_no_problem_is_told_as_it_is(served):
    own, _ = served(httpx.Response(404, text="not here"))
    with pytest.raises(ProblemError, match="not here"):
        own.fetch("/v")


def test_a_lost_change_is_asked_again_under_the_same_key(served):
    own, asked = served(httpx.ReadTimeout("late"), problem(503, "offline"), row())
    assert own.request("POST", "/v", Row, body={"laps": 2, "via": None}, key="") == Row("n1")
    assert len(asked) == 3
    assert len({request.headers["idempotency-key"] for request in asked}) == 1
    assert json.loads(asked[0].content) == {"laps": 2}


def test_a_change_that_is_still_under_way_is_waited_for(served):
    own, asked = served(httpx.ReadTimeout("late"), problem(409, "in_flight"), row())
    assert own.request("POST", "/v", Row, body={}, key="") == Row("n1")
    assert len({request.headers["idempotency-key"] for request in asked}) == 1


def test_a_change_without_a_key_is_never_asked_twice(served):
    own, asked = served(httpx.ReadTimeout("late"), row())
    with pytest.raises(LinkError, match="ReadTimeout: late"):
        own.request("DELETE", "/v", Row)
    assert len(asked) == 1


def test_who_is_silent_for_ever_is_given_up(served):
    own, asked = served(httpx.ConnectError("refused"))
    with pytest.raises(LinkError, match="is `scm up` running"):
        own.request("GET", "/v", Row)
    assert len(asked) == connection.TRIES


def test_what_is_only_done_is_told_by_its_own_verb_and_under_a_key(served):
    own, asked = served(problem(503, "busy"), httpx.Response(204))
    own.send_only("DELETE", "/v/n1", key="k1")
    assert [one.method for one in asked] == ["DELETE", "DELETE"]
    assert {one.headers["Idempotency-Key"] for one in asked} == {"k1"}


def test_long_answers_come_in_pieces(served):
    own, _ = served(httpx.Response(200, content=b"abcdef"))
    assert b"".join(own.pieces("/film")) == b"abcdef"


def test_whatever_way_an_answer_fails_the_error_is_one_of_ours(served):
    own, _ = served(row(laps="many"))
    with pytest.raises(MessageError, match=r"POST /v: .*int.*laps"):
        own.send("POST", "/v", Row, b"zip")
    own, _ = served(httpx.ReadError("gone"))
    with pytest.raises(LinkError, match="ReadError: gone"):
        list(own.pieces("/film"))


def test_a_name_cannot_leave_its_place_in_the_path():
    assert part("../keys?a#b") == "..%2Fkeys%3Fa%23b"


class TestStream:
    LINES = ("id: r-1-0", "event: snapshot", 'data: {"stop":{"engaged":false}}', "")

    def test_events_are_read_from_lines(self):
        (found,) = parse(iter(["retry: 1000", "", *self.LINES, "data: {"]))
        assert (found.id, found.name) == ("r-1-0", "snapshot")
        assert found.data == {"stop": {"engaged": False}}

    def test_after_a_loss_the_last_id_goes_back(self):
        asked = []

        def connect(last_id):
            asked.append(last_id)
            yield from self.LINES
            if len(asked) == 1:
                raise httpx.ReadError("gone")

        found = events_of(connect, lambda _number: False)
        assert [next(found).id, next(found).id] == ["r-1-0", "r-1-0"]
        assert asked == ["", "r-1-0"]

    def test_a_city_that_never_answers_is_given_up_with_the_reason(self):
        def connect(_last_id):
            raise httpx.ConnectError("refused")
            yield

        with pytest.raises(LinkError, match="nothing came in 8 tries: ConnectError: refused"):
            list(events_of(connect, lambda _number: False))

    def test_a_server_that_is_not_there_yet_is_asked_again(self, served):
        stream = httpx.Response(200, text="\n".join([*self.LINES, ""]))
        own, asked = served(problem(502, ""), problem(503, "offline"), stream)
        assert next(own.events("/stream")).name == "snapshot"
        assert len(asked) == 3
        own, _ = served(problem(401, "unauthorised"))
        with pytest.raises(ProblemError, match="401"):
            next(own.events("/stream"))

    def test_a_closed_connection_ends_the_stream(self):
        assert list(events_of(lambda _last_id: iter(()), lambda _number: True)) == []

    def test_states_hold_every_topic_and_only_new_events(self):
        told = [
            {"stop": 1, "events": [1]},
            {"vehicles": 2},
            {"stop": 3},
        ]
        names = ("snapshot", "delta", "delta")
        lines = []
        for name, data in zip(names, told, strict=True):
            lines += [f"event: {name}", f"data: {json.dumps(data)}", ""]
        seen = list(states(parse(iter(lines))))
        assert seen[0] == {"stop": 1, "events": [1]}
        assert seen[2] == {"stop": 3, "vehicles": 2}


def test_the_etag_of_an_answer_is_kept_for_the_change_that_follows(served):
    told = httpx.Response(200, json={"x": 1}, headers={"ETag": '"a1"'})
    own, asked = served(told, httpx.Response(200, json={}))
    own.request("GET", "/x", dict)
    assert own.etag == '"a1"'
    own.request("PUT", "/x", dict, headers={"if-match": own.etag, "if-none-match": None})
    assert asked[-1].headers["if-match"] == '"a1"'
    assert "if-none-match" not in asked[-1].headers
