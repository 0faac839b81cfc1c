"""Recordings over REST: the list, any moment, files, notes, and an end."""

import asyncio
import csv
import io
import os
import time
from dataclasses import replace

import pytest

from scm.__main__ import main
from scm.api.app import create_app
from scm.api.folders import folders_in
from scm.api.problem import RefusedError
from scm.api.ranged import BLOCK
from scm.api.recording_repository import RecordingRepository
from scm.api.replay import csv_of
from scm.api.routes.recordings import _converted
from scm.recorder import run_index
from scm.recorder.run_index import read_index
from tests.e2e.city_process import wait_for
from tests.unit.recorder.short_run import BEGIN_NS, PICTURE, STUCK_S, write_run


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "runs"


@pytest.fixture
def client(view, fake_city, city_map, folder, client_of):
    folder.mkdir()
    app = create_app(view, fake_city.ask, city_map, folders=folders_in(folder))
    return client_of(app)


@pytest.fixture
def ask(client):
    def call(path, status=200, method="GET", **options):
        answer = client(method, f"/api/v1/recordings{path}", **options)
        assert answer.status_code == status, answer.text
        return answer.json() if answer.content else None

    return call


def quiet(path):
    """Date a file back: nobody writes to it any more."""
    long_ago = time.time() - 60.0
    os.utime(path, (long_ago, long_ago))


def busy(path):
    """Date a file ahead: it is being written, however slow the test is."""
    later = time.time() + 3600.0
    os.utime(path, (later, later))


def test_a_city_without_a_shelf_has_no_recordings(view, fake_city, city_map, client_of):
    client = client_of(create_app(view, fake_city.ask, city_map))
    assert client("GET", "/api/v1/recordings").json() == {"items": [], "next": None}


def test_the_list_tells_begin_length_cars_and_state(ask, folder):
    write_run(folder / "run.mcap")
    (row,) = ask("")["items"]
    assert (row["name"], row["state"], row["begin_ns"]) == ("run", "complete", BEGIN_NS)
    assert (row["length_s"], row["cars"]) == (5.0, ["n1", "n10"])
    assert row["size_bytes"] == (folder / "run.mcap").stat().st_size


def test_a_file_without_its_end_is_being_written_or_cut_off(ask, folder):
    path = write_run(folder / "run.mcap", finish=False)
    busy(path)
    assert ask("/run")["state"] == "being written"
    quiet(path)
    row = ask("/run")
    assert row["state"] == "cut off"
    assert "scm recover run.mcap" in row["trouble"]
    assert ask("/run/frames?from_s=4&to_s=5")["frames"][-1]["t_s"] > 4.8


def test_a_bad_file_stands_in_the_list_with_its_reason_and_harms_no_other(ask, folder):
    write_run(folder / "good.mcap")
    (folder / "bad.mcap").write_bytes(b"no such thing")
    rows = {row["name"]: row for row in ask("")["items"]}
    assert rows["bad"]["state"] == "unreadable"
    assert rows["bad"]["trouble"] == "bad.mcap: no recording: an MCAP file begins otherwise"
    assert rows["good"]["state"] == "complete"
    assert ask("/bad/frames", status=409)["code"] == "unreadable"


def test_names_that_leave_the_folder_find_nothing(client, folder):
    write_run(folder.parent / "outside.mcap")
    for name in ("..%2Foutside", "%2e%2e%2foutside", "....", "outside"):
        assert client("GET", f"/api/v1/recordings/{name}").status_code in (404, 422)
    with pytest.raises(RefusedError):
        RecordingRepository(folder).path("../outside")


def test_long_lists_come_in_pages(ask, folder):
    for number in range(3):
        os.utime(write_run(folder / f"r{number}.mcap", 0.5), (number, number))
    first = ask("?limit=2")
    assert [row["name"] for row in first["items"]] == ["r2", "r1"]
    assert [row["name"] for row in ask(f"?limit=2&cursor={first['next']}")["items"]] == ["r0"]


