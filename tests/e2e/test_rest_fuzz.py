"""A city's REST interface gets whatever its own description allows, and more.

The city runs in lockstep: on a busy machine it goes slower, and refuses nothing for being late.
"""

import time
from contextlib import suppress

import hypothesis
import pytest
import schemathesis
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import response_schema_conformance

from tests.e2e.pages.town import town

pytestmark = [pytest.mark.e2e, pytest.mark.slow]

ENDLESS = ("/stream", "/live", ".mjpeg", ".bin", "/events/stream")
SPAN_S = 10.0  # of this process' own time
MAX_EXAMPLES = 5
CHECKS = [not_a_server_error, response_schema_conformance]


@schemathesis.serializer("application/zip")
def as_bytes(_context, value):
    return value if isinstance(value, bytes) else str(value).encode()


@pytest.fixture(scope="module")
def schema(tmp_path_factory):
    with town("driving_school", tmp_path_factory.mktemp("runs")) as city:
        url = f"{city.url}/api/v1/openapi.json"
        yield schemathesis.openapi.from_url(url, wait_for_schema=20.0)


def is_endless(operation):
    """Say whether an answer never ends."""
    answers = operation.definition.raw.get("responses", {}).get("200", {}).get("content", {})
    streams = {"text/event-stream", "multipart/x-mixed-replace"}
    return bool(streams & set(answers)) or operation.path.endswith(ENDLESS)


class TimeIsUp(BaseException):
    """No example more: as no `Exception`, it ends Hypothesis's drawing at once."""


def call(operation, span_s):
    """Make requests of one operation: one at least, and no more after this span of its time."""
    until_s, wrong = time.process_time() + span_s, []

    @hypothesis.settings(
        max_examples=MAX_EXAMPLES,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    @hypothesis.given(case=operation.as_strategy())
    def once(case):
        try:
            answer = case.call(timeout=60.0)
            case.validate_response(answer, checks=CHECKS)
        except Exception as failure:
            wrong.append(failure)  # which Hypothesis then makes small, for as long as it takes
            raise
        if not wrong and time.process_time() > until_s:
            raise TimeIsUp

    with suppress(TimeIsUp):
        once()


def test_no_request_breaks_the_server_and_answers_are_as_described(schema):
    found = [operation.ok() for operation in schema.get_all_operations()]
    operations = [operation for operation in found if not is_endless(operation)]
    assert len(operations) > 10
    failed = []
    for number, operation in enumerate(operations):
        try:
            call(operation, SPAN_S / len(operations))
        except Exception as wrong:  # noqa: BLE001  every operation shall be called
            inner = " | ".join(map(str, getattr(wrong, "exceptions", ())))
            failed.append(f"{number} {operation.label}: {wrong} {inner}")
    assert not failed, "\n\n".join(failed)
