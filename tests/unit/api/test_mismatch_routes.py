"""Mismatch reports over REST: listed, read, downloaded, removed; searches and drives begun."""

import io
import json
import os
import shutil
import threading
import time
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from scm.api import mismatch_jobs, uploads
from scm.api.app import create_app
from scm.api.city import Link
from scm.api.folders import folders_in
from scm.errors import RunError
from scm.mismatch.report.write import write_report
from scm.v2x.messages.trip import Trip
from tests.unit.api.conftest import Client
from tests.unit.mismatch import made_up_findings as made_up
from tests.unit.recorder.short_run import write_run

API = "/api/v1/mismatch"
COMMANDS = "t,throttle,steering\n0,0,0\n1,0.5,0\n"
DESCRIPTION = """recording: 1
vehicle: nigel
tables:
  - file: commands.csv
    time: {column: t, unit: s}
    channels:
      command.throttle: {column: throttle}
"""


@pytest.fixture
def folders(tmp_path):
    found = folders_in(tmp_path)
    found.reports.mkdir()
    return found


@pytest.fixture
def call(view, fake_city, city_map, folders):
    bus = ("--connect", "tcp/127.0.0.1:1")
    return Client(create_app(view, fake_city.ask, city_map, folders=folders, link=Link(words=bus)))


@pytest.fixture
def ran(monkeypatch):
    """What programs were started; `then` is what they do."""
    started = []

    def run(words, tell, hear, *, kinder=True):
        started.append(words)
        return run.then(words, tell, hear)

    run.then = lambda *_: []
    run.started = started
    monkeypatch.setattr(mismatch_jobs, "run_scm", run)
    return run


@pytest.fixture(scope="module")
def reports_once():
    """Folder of reports by case, each written once and then copied."""
    with TemporaryDirectory() as folder:
        yield Path(folder)


@pytest.fixture
def put(folders, reports_once):
    """Put a report among those of the city."""

    def write(name, case="pair"):
        if not (reports_once / case).exists():
            write_report(*made_up.CASES[case](), reports_once / case)
        return Path(shutil.copytree(reports_once / case, folders.reports / name))

    return write


def with_drive(folder):
    drive = folder / "next_drive"
    drive.mkdir()
    (drive / "next_drive.yaml").write_text("drive: 1\ncommands: next_drive.csv\n", "utf-8")
    (drive / "next_drive.csv").write_text("t_s,throttle,steering\n0,0,0\n2,0.3,0.1\n", "utf-8")
    (drive / "next_drive_way.csv").write_text("t_s,x_m,y_m,yaw_rad\n0,1,2,0.5\n", "utf-8")


def wait_for(call, answer):
    assert answer.status_code == 202, answer.text
    address = answer.headers["Location"]
    for _ in range(2400):
        row = call("GET", address).json()
        if row["state"] not in ("waiting", "running"):
            return row
        time.sleep(0.05)
    raise AssertionError(row)


def packed(files):
    body = io.BytesIO()
    with zipfile.ZipFile(body, "w", zipfile.ZIP_DEFLATED) as file:
        for name, text in files.items():
            file.writestr(name, text)
    return body.getvalue()


def test_a_city_without_a_shelf_has_no_reports_and_says_how_to_have_some(client):
    assert client("GET", f"{API}/reports").json()["items"] == []
    answer = client("POST", f"{API}/jobs", json={"upload": "x"})
    assert answer.status_code == 409
    assert "--data" in answer.json()["detail"]


def test_reports_are_listed_with_what_they_found(call, put):
    put("monday")
    (row,) = call("GET", f"{API}/reports").json()["items"]
    assert (row["name"], row["verdict"]) == ("monday", "mismatch")
    assert len(row["effects"]) == 2
    assert row["before_m"] > row["after_m"] > 0.0


def test_a_search_that_time_cut_short_is_listed_as_such(call, put):
    for case in ("none", "cut_short"):
        put(case.replace("_", "-"), case)
    rows = call("GET", f"{API}/reports").json()["items"]
    assert {row["name"]: row["cut_short"] for row in rows} == {"none": False, "cut-short": True}
    report = call("GET", f"{API}/reports/cut-short").json()["report"]
    assert [question["name"] for question in report["unasked"]] == ["effects", "laws"]


def test_the_newest_report_comes_first_and_pages_go_on(call, put):
    for age, name in enumerate(("new", "middle", "old")):
        at = 1_700_000_000 - age
        os.utime(put(name, "none") / "report.json", (at, at))
    first = call("GET", f"{API}/reports?limit=2").json()
    second = call("GET", f"{API}/reports?limit=2&cursor={first['next']}").json()
    assert [row["name"] for row in first["items"] + second["items"]] == ["new", "middle", "old"]