def test_frames_tell_where_cars_were_and_what_signals_showed(ask, folder):
    write_run(folder / "run.mcap")
    found = ask("/run/frames?from_s=1&to_s=3&hz=10")
    assert [car["vehicle"] for car in found["cars"]] == ["n1", "n10"]
    times = [frame["t_s"] for frame in found["frames"]]
    assert len(times) == 21
    assert (times[0], times[-1]) == (1.0, 3.0)
    car, x_m, *_ = found["frames"][5]["cars"][0]
    assert (car, x_m) == (0, times[5])
    shown = [(one["t_s"], one["colour"]) for one in found["signals"]]
    assert shown == [(1.0, "red"), (2.0, "green")]
    between = ask("/run/frames?from_s=1.05&to_s=1.08")["signals"]  # none was told of meanwhile
    assert [(one["t_s"], one["colour"]) for one in between] == [(1.05, "red")]


def test_a_stretch_in_a_pause_tells_when_the_next_frame_comes(ask, folder):
    write_run(folder / "run.mcap", pause_s=86_400.0)
    assert ask("/run/frames?from_s=0&to_s=10")["next_s"] is None
    silent = ask("/run/frames?from_s=10&to_s=20")
    assert (silent["frames"], silent["next_s"]) == ([], 86_402.05)
    assert ask("/run/frames?from_s=86402&to_s=86412")["frames"][0]["t_s"] == 86_402.05
    assert ask("/run/frames?from_s=90000&to_s=90010")["next_s"] is None


def test_frames_tell_who_is_stuck_and_against_what(ask, folder):
    write_run(folder / "run.mcap")
    frames = ask(f"/run/frames?from_s={STUCK_S - 0.1}&to_s={STUCK_S}")["frames"]
    assert [[car[-1] for car in frame["cars"]] for frame in frames] == [
        [None, None],
        [["n10"], None],
    ]


def test_boxes_are_told_at_the_begin_and_when_they_move(ask, folder):
    write_run(folder / "run.mcap")
    frames = ask("/run/frames?from_s=0&to_s=2")["frames"]
    moved = [(frame["t_s"], frame["boxes"][0]["x_m"]) for frame in frames if frame["boxes"]]
    assert moved == [(0.0, 0.0), (1.0, 0.1)]


def test_the_eyes_picture_of_a_time_is_the_newest_by_then(ask, client, folder):
    write_run(folder / "run.mcap")  # pictured at 3 s
    assert ask("/run/summary")["eye_cameras"] == ["overhead"]
    told = [{"t_s": 3.0, "vehicle": "", "camera": "overhead"}]
    assert ask("/run/frames?from_s=0&to_s=2.9")["pictures"] == []
    assert ask("/run/frames?from_s=2&to_s=4")["pictures"] == told
    assert ask("/run/frames?from_s=4&to_s=5")["pictures"] == told
    for t_s in (3.0, 4.5):
        answer = client("GET", f"/api/v1/recordings/run/eye/overhead.jpg?t_s={t_s}")
        assert answer.content == PICTURE
        assert answer.headers["content-type"] == "image/jpeg"
        assert answer.headers["x-time-ns"] == str(BEGIN_NS)
    early = ask("/run/eye/overhead.jpg?t_s=2.9", status=404)
    assert early["detail"] == "run: camera 'overhead' has no picture of 2.9 s or before"
    ask("/run/eye/elsewhere.jpg?t_s=4", status=404)


def test_pictures_of_a_cars_own_camera_are_told_and_given_as_the_eyes_are(ask, client, folder):
    write_run(folder / "run.mcap", of_n1={2.0: b"\xff\xd8 two", 4.0: b"\xff\xd8 four"})
    summary = ask("/run/summary")
    assert summary["car_cameras"] == [{"vehicle": "n1", "camera": "front"}]
    assert summary["eye_cameras"] == ["overhead"]
    told = [
        (one["t_s"], one["vehicle"]) for one in ask("/run/frames?from_s=2.5&to_s=5")["pictures"]
    ]
    assert told == [(2.0, "n1"), (3.0, ""), (4.0, "n1")]
    at = "/run/vehicles/n1/camera/front.jpg"
    for t_s, jpeg in ((2.0, b"two"), (3.9, b"two"), (4.0, b"four"), (5.0, b"four")):
        answer = client("GET", f"/api/v1/recordings{at}?t_s={t_s}")
        assert answer.content == b"\xff\xd8 " + jpeg
        assert answer.headers["content-type"] == "image/jpeg"
        assert answer.headers["x-time-ns"] == str(BEGIN_NS)
    early = ask(f"{at}?t_s=1.9", status=404)
    assert early["detail"] == "run: n1's camera 'front' has no picture of 1.9 s or before"
    ask("/run/vehicles/n10/camera/front.jpg?t_s=5", status=404)
    ask("/run/vehicles/n1/camera/rear.jpg?t_s=5", status=404)
    ask("/run/eye/front.jpg?t_s=5", status=404)


