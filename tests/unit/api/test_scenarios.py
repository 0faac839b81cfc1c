"""Scripts of a folder: kept, edited, run beside the city, stopped."""

import time
from pathlib import Path

import pytest

from scm.api.app import create_app
from scm.api.city import Link
from scm.api.folders import folders_in
from scm.api.keys import KeyRing, public_part
from scm.store.memory import MemoryStore

OVER = ("done", "failed", "cancelled")


def until_over(look, done=lambda row: row["state"] in OVER):
    """Return an operation's row once it is as wished."""
    for _ in range(2400):
        row = look()
        if done(row):
            return row
        time.sleep(0.05)
    raise AssertionError(row)


@pytest.fixture
def link():
    return Link(connect="tcp/x:1")


@pytest.fixture
def client(view, fake_city, city_map, tmp_path, client_of, link):
    folders = folders_in(tmp_path)
    return client_of(create_app(view, fake_city.ask, city_map, folders=folders, link=link))


@pytest.fixture
def keep(client):
    def put(name, text, status=None, **headers):
        status = status or (200 if headers else 201)
        headers = headers or {"If-None-Match": "*"}
        at = f"/api/v1/scenarios/{name}"
        answer = client("PUT", at, json={"text": text}, headers=headers)
        assert answer.status_code == status, answer.text
        return answer

    return put


@pytest.fixture
def run(client):
    def start(name, *arguments, key=""):
        at = f"/api/v1/scenarios/{name}/runs"
        headers = {"Idempotency-Key": key} if key else {}
        answer = client("POST", at, json={"arguments": list(arguments)}, headers=headers)
        assert answer.status_code == 202, answer.text
        return answer.json()["id"]

    return start


@pytest.fixture
def operation(client):
    def wait(run, *done):
        return until_over(lambda: client("GET", f"/api/v1/operations/{run}").json(), *done)

    return wait


def lines_of(client, run, after=0):
    return client("GET", f"/api/v1/scenarios/runs/{run}/lines?after={after}").json()["lines"]


def test_ones_own_scripts_stand_before_the_shipped_ones(client, keep):
    keep("zebra", '"""Count zebras."""\n')
    rows = client("GET", "/api/v1/scenarios").json()["items"]
    assert (rows[0]["name"], rows[0]["about"], rows[0]["shipped"]) == (
        "zebra",
        "Count zebras.",
        False,
    )
    shipped = {row["name"]: row["about"] for row in rows if row["shipped"]}
    assert shipped["travel_times"].startswith("Two cars lap")


def test_a_script_is_changed_only_by_who_saw_it_last(client, keep):
    tag = keep("mine", "a = 1\n").headers["etag"]
    keep("mine", "a = 2\n", **{"If-Match": tag})
    keep("mine", "a = 3\n", status=412, **{"If-Match": tag})
    keep("mine", "a = 3\n", status=412)
    assert client("GET", "/api/v1/scenarios/mine").json()["text"] == "a = 2\n"


def test_a_script_is_deleted_only_by_who_saw_it_last(client, keep):
    old = keep("mine", "a = 1\n").headers["etag"]
    new = keep("mine", "a = 2\n", **{"If-Match": old}).headers["etag"]
    for headers, status in (({}, 428), ({"If-Match": old}, 412), ({"If-Match": new}, 204)):
        gone = client("DELETE", "/api/v1/scenarios/mine", headers=headers)
        assert gone.status_code == status
    assert client("DELETE", "/api/v1/scenarios/mine").status_code == 404


def test_what_is_no_python_is_refused_with_its_line(keep):
    answer = keep("mine", "a = 1\nb = (\n", status=422)
    assert answer.json()["detail"].startswith("mine.py, line 2: expected a Python script")