def test_of_several_cars_each_has_its_report(call, folders, put):
    folder = folders.reports / "fleet"
    for car in ("n1", "n2"):
        put(f"fleet/{car}", "none")
    told = {"said": "They share a camera.", "conclusions": ["It is tilted."], "common": []}
    (folder / "cars.json").write_text(json.dumps(told), "utf-8")
    names = {row["name"] for row in call("GET", f"{API}/reports").json()["items"]}
    assert names == {"fleet.n1", "fleet.n2"}
    report = call("GET", f"{API}/reports/fleet.n1").json()
    assert report["row"]["verdict"] == "none"
    assert report["together"]["said"] == told["said"]
    assert report["together"]["conclusions"] == told["conclusions"]
    assert report["together"]["cars"] == ["fleet.n1", "fleet.n2"]


def test_a_damaged_report_is_listed_as_such_and_takes_nothing_down(call, put):
    folder = put("monday")
    (folder / "report.json").write_text('{"verdict": 3', "utf-8")
    (row,) = call("GET", f"{API}/reports").json()["items"]
    assert row["verdict"] == "unreadable"
    assert call("GET", f"{API}/reports/monday").status_code == 200


def test_a_report_tells_its_fields_what_it_draws_and_its_files(call, put):
    with_drive(put("monday"))
    body = call("GET", f"{API}/reports/monday").json()
    assert body["report"]["effects"][0]["name"] == "drive_lag"
    drawn = body["drawn"]
    assert drawn["said"].startswith("The simulator leaves out")
    assert len(drawn["residuals"]) == 3
    assert len(drawn["free_runs"]["part"]) == len(drawn["free_runs"]["before"]["x"]) == 30
    assert drawn["effects"][0]["numbers"][0]["neutral"] == 0.0
    assert body["drives"] == ["next_drive"]
    assert set(body["files"]) == {
        "report.html",
        "report.json",
        "drawn.json",
        "car.toml",
        "given.toml",
        "windows.csv",
    }


def test_files_are_downloads_and_nothing_else_can_be_had(call, put):
    put("monday")
    answer = call("GET", f"{API}/reports/monday/files/report.html")
    assert answer.headers["content-disposition"].startswith("attachment")
    for file in ("job.json", "..%2F..%2Fsecret", "pictures"):
        assert call("GET", f"{API}/reports/monday/files/{file}").status_code == 404
    assert call("GET", f"{API}/reports/..%2Fmonday").status_code in (404, 422)


def test_a_removed_report_is_gone(call, put):
    folder = put("monday")
    assert call("DELETE", f"{API}/reports/monday").status_code == 204
    assert not folder.exists()
    assert call("DELETE", f"{API}/reports/monday").status_code == 404


def test_reports_are_read_while_one_is_removed(call, folders, put):
    whole = put("whole")
    answers, over = [], threading.Event()

    def read():
        while not over.is_set():
            answers.append(call("GET", f"{API}/reports"))
            answers.append(call("GET", f"{API}/reports/whole"))

    reader = threading.Thread(target=read)
    reader.start()
    try:
        for number in range(40):
            copied = shutil.copytree(whole, folders.reports / ".next")
            assert call("DELETE", f"{API}/reports/whole").status_code == 204, number
            copied.rename(whole)
    finally:
        over.set()
        reader.join()
    assert {answer.status_code for answer in answers} <= {200, 404}
    rows = [row for answer in answers[::2] for row in answer.json()["items"]]
    assert rows
    assert {row["verdict"] for row in rows} == {"mismatch"}
    assert not list(folders.reports.glob(".*"))


def test_a_search_runs_the_program_and_puts_its_report_on_the_shelf(call, folders, ran):
    def search(words, tell, hear):
        hear("   12 s   16 %  trying 46 effects")
        out = folders.reports / words[words.index("--out") + 1]
        write_report(*made_up.CASES["none"](), out)
        return []

    ran.then = search
    (folders.recordings / "city-1.mcap").write_bytes(b"")
    body = {"recording": "city-1", "vehicle": "n1", "car": "nigel", "budget_s": 20, "to_s": 40.5}
    row = wait_for(call, call("POST", f"{API}/jobs", json=body))
    assert row["result"] == "/mismatch/city-1-n1", row
    words = ran.started[0]
    assert words[:2] == ["mismatch", str(folders.recordings / "city-1.mcap")]
    for option, value in (("--vehicle", "n1"), ("--car", "nigel"), ("--to-s", "40.5")):
        assert words[words.index(option) + 1] == value
    assert "--from-s" not in words
    job = call("GET", f"{API}/reports/city-1-n1").json()["job"]
    assert (job["source"], job["recordings"]) == ("city-1", ["city-1.mcap"])
    assert wait_for(call, call("POST", f"{API}/jobs", json=body))["result"].endswith("-n1-2")
    assert sorted(path.name for path in folders.reports.iterdir()) == ["city-1-n1", "city-1-n1-2"]