def test_pictures_count_as_rows_of_an_answer(ask, folder, monkeypatch):
    from scm.api import replay

    monkeypatch.setattr(replay, "MOST_ROWS", 30)
    write_run(folder / "run.mcap", of_n1={tick / 20: b"" for tick in range(100)})
    found = ask("/run/frames?from_s=0&to_s=5&hz=20")
    assert (len(found["frames"]), len(found["pictures"]), found["to_s"]) == (10, 10, 0.5)


def test_too_much_at_once_is_cut_and_says_so(ask, folder, monkeypatch):
    from scm.api import replay

    monkeypatch.setattr(replay, "MOST_ROWS", 10)
    write_run(folder / "run.mcap")
    found = ask("/run/frames?from_s=0&to_s=5")
    assert len(found["frames"]) == 5
    assert found["to_s"] == 0.5
    assert ask("/run/frames?from_s=0&to_s=500", status=422)["code"] == "invalid"


def test_events_come_in_their_order_with_their_time(ask, folder):
    write_run(folder / "run.mcap")
    rows = ask("/run/events")["items"]
    assert [(row["t_s"], row["severity"]) for row in rows] == [(0.0, "info"), (3.0, "warning")]


def test_the_summary_knows_the_map_that_was_driven_on(ask, client, folder, city_map):
    write_run(folder / "run.mcap")
    summary = ask("/run/summary")
    assert summary["map_title"] == city_map.title
    assert len(summary["lights"]) == len(city_map.lights)
    drawn = client("GET", "/api/v1/recordings/run/map.svg")
    assert drawn.headers["content-type"] == "image/svg+xml"
    assert "<svg" in drawn.text


def test_csv_has_a_row_for_each_report(client, ask, folder):
    write_run(folder / "run.mcap")
    own = client("GET", "/api/v1/recordings/run/csv?vehicle=n10").text
    rows = list(csv.DictReader(io.StringIO(own)))
    assert len(rows) == 101
    assert (rows[20]["t_s"], rows[20]["x_m"], rows[20]["throttle"]) == ("1.0", "-1.0", "0.4")
    everybody = client("GET", "/api/v1/recordings/run/csv").text
    assert len(everybody.splitlines()) == 1 + 2 * 101
    ask("/run/csv?vehicle=n2", status=404)


def test_csv_of_a_span_has_its_rows_and_unpacks_no_more(client, ask, folder, monkeypatch):
    index = read_index(write_run(folder / "run.mcap"))
    unpacked, real = [], run_index._unpacked
    monkeypatch.setattr(
        run_index, "_unpacked", lambda *given: unpacked.append(given) or real(*given)
    )
    for vehicle, cars in (("n10", 1), ("", 2)):
        span = f"csv?vehicle={vehicle}&from_s=2.1&to_s=2.2"
        told = client("GET", f"/api/v1/recordings/run/{span}").text
        rows = list(csv.DictReader(io.StringIO(told)))
        assert [row["t_s"] for row in rows[::cars]] == ["2.1", "2.15", "2.2"]
    assert 2 <= len(unpacked) <= 4 < len(index.chunks)
    late = client("GET", "/api/v1/recordings/run/csv?from_s=4.9").text
    assert len(late.splitlines()) == 1 + 2 * 3
    assert ask("/run/csv?from_s=3&to_s=2", status=422)["code"] == "invalid"


