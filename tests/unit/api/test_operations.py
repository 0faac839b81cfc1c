"""Long work: in turn, told as it goes, called off, forgotten; no thread outlives the server."""

import logging
import threading

import pytest

from scm.api import operations
from scm.api.operations import MOST_WAITING, Operations, accepted
from scm.api.problem import RefusedError
from scm.clock import StepClock
from scm.errors import RunError

PATIENCE_S = 20.0


@pytest.fixture
def clock():
    return StepClock(5)


@pytest.fixture
def work(clock):
    own = Operations(clock)
    yield own
    own.close()


def finish(*rows):
    """Wait for the threads of operations to end."""
    names = {row.id for row in rows}
    for thread in [one for one in threading.enumerate() if one.name in names]:
        thread.join(PATIENCE_S)
        assert not thread.is_alive()


class Held:
    """Work that waits until it is let go, and says when it runs."""

    def __init__(self):
        self.runs = threading.Event()
        self.go = threading.Event()

    def __call__(self, tell):
        self.runs.set()
        assert self.go.wait(PATIENCE_S)
        tell("goes on", 0.5)
        return "/made/1"


@pytest.fixture
def held():
    return Held()


def test_work_is_told_from_the_asking_to_its_result(work, held, clock):
    row = work.start("export", "today", held, owner="ada")
    assert (row.id, row.state, row.owner, row.asked_ns) == ("export-1", "waiting", "ada", 5)
    assert held.runs.wait(PATIENCE_S)
    assert work.find(row.id).state == "running"
    clock.set_ns(9)
    held.go.set()
    finish(row)
    over = work.find(row.id)
    assert (over.state, over.result, over.progress, over.doing) == ("done", "/made/1", 1.0, "")
    assert (over.began_ns, over.ended_ns) == (5, 9)


def test_what_it_says_of_itself_is_seen_while_it_runs(work):
    said, go = threading.Event(), threading.Event()

    def tells(tell):
        tell("reads", 0.25)
        said.set()
        assert go.wait(PATIENCE_S)
        return ""

    row = work.start("export", "today", tells)
    assert said.wait(PATIENCE_S)
    assert (work.find(row.id).doing, work.find(row.id).progress) == ("reads", 0.25)
    go.set()
    finish(row)


def test_one_kind_runs_one_at_a_time_and_another_beside_it(work, held):
    second, other = Held(), Held()
    first = work.start("export", "a", held)
    assert held.runs.wait(PATIENCE_S)
    later = work.start("export", "b", second)
    beside = work.start("search", "c", other)
    assert other.runs.wait(PATIENCE_S)
    assert work.find(later.id).state == "waiting"
    for one in (held, second, other):
        one.go.set()
    finish(first, later, beside)
    assert [row.state for row in work.rows()] == ["done"] * 3
    assert [row.id for row in work.rows()] == ["search-3", "export-2", "export-1"]


def test_a_failure_of_ours_is_told_in_its_words(work):
    def fails(_tell):
        msg = "today.mcap: it holds no car named n9"
        raise RunError(msg)

    row = work.start("export", "a", fails)
    finish(row)
    assert (work.find(row.id).state, work.find(row.id).error) == (
        "failed",
        "today.mcap: it holds no car named n9",
    )


def test_a_bug_is_logged_and_its_insides_are_not_told(work, caplog):
    def breaks(_tell):
        raise ZeroDivisionError

    with caplog.at_level(logging.ERROR):
        row = work.start("export", "a", breaks)
        finish(row)
    assert work.find(row.id).error == "the server failed on this; its log has the reason"
    assert "ZeroDivisionError" in caplog.text
    after = work.start("export", "b", lambda _tell: "/made/2")
    finish(after)
    assert work.find(after.id).state == "done"


def test_work_called_off_ends_at_its_next_word(work, held):
    row = work.start("export", "a", held)
    assert held.runs.wait(PATIENCE_S)
    assert work.cancel(row.id).state == "running"
    held.go.set()
    finish(row)
    over = work.find(row.id)
    assert (over.state, over.result) == ("cancelled", "")
    assert work.cancel(row.id) == over


def test_what_is_called_off_while_it_waits_never_runs(work, held):
    ran = []
    first = work.start("export", "a", held)
    assert held.runs.wait(PATIENCE_S)
    second = work.start("export", "b", lambda _tell: ran.append(1) or "")
    work.cancel(second.id)
    finish(second)  # at once, though the first still runs
    assert (work.find(second.id).state, work.find(first.id).state) == ("cancelled", "running")
    held.go.set()
    finish(first)
    assert ran == []


def test_what_waits_runs_in_the_order_of_asking(work, held):
    ran = []
    first = work.start("export", "a", held)
    assert held.runs.wait(PATIENCE_S)

    def noting(number):
        return lambda _tell: ran.append(number) or ""

    rows = [work.start("export", str(number), noting(number)) for number in range(8)]
    held.go.set()
    finish(first, *rows)
    assert ran == list(range(8))


def test_nobody_knows_an_operation_that_never_was(work):
    assert work.find("export-9") is None
    assert work.cancel("export-9") is None


def test_too_many_that_wait_are_refused(work, held):
    rows = [work.start("export", "a", held) for _ in range(MOST_WAITING)]
    with pytest.raises(RefusedError, match=rf"{MOST_WAITING} wait, expected fewer"):
        work.start("export", "one too many", held)
    assert work.start("search", "of another kind", lambda _tell: "").state == "waiting"
    held.go.set()
    finish(*rows)


def test_what_is_long_over_is_forgotten_and_what_runs_is_not(work, held, monkeypatch):
    monkeypatch.setattr(operations, "MAX_OPERATIONS", 3)
    running = work.start("search", "long", held)
    for _ in range(5):
        finish(work.start("export", "a", lambda _tell: ""))
    assert [row.id for row in work.rows()] == ["export-6", "export-5", "search-1"]
    held.go.set()
    finish(running)


def test_close_calls_all_off_and_their_threads_end(work):
    rows = []

    def until_called_off(tell):
        assert tell.cancelled.wait(PATIENCE_S)
        tell()
        return "never"

    rows = [work.start("export", str(number), until_called_off) for number in range(3)]
    work.close()
    finish(*rows)
    assert {row.state for row in work.rows()} == {"cancelled"}


def test_the_answer_is_202_with_an_address(work):
    row = work.start("export", "a", lambda _tell: "")
    answer = accepted(row)
    assert answer.status_code == 202
    assert answer.headers["location"] == f"/api/v1/operations/{row.id}"
    finish(row)


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("/srv/scm/runs/today.mcap: it holds no car", "today.mcap: it holds no car"),
        ("[Errno 13] denied: '/var/lib/my scm/job 7'", "[Errno 13] denied: 'job 7'"),
        ("reads /tmp/x/, then (/home/ada/a.csv)", "reads a folder, then (a.csv)"),
        ("0.3 km/h at http://127.0.0.1:8000/eye", "0.3 km/h at http://127.0.0.1:8000/eye"),
        ("see /api/v1/mismatch/reports/m-7", "see /api/v1/mismatch/reports/m-7"),
        ("runs/today.mcap: n1", "runs/today.mcap: n1"),
    ],
)
def test_a_jobs_words_do_not_say_where_files_lie_on_the_server(work, said, told):
    def fail(tell):
        tell(said)
        seen.append(work.rows()[0].doing)
        raise RunError(said)

    seen = []
    row = work.start("mismatch", "n1", fail)
    finish(row)
    assert (seen, work.find(row.id).error) == ([told], told)
