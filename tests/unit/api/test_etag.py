"""Who edits says which state he saw; what he did not see is not overwritten."""

import pytest
from starlette.requests import Request

from scm.api.encoding import encode
from scm.api.etag import Condition, etag_of, tagged
from scm.api.problem import RefusedError

BODY = {"plan": "calm"}
TAG = etag_of(encode(BODY))
OTHER = etag_of(b"other")


def request(method="GET", **headers):
    raw = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    return Request({"type": "http", "method": method, "path": "/x", "headers": raw})


def test_a_tag_is_strong_and_of_the_bytes():
    assert TAG.startswith('"')
    assert etag_of(encode({"plan": "calm"})) == TAG
    assert OTHER != TAG


def test_an_answer_carries_its_tag_and_a_reader_who_has_it_gets_304():
    whole = tagged(request(), BODY)
    assert (whole.status_code, whole.headers["etag"], whole.body) == (200, TAG, encode(BODY))
    short = tagged(request(if_none_match=f"{OTHER}, {TAG}"), BODY)
    assert (short.status_code, short.headers["etag"], short.body) == (304, TAG, b"")
    weak = tagged(request(if_none_match=f"W/{OTHER}, W/{TAG}"), BODY)  # as a proxy that packs says
    assert weak.status_code == 304
    assert tagged(request(if_none_match=OTHER), BODY).status_code == 200
    assert tagged(request("PUT", if_none_match="*"), BODY).status_code == 200


@pytest.mark.parametrize(
    ("headers", "body"),
    [
        ({"if_match": TAG}, BODY),
        ({"if_match": f"{OTHER}, {TAG}"}, BODY),
        ({"if_match": "*"}, BODY),
        ({"if_none_match": "*"}, None),
    ],
)
def test_a_change_of_what_was_seen_passes(headers, body):
    Condition(**headers).check(body)


@pytest.mark.parametrize(
    ("headers", "body", "code"),
    [
        ({}, BODY, "precondition_required"),
        ({}, None, "precondition_required"),
        ({"if_match": OTHER}, BODY, "precondition_failed"),
        ({"if_match": '"a*"'}, BODY, "precondition_failed"),
        ({"if_match": f"{OTHER}*"}, BODY, "precondition_failed"),
        ({"if_match": TAG}, None, "precondition_failed"),
        ({"if_match": f"W/{TAG}"}, BODY, "precondition_failed"),
        ({"if_none_match": "*"}, BODY, "precondition_failed"),
    ],
)
def test_a_change_of_another_state_is_refused(headers, body, code):
    with pytest.raises(RefusedError) as refused:
        Condition(**headers).check(body)
    assert refused.value.refused.code == code