def test_csv_is_written_on_the_command_line_too(client, folder, tmp_path, capsysbinary):
    path = str(write_run(folder / "run.mcap"))
    told = client("GET", "/api/v1/recordings/run/csv?vehicle=n1&from_s=1&to_s=2").content
    words = ["export", "csv", path, "--vehicle", "n1", "--from-s", "1", "--to-s", "2"]
    assert main(words) == 0
    assert capsysbinary.readouterr().out == told
    out = tmp_path / "n1.csv"
    assert main([*words, "--out", str(out)]) == 0
    assert out.read_bytes() == told
    assert main([*words, "--out", str(out)]) == 2
    assert b"n1.csv: cannot be written: File exists" in capsysbinary.readouterr().err
    assert main(["export", "csv", path, "--vehicle", "n2"]) == 2
    assert b"expected one of n1, n10" in capsysbinary.readouterr().err
    assert main(["export", "csv", path, "--from-s", "nan"]) == 2
    assert b"span: got nan" in capsysbinary.readouterr().err


def test_a_span_without_a_row_is_told_and_is_no_table(ask, folder, tmp_path, capsys):
    path = str(write_run(folder / "run.mcap", leaves_s=2.0))
    late = ask("/run/csv?from_s=60", status=404)
    words = "no row of any car from 60 s on; the recording is 5.0 s long"
    assert (late["code"], late["detail"]) == ("not_found", f"run: {words}")
    between = "no row of n10 from 1.01 s to 1.04 s; the recording is 5.0 s long"
    gap = ask("/run/csv?vehicle=n10&from_s=1.01&to_s=1.04", status=404)
    assert gap["detail"] == f"run: {between}"

    out = tmp_path / "late.csv"
    assert main(["export", "csv", path, "--from-s", "60", "--out", str(out)]) == 2
    told = capsys.readouterr()
    assert (told.out, told.err.count("\n")) == ("", 1)
    assert f"{path}: {words}" in told.err
    assert not out.exists()
    span = ["--vehicle", "n10", "--from-s", "1.01", "--to-s", "1.04"]
    assert main(["export", "csv", path, *span]) == 2
    assert between in capsys.readouterr().err


def test_a_span_of_which_nothing_can_be_read_tells_what_was_left_out(client, folder):
    path = write_run(folder / "run.mcap")
    content = bytearray(path.read_bytes())
    then_ns = BEGIN_NS + 1_050_000_000
    chunk = next(one for one in read_index(path).chunks if one.end_ns >= then_ns)
    content[chunk.start + 60 : chunk.start + chunk.length] = bytes(chunk.length - 60)
    path.write_bytes(content)
    told = client("GET", "/api/v1/recordings/run/csv?from_s=1.03&to_s=1.07").text
    head, left_out = told.splitlines()
    assert head.startswith("t_s,vehicle,")
    assert left_out.startswith("# left out: ")


def test_a_table_looks_through_the_list_of_chunks_once_and_not_with_each_row(tmp_path):
    index = read_index(write_run(tmp_path / "run.mcap"))
    looked = []

    class Watched(tuple):
        def __iter__(self):
            looked.append(None)
            return super().__iter__()

    watched = replace(index, chunks=Watched(index.chunks))
    assert len(b"".join(csv_of(watched)).splitlines()) == 1 + 2 * 101
    assert len(looked) <= 3


def test_the_file_comes_whole_or_in_ranges(client, folder):
    content = write_run(folder / "run.mcap").read_bytes()
    at = "/api/v1/recordings/run.mcap"
    whole = client("GET", at)
    assert whole.content == content
    assert whole.headers["accept-ranges"] == "bytes"
    part = client("GET", at, headers={"Range": "bytes=100-199"})
    assert (part.status_code, part.content) == (206, content[100:200])
    assert part.headers["content-range"] == f"bytes 100-199/{len(content)}"
    assert client("GET", at, headers={"Range": "bytes=-50"}).content == content[-50:]
    assert client("GET", at, headers={"Range": "bytes=50-"}).content == content[50:]
    assert client("GET", at, headers={"Range": f"bytes={len(content)}-"}).status_code == 416
    for endless in (f"bytes={'9' * 5000}-", f"bytes=-{'9' * 5000}"):  # no number at all
        assert client("GET", at, headers={"Range": endless}).status_code == 200
    old = client("GET", at, headers={"Range": "bytes=0-9", "If-Range": '"older"'})
    assert (old.status_code, len(old.content)) == (200, len(content))
    head = client("HEAD", at)
    assert (head.content, head.headers["content-length"]) == (b"", str(len(content)))


