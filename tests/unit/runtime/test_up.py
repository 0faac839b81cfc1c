"""`scm up` refuses what cannot work before it starts anything."""

import socket
from pathlib import Path

import pytest

from scm.__main__ import parse
from scm.commands.up import options_of
from scm.disturbances import OPTIONAL_PARTS
from scm.errors import MapError, RunError, ScmError
from scm.records.disturbances import Disturbance
from scm.runtime.up import OPTIONAL, CityOptions, _parts, _plan_of, _report_disturbance, run_city
from scm.v2x.router import Router, free_endpoint


@pytest.fixture
def start(tmp_path):
    said = []

    def start(map_name="driving_school", **facts):
        facts = {"port": 0, "listen": "tcp/127.0.0.1:0", **facts}
        try:
            wanted = CityOptions(map_name=map_name, record_dir=tmp_path / "runs", **facts)
            run_city(wanted, said.append)
        finally:
            assert said == []

    return start


def test_an_unknown_map_is_refused_with_the_nearest_name(start):
    with pytest.raises(MapError, match="driving_school"):
        start("driving_shool")


def test_a_taken_dashboard_port_is_refused_with_its_number(start):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(RunError, match=f"dashboard port {port}: .*expected a free one"):
            start(port=port)


def test_a_taken_endpoint_is_refused(start):
    with Router(free_endpoint()) as other, pytest.raises(RunError, match="another city"):
        start(listen=other.listen)


def test_a_dashboard_for_others_needs_keys(start):
    with pytest.raises(RunError, match="without API keys"):
        start(host="0.0.0.0")


def test_a_wrong_radio_is_refused_by_its_key(start):
    with pytest.raises(MapError, match=r"lost.*loss"):
        start(radio=("lost=0.3",))


def test_the_radio_goes_to_the_world_and_to_no_other_part(tmp_path):
    wanted = CityOptions(
        map_name="driving_school", port=0, listen="tcp/127.0.0.1:0", record_dir=tmp_path,
        radio=("loss=0.3", "delay_ms=50"),
    )  # fmt: skip
    told = {job.name: job.command() for job in _parts(_plan_of(wanted))}
    assert told["world"][-6:-2] == ["--radio", "loss=0.3", "--radio", "delay_ms=50"]
    assert [name for name, command in told.items() if "--radio" in command] == ["world"]


def test_a_scanned_map_is_introduced_by_the_room_that_was_read(tmp_path):
    (tmp_path / "a.pgm").write_bytes(b"P2 3 3 255\n0 0 0 0 254 0 0 0 0\n")
    scan = tmp_path / "a.yaml"
    scan.write_text(
        "image: a.pgm\nresolution: 1.0\norigin: [-1.5, -1.5, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.25\n",
        encoding="utf-8",
    )
    wanted = CityOptions(
        map_name=str(scan), hosted=1, port=0, listen="tcp/127.0.0.1:0", record_dir=tmp_path
    )
    assert "the room is the one that holds the origin, 1 m²" in _plan_of(wanted).scan


def test_the_recorder_is_told_of_which_cars_it_keeps_pictures(tmp_path):
    words = ["up", "--port", "0", "--listen", "tcp/127.0.0.1:0", "--record-dir", str(tmp_path)]
    words += ["--cameras-hz", "2", "--cameras-of", "n1", "--cameras-of", "n3"]
    wanted = options_of(parse(words))
    (record,) = (job for job in _parts(_plan_of(wanted)) if job.name == "record")
    given = parse(record.command()[3:])
    assert (given.cameras_hz, given.cameras_of) == (2.0, ["n1", "n3"])
    assert (CityOptions(map_name="x").cameras_hz, CityOptions(map_name="x").cameras_of) == (0.0, ())


def test_parts_may_be_left_out_and_the_server_knows_which_should_be_there(tmp_path):
    words = ["up", "--port", "0", "--listen", "tcp/127.0.0.1:0", "--record-dir", str(tmp_path)]
    jobs = _parts(_plan_of(options_of(parse([*words, "--without", "eye", "--without", "record"]))))
    there = ["traffic", "monitor", "world", "camera", "observer", "misbehaviour"]
    assert [job.name for job in jobs] == [*there, "api"]
    assert parse(jobs[-1].command()[3:]).expects == there
    whole = {job.name for job in _parts(_plan_of(options_of(parse(words))))}
    assert whole >= {"eye", "record"}
    assert set(OPTIONAL) >= set(OPTIONAL_PARTS)


def test_the_parking_manager_starts_where_the_map_has_bays(tmp_path):
    words = ["--port", "0", "--listen", "tcp/127.0.0.1:0", "--record-dir", str(tmp_path)]
    for name, has_bays in (("parking_lot", True), ("parking_school", False)):
        jobs = _parts(_plan_of(options_of(parse(["up", name, "--hosted", "0", *words]))))
        assert ("parking" in [job.name for job in jobs]) is has_bays


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ({"without": ("recorder",)}, "without: got 'recorder', .*did you mean 'record'"),
        ({"without": ("monitor",)}, "without: got 'monitor', .*every other part is needed"),
        ({"without": ("record",), "cameras_hz": 1.0}, "without: got record with --cameras-hz"),
        ({"hosted": -1}, "hosted: got -1"),
        ({"hosted": 11}, "hosted: got 11 cars, expected 0 to 10: so many places has map"),
        ({"cameras_hz": float("nan")}, "cameras_hz: got nan"),
        ({"cameras_of": ("n1",)}, "cameras_hz: got 0.0, .* with --cameras-of"),
        ({"cameras_hz": 1.0, "cameras_of": ("n1/*",)}, "cameras_of: got 'n1/"),
        ({"agents": -1}, "agents: got -1"),
        ({"port": 70000}, "no such port"),
        ({"state": "nonsense"}, "expected sqlite:PATH"),
        ({"keys": "sqlite:/no/such/keys.db"}, "cannot open"),
        ({"demand": Path("no_such.csv")}, "no_such.csv: cannot be read"),
    ],
)
def test_what_a_part_would_refuse_is_refused_at_once(start, facts, said):
    with pytest.raises(ScmError, match=said):
        start(**facts)


def test_a_file_is_no_folder_for_recordings(start, tmp_path):
    (tmp_path / "runs").write_text("")
    with pytest.raises(RunError, match="expected a folder"):
        start()


def test_what_to_do_for_a_slow_computer_is_said_once():
    said, advised = [], set()
    late = Disturbance(
        kind="late", source="world", start_ns=0, text="it is slow", advice="Do that."
    )
    for _ in range(2):
        _report_disturbance(late, said.append, advised)
    assert [line.split()[0] for line in said] == ["warning", "do", "warning"]
    assert said[1].endswith("Do that.")