@pytest.mark.parametrize("finish", [True, False])
def test_of_a_run_without_its_end_what_is_there_of_it_is_searched(call, folders, ran, finish):
    given = []

    def search(words, tell, hear):
        if words[0] == "recover":
            Path(words[words.index("--out") + 1]).write_bytes(b"mended")
            return []
        given.append((Path(words[1]).name, Path(words[1]).read_bytes()))
        write_report(*made_up.CASES["none"](), Path(words[words.index("--out") + 1]))
        return []

    ran.then = search
    run = write_run(folders.recordings / "city-1.mcap", finish=finish)
    row = wait_for(call, call("POST", f"{API}/jobs", json={"recording": "city-1"}))
    assert row["state"] == "done", row
    assert given == [("city-1.mcap", run.read_bytes() if finish else b"mended")]
    assert [path.name for path in folders.reports.iterdir()] == ["city-1"]
    job = json.loads((folders.reports / "city-1" / "job.json").read_text())
    assert job["recordings"] == [str(run)]


def test_a_search_that_fails_says_why_and_leaves_nothing(call, folders, ran):
    def fail(words, tell, hear):
        (folders.reports / words[words.index("--out") + 1]).mkdir()
        raise RunError("scm mismatch: no car 'n9'")

    ran.then = fail
    (folders.recordings / "city-1.mcap").write_bytes(b"")
    row = wait_for(call, call("POST", f"{API}/jobs", json={"recording": "city-1.mcap"}))
    assert (row["state"], row["error"]) == ("failed", "scm mismatch: no car 'n9'")
    assert list(folders.reports.iterdir()) == []


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ({}, 422),
        ({"recording": "a", "upload": "b"}, 422),
        ({"recording": "nothing.mcap"}, 404),
        ({"recording": "../secret"}, 404),
        ({"upload": "gone-1"}, 404),
        ({"upload": "../.."}, 404),
        ({"again": "gone"}, 404),
        ({"recording": "city-1", "car": "tank"}, 404),
        ({"recording": "city-1", "from_s": 5, "to_s": 4}, 422),
        ({"recording": "city-1", "budget_s": 1e9}, 422),
        ({"recording": "city-1", "out": "/etc"}, 422),
    ],
)
def test_a_search_that_cannot_be_is_refused(call, folders, ran, body, status):
    (folders.recordings / "city-1.mcap").write_bytes(b"")
    assert call("POST", f"{API}/jobs", json=body).status_code == status
    assert ran.started == []


def test_a_span_that_ends_before_it_begins_is_refused_in_the_models_own_words(call):
    body = {"recording": "city-1", "from_s": 5, "to_s": 4}
    told = call("POST", f"{API}/jobs", json=body).json()
    assert told["detail"] == "body: to_s: got 4, expected more than from_s, 5"


def test_a_drive_is_shown_and_sent_to_a_car_on_the_citys_floor(call, folders, ran, city_map, put):
    with_drive(put("monday", "undecided"))
    (part,) = call("GET", f"{API}/reports/monday/drives/next_drive").json()["parts"]
    assert (part["lasts_s"], part["commands"][1]) == (2.0, [2, 0.3, 0.1])
    assert part["way"] == [[1, 2, 0.5]]

    def play(words, tell, hear):
        out = folders.reports / words[words.index("--out") + 1]
        out.mkdir()
        (out / "recording.yaml").write_text("recording: 1\n", "utf-8")
        return ["12 poses of 2 s recorded"]

    ran.then = play
    address = f"{API}/reports/monday/drives/next_drive/play"
    assert wait_for(call, call("POST", address, json={"vehicle": "n1"}))["state"] == "done"
    words = ran.started[0]
    assert words[0] == "play"
    assert words[words.index("--connect") + 1] == "tcp/127.0.0.1:1"
    floor = words[words.index("--floor") + 1 :]
    assert list(map(float, floor)) == [*city_map.floor.x_m, *city_map.floor.y_m]
    assert call("GET", f"{API}/reports/monday").json()["told"] == 1
    assert call("POST", address, json={"vehicle": "n1", "part": 2}).status_code == 422