def test_a_file_that_grows_meanwhile_is_sent_as_long_as_it_was(tmp_path):
    from scm.api.ranged import _blocks

    path = tmp_path / "run.mcap"
    path.write_bytes(b"a" * (BLOCK + 5))
    blocks = _blocks(path, 0, BLOCK + 5)
    first = next(blocks)
    with path.open("ab") as stream:
        stream.write(b"b" * 1000)
    assert first + b"".join(blocks) == b"a" * (BLOCK + 5)


def test_notes_are_kept_for_who_saw_the_present_ones(client, ask, folder):
    write_run(folder / "run.mcap")
    at = "/api/v1/recordings/run/notes"
    tag = client("GET", at).headers["etag"]
    body = {"title": "Brisk", "notes": "n1 slipped"}
    assert client("PUT", at, json=body).status_code == 428
    assert client("PUT", at, json=body, headers={"If-Match": tag}).json() == body
    assert client("PUT", at, json={}, headers={"If-Match": tag}).status_code == 412
    row = ask("/run")
    assert (row["title"], row["notes"]) == ("Brisk", "n1 slipped")


def test_a_recording_can_be_deleted_but_not_while_it_is_written(ask, folder):
    path = write_run(folder / "run.mcap", finish=False)
    busy(path)
    assert ask("/run", status=409, method="DELETE")["code"] == "being_written"
    quiet(path)
    (folder / "run.notes.json").write_text('{"title": "Brisk", "notes": ""}', "utf-8")
    ask("/run", status=204, method="DELETE")
    assert list(folder.iterdir()) == []
    ask("/run", status=404)


def test_an_export_holds_its_turn_until_its_reader_goes_away(folder):
    folder.mkdir()
    path = write_run(folder / "run.mcap")

    async def hold():
        turns = asyncio.Semaphore(1)
        export = _converted(path, turns)
        await anext(export)
        held = turns.locked()
        await export.aclose()
        return held, turns.locked()

    assert asyncio.run(hold()) == (True, False)


def test_a_part_becomes_a_recording_of_its_own(ask, client, folder):
    write_run(folder / "drive.mcap")
    for name in ("drive-2-4s", "drive-2-4s-2"):
        row = ask("/drive/parts", 202, "POST", json={"from_s": 2.0, "to_s": 4.0})
        assert row["what"] == "2 to 4 s of drive"
        wait_for(lambda at=row["id"]: over(client, at), 120.0, "it is cut", every_s=0.2)
        assert over(client, row["id"])["result"] == f"/recordings/{name}"
        part = ask(f"/{name}")
        assert (part["state"], part["length_s"], part["cars"]) == ("complete", 2.0, ["n1", "n10"])
    assert sorted(path.name for path in folder.iterdir()) == [
        "drive-2-4s-2.mcap", "drive-2-4s.mcap", "drive.mcap",
    ]  # fmt: skip


def over(client, operation):
    row = client("GET", f"/api/v1/operations/{operation}").json()
    assert row["state"] != "failed", row["error"]
    return row if row["state"] == "done" else None


@pytest.mark.parametrize("span", [{"from_s": 5.0}, {"from_s": 3.0, "to_s": 3.0}, {"from_s": 90}])
def test_a_part_outside_the_recording_is_refused(ask, folder, span):
    write_run(folder / "drive.mcap")
    refused = ask("/drive/parts", 422, "POST", json=span)
    assert "expected a part of the 5.0 s of drive" in refused["detail"]


def test_a_recording_says_what_made_its_measurements_void(ask, folder):
    write_run(folder / "calm.mcap")
    assert ask("/calm/disturbances") == {"disturbances": [], "void": []}
    write_run(folder / "flashed.mcap", flash_s=(1.0, 3.0))
    found = ask("/flashed/disturbances")
    (one,) = found["disturbances"]
    assert (one["kind"], one["source"], one["start_s"], one["end_s"]) == ("flash", "crossing", 1, 3)
    assert found["void"] == ["the signals of crossing flash for 2.0 of 5.0 s"]
