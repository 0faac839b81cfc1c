"""The web address of a living city, asked whatever its own description allows, and more."""

import socket
import time

import hypothesis
import pytest
import schemathesis
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import response_schema_conformance

from scm.selftest.city import City

pytestmark = [pytest.mark.e2e, pytest.mark.slow]

PARTS = ("traffic", "monitor", "world", "api")
ENDLESS = ("/stream", "/live", ".mjpeg", ".bin", "/events/stream")
SPAN_S = 20.0
EXAMPLES = 12
CHECKS = [not_a_server_error, response_schema_conformance]


@schemathesis.serializer("application/zip")
def as_bytes(_context, value):
    return value if isinstance(value, bytes) else str(value).encode()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(scope="module")
def schema(tmp_path_factory):
    with City("driving_school", tmp_path_factory.mktemp("runs"), PARTS, port=free_port()) as city:
        url = f"http://127.0.0.1:{city.port}/api/v1/openapi.json"
        yield schemathesis.openapi.from_url(url, wait_for_schema=20.0)


def is_endless(operation):
    """Say whether an answer never ends."""
    answers = operation.definition.raw.get("responses", {}).get("200", {}).get("content", {})
    streams = {"text/event-stream", "multipart/x-mixed-replace"}
    return bool(streams & set(answers)) or operation.path.endswith(ENDLESS)


def ask(operation, until_s):
    @hypothesis.settings(
        max_examples=EXAMPLES,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    @hypothesis.given(case=operation.as_strategy())
    def once(case):
        if time.monotonic() < until_s:
            answer = case.call(timeout=10.0)
            case.validate_response(answer, checks=CHECKS)

    once()


def test_no_question_breaks_the_server_and_answers_are_as_described(schema):
    operations = [found.ok() for found in schema.get_all_operations()]
    asked = [operation for operation in operations if not is_endless(operation)]
    assert len(asked) > 10
    failed = []
    for number, operation in enumerate(asked):
        began_s = time.monotonic()
        try:
            ask(operation, began_s + SPAN_S / len(asked))
        except Exception as wrong:  # noqa: BLE001  every operation shall be asked
            inner = " | ".join(map(str, getattr(wrong, "exceptions", ())))
            failed.append(f"{number} {operation.label}: {wrong} {inner}")
    assert not failed, "\n\n".join(failed)