def test_a_car_goes_on_with_its_trip_when_a_drive_has_ended(
    call, put, ran, fake_city, hear, snapshot
):
    with_drive(put("monday", "undecided"))
    trip = Trip(
        vehicle="n1", trip_id="t1", t_ns=1, route=("a", "b", "a", "b"), done_m=0.1,
        started_ns=0, length_m=None, via=("a", "b"), then="repeat",
    )  # fmt: skip
    hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)), trip)

    def hit(words, tell, hear):
        raise RunError("stopped: the car hit something")

    ran.then = hit
    address = f"{API}/reports/monday/drives/next_drive/play"
    for vehicle in ("n1", "n2"):
        row = wait_for(call, call("POST", address, json={"vehicle": vehicle}))
        assert row["state"] == "failed"
    (asked,) = fake_city.asked
    assert (asked.vehicle, asked.via, asked.then) == ("n1", ("a", "b"), trip.then)


def test_a_drive_that_ends_early_is_no_recording(call, put, ran):
    folder = put("monday", "undecided")
    with_drive(folder)

    def play(words, tell, hear):
        (folder / "told_1").mkdir()
        (folder / "told_1" / "recording.yaml").write_text("", "utf-8")
        return ["5 poses", "stopped: the car hit something"]

    ran.then = play
    address = f"{API}/reports/monday/drives/next_drive/play"
    row = wait_for(call, call("POST", address, json={"vehicle": "n1"}))
    assert (row["state"], row["error"]) == ("failed", "stopped: the car hit something")
    assert call("GET", f"{API}/reports/monday").json()["told"] == 0


def told(folder, *names):
    for name in names:
        (folder / name).mkdir()
        (folder / name / "recording.yaml").write_text("", "utf-8")
    return [str(folder / name) for name in names]


def test_a_search_again_takes_what_was_driven_since(call, folders, ran, put):
    folder = put("monday", "undecided")
    run = str(folders.recordings / "city-1.mcap")
    Path(run).write_bytes(b"")
    assert call("POST", f"{API}/jobs", json={"again": "monday"}).status_code == 409
    job = {"recordings": [run], "source": "x", "vehicle": "n1", "budget_s": 60.0, "to_s": 40.0}
    (folder / "job.json").write_text(json.dumps(job), "utf-8")
    second, tenth = told(folder, "told_2", "told_10")

    def search(words, tell, hear):
        write_report(*made_up.CASES["none"](), Path(words[words.index("--out") + 1]))
        return []

    ran.then = search
    row = wait_for(call, call("POST", f"{API}/jobs", json={"again": "monday"}))
    (words,) = ran.started
    assert words[1:3] == [run, "--out"]
    at = words.index("--told")
    assert words[at + 1 : at + 4] == [second, tenth, "--vehicle"]
    for option, value in (("--vehicle", "n1"), ("--budget-s", "60"), ("--to-s", "40.0")):
        assert words[words.index(option) + 1] == value
    found = call("GET", f"{API}/reports/{row['result'].split('/')[-1]}").json()["job"]
    assert (found["source"], found["told"]) == ("x, again with 2 more", ["told_2", "told_10"])
    asked = {"again": row["result"].split("/")[-1], "budget_s": 30}
    wait_for(call, call("POST", f"{API}/jobs", json=asked))
    words = ran.started[1]
    assert [second, tenth] == words[words.index("--told") + 1 :][:2]
    assert words[words.index("--budget-s") + 1] == "30"


def test_a_search_again_of_one_of_several_cars_is_of_that_car(call, folders, ran, put):
    folder = put("fleet/n1", "undecided")
    (folders.recordings / "city-1.mcap").write_bytes(b"")
    job = {"recordings": [str(folders.recordings / "city-1.mcap")], "source": "x"}
    (folders.reports / "fleet" / "job.json").write_text(json.dumps(job), "utf-8")
    (driven,) = told(folder, "told_1")
    wait_for(call, call("POST", f"{API}/jobs", json={"again": "fleet.n1"}))
    (words,) = ran.started
    assert words[words.index("--vehicle") + 1] == "n1"
    assert words[words.index("--told") + 1] == driven