def test_what_came_with_the_program_cannot_be_changed_or_deleted(client, keep):
    tag = client("GET", "/api/v1/scenarios/travel_times").headers["etag"]
    keep("travel_times", "a = 1\n", status=409, **{"If-Match": tag})
    assert client("DELETE", "/api/v1/scenarios/travel_times").json()["code"] == "shipped"


def test_a_run_hears_where_the_city_is_and_its_lines_are_told(client, keep, run, operation):
    keep("hello", 'import os, sys\nprint(os.environ["SCM_CONNECT"], sys.argv[1:])\nprint("b")\n')
    number = run("hello", "--connect", "{connect}")
    row = operation(number)
    assert (row["state"], row["result"]) == ("done", f"/recordings/scenarios?run={number}")
    assert lines_of(client, number) == ["tcp/x:1 ['--connect', 'tcp/x:1']", "b"]
    assert lines_of(client, number, after=1) == ["b"]


@pytest.mark.parametrize("link", [Link(script_credentials=Path("/c/script.toml"))])
def test_a_run_is_told_who_it_is_in_a_city_that_asks(client, keep, run, operation):
    keep("who", 'import os\nprint(os.environ["SCM_CREDENTIALS"])\n')
    number = run("who")
    assert operation(number)["state"] == "done"
    assert lines_of(client, number) == ["/c/script.toml"]


ASK_WHO = """
import os, stat
from pathlib import Path
told = Path(os.environ["SCM_API_KEY_FILE"])
print(told, stat.filemode(told.stat().st_mode), told.read_text())
"""


def test_a_script_is_lent_a_key_while_it_runs_where_the_interface_asks_for_one(
    view, fake_city, city_map, tmp_path, client_of
):
    ring = KeyRing(MemoryStore())
    app = create_app(
        view, fake_city.ask, city_map, folders=folders_in(tmp_path), link=Link(), keys=ring
    )
    client, key = client_of(app), ring.add("anna", "admin", 1)
    headers = {"Authorization": f"Bearer {key}"}
    held = []
    lend, ring.lend = ring.lend, lambda *given: held.append(lend(*given)) or held[-1]

    def ask(method, path, **options):
        given = {**headers, **options.pop("headers", {})}
        return client(method, f"/api/v1{path}", headers=given, **options)

    ask("PUT", "/scenarios/who", json={"text": ASK_WHO}, headers={"If-None-Match": "*"})
    run = ask("POST", "/scenarios/who/runs", json={}).json()["id"]
    until_over(lambda: ask("GET", f"/operations/{run}").json())
    (line,) = ask("GET", f"/scenarios/runs/{run}/lines").json()["lines"]
    file, mode, lent = line.split()
    assert (mode, [lent]) == ("-rw-------", held)
    assert not Path(file).exists()
    assert ring.record(public_part(lent)) is None


def test_the_same_key_runs_a_script_once(keep, run):
    keep("hello", "print(1)\n")
    assert run("hello", key="one") == run("hello", key="one") != run("hello", key="two")


def test_a_script_that_fails_says_why(keep, run, operation):
    keep("bad", 'raise SystemExit("no cars here")\n')
    row = operation(run("bad"))
    assert row["state"] == "failed"
    assert row["error"] == "bad.py ended with exit code 1: no cars here"


def test_a_stopped_script_may_clean_up(client, keep, run, operation):
    keep(
        "long",
        "import time\ntry:\n    print('drives')\n    time.sleep(60)\n"
        "except KeyboardInterrupt:\n    print('cars are gone')\n",
    )
    number = run("long")
    operation(number, lambda row: row["doing"] == "drives")
    client("DELETE", f"/api/v1/operations/{number}")
    assert operation(number)["state"] == "cancelled"
    assert lines_of(client, number) == ["drives", "cars are gone"]


def test_a_run_that_never_was_is_not_found(client, keep):
    assert client("GET", "/api/v1/scenarios/runs/scenario-7/lines").status_code == 404
    assert client("POST", "/api/v1/scenarios/none/runs", json={}).status_code == 404