def test_an_upload_becomes_a_recording_for_a_search(call, folders, ran):
    body = packed({"tuesday/recording.yaml": DESCRIPTION, "tuesday/commands.csv": COMMANDS,
                   "tuesday/notes.md": "left out"})  # fmt: skip
    answer = call("POST", f"{API}/uploads?name=My%20drive", content=body)
    assert answer.status_code == 201, answer.text
    upload = answer.json()["upload"]
    assert upload.startswith("my-drive-")
    assert (answer.json()["files"], answer.json()["vehicles"]) == (2, ["nigel"])
    wait_for(call, call("POST", f"{API}/jobs", json={"upload": upload}))
    assert ran.started[0][1] == str(folders.reports / "uploads" / upload)


@pytest.mark.parametrize(
    ("files", "why"),
    [
        ({"a.csv": COMMANDS}, "recording.yaml"),
        ({"recording.yaml": DESCRIPTION}, "no such file"),
        ({"recording.yaml": DESCRIPTION.replace("commands.csv", "/etc/passwd")}, "no such file"),
        ({"../recording.yaml": DESCRIPTION, "commands.csv": COMMANDS}, "inside"),
        (
            {
                "recording.yaml": DESCRIPTION.replace("nigel", "./mine.toml"),
                "commands.csv": COMMANDS,
                "mine.toml": "own_terms = ['x.py']",
            },
            "vehicle",
        ),
        ({"recording.yaml": "recording: [", "commands.csv": COMMANDS}, "recording.yaml"),
        ({"recording.yaml": DESCRIPTION + "#" * 300_000, "commands.csv": COMMANDS}, "256 KiB"),
        (
            {"recording.yaml": f"source: &a x\nnote: *a\n{DESCRIPTION}", "commands.csv": COMMANDS},
            "alias",
        ),
        ({"recording.yaml": "a: " + "[" * 100, "commands.csv": COMMANDS}, "20 deep"),
        (
            {"recording.yaml": DESCRIPTION + "".join(f"k{i}: 1\n" for i in range(24_000))},
            "unknown field `k0`",
        ),
        ({"a.csv": COMMANDS, "a.csv/b.csv": COMMANDS}, "cannot be read: File exists"),
    ],
)
def test_an_upload_that_asks_for_what_lies_outside_is_refused(call, folders, files, why):
    answer = call("POST", f"{API}/uploads", content=packed(files))
    assert answer.status_code == 422
    assert why in answer.json()["detail"]
    assert str(folders.reports) not in answer.json()["detail"]
    assert list((folders.reports / "uploads").iterdir()) == []


def test_a_description_that_takes_too_long_to_read_is_refused(call, monkeypatch):
    monkeypatch.setattr(uploads, "MOST_READING_S", 0)
    answer = call(
        "POST",
        f"{API}/uploads",
        content=packed({"recording.yaml": DESCRIPTION, "commands.csv": COMMANDS}),
    )
    assert answer.status_code == 422
    assert "to read it takes more than 0 s and 1024 MiB" in answer.json()["detail"]


def test_an_upload_that_is_no_zip_or_unpacks_to_too_much_is_refused(call, folders, monkeypatch):
    assert call("POST", f"{API}/uploads", content=b"hello").status_code == 422
    monkeypatch.setattr(uploads, "MOST_UNPACKED_BYTES", 1000)
    bomb = packed({"recording.yaml": DESCRIPTION, "commands.csv": "0" * 5000})
    assert call("POST", f"{API}/uploads", content=bomb).status_code == 422
    large = call("POST", f"{API}/uploads", content=bytes(uploads.MOST_BYTES + 1))
    assert (large.status_code, large.json()["code"]) == (413, "too_large")
    assert [one.name for one in folders.reports.iterdir()] == ["uploads"]


def test_an_upload_with_a_long_list_or_damaged_is_refused(call, monkeypatch):
    monkeypatch.setattr(uploads, "_CHUNK", 1001)  # entries lie across the edges of pieces
    long = packed({f"{number}/": "" for number in range(uploads.MOST_ENTRIES + 1)})
    detail = call("POST", f"{API}/uploads", content=long).json()["detail"]
    assert f"entries: got {uploads.MOST_ENTRIES + 1}" in detail
    damaged = bytearray(packed({"recording.yaml": DESCRIPTION * 9, "commands.csv": COMMANDS}))
    damaged[60:90] = bytes(30)
    answer = call("POST", f"{API}/uploads", content=bytes(damaged))
    assert (answer.status_code, "cannot be read" in answer.json()["detail"]) == (422, True)
