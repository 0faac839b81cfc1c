"""A recorded run as a capture and as JSON lines, read by Wireshark's own decoder."""

import shutil
import struct
import subprocess
from itertools import pairwise

import pytest

from scm.__main__ import main
from scm.clock import NS_PER_MS
from scm.errors import RecordingError
from scm.recorder.mcap_file import RunFile, read_run
from scm.recorder.on_air import OnAir, write_pcap
from scm.v2x.etsi.json_form import unwrap
from scm.v2x.exchange import RawSample
from scm.v2x.pcap import PORTS
from scm.v2x.uper import codec
from tests.unit.v2x.etsi_city import city_messages, everything, record_city

LATE_NS = 2 * NS_PER_MS
needs_tshark = pytest.mark.skipif(
    shutil.which("tshark") is None, reason="tshark is not installed: Wireshark's decoder"
)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    pytest.importorskip("pycrate_asn1dir", reason="UPER needs the extra v2x")
    return record_city(tmp_path_factory.mktemp("run") / "run.mcap", LATE_NS)


@pytest.fixture(scope="module")
def capture(run):
    path = run.with_suffix(".pcap")
    assert main(["v2x", "export", str(run), "--pcap", str(path)]) == 0
    return path


def decoded(capture, kind, *fields):
    """Return what tshark reads of each message of a kind: its fields as lists of text."""
    command = ["tshark", "-r", str(capture), "-Y", f"btpb.dstport == {PORTS[kind]}", "-T", "fields"]
    for field in fields:
        command += ["-e", field]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return [tuple(cell.split(",") for cell in line.split("\t")) for line in lines]


def place(cam):
    return cam.position.latitude, cam.position.longitude


def said(kind):
    return sorted(city_messages()[kind], key=lambda one: one.t_ns)


@needs_tshark
def test_wireshark_reads_who_drives_how_fast_and_where_to(capture):
    fields = (
        "its.stationID",
        "its.speedValue",
        "its.headingValue",
        "its.latitude",
        "its.longitude",
    )
    cams = [one.body for one in said("cam")]
    wanted = {
        tuple(map(str, (b.station_id, b.motion.speed.value, b.motion.heading.value, *place(b))))
        for b in cams
    }
    read = [tuple(cell[0] for cell in row) for row in decoded(capture, "cam", *fields)]
    assert len(read) == len(cams)
    assert set(read) == wanted
    assert max(int(row[1]) for row in read) > 300, "the cars of the sample drive"


@needs_tshark
def test_wireshark_reads_phases_and_when_they_end(capture):
    fields = ("dsrc.signalGroup", "dsrc.eventState", "dsrc.minEndTime", "dsrc.maxEndTime")
    wanted = [
        (
            [str(s.signal_group) for s in one.body.states],
            [str(s.state_time_speed[0].event_state) for s in one.body.states],
            [str(s.min_end_time) for s in one.body.states],
            [str(s.max_end_time) for s in one.body.states],
        )
        for one in said("spatem")
    ]
    assert decoded(capture, "spatem", *fields) == wanted
    assert {state for row in wanted for state in row[1]} >= {"2", "3", "6"}


@needs_tshark
def test_wireshark_reads_lanes_and_their_groups(capture):
    ((numbers, groups, revision, width),) = decoded(
        capture, "mapem", "dsrc.laneID", "dsrc.signalGroup", "dsrc.revision", "dsrc.laneWidth"
    )
    (junction,) = city_messages()["mapem"][0].body.intersections
    assert numbers == [str(lane.lane_id) for lane in junction.lane_set]
    assert groups == [
        str(way.signal_group) for x in junction.lane_set for way in x.connects_to or ()
    ]
    assert (revision, width) == ([str(junction.revision)], [str(junction.lane_width)])


@needs_tshark
def test_wireshark_reads_warnings_requests_and_answers(capture):
    denms = decoded(capture, "denm", "its.originatingStationID", "its.sequenceNumber")
    actions = [one.body.management_container.action_id for one in said("denm")]
    wanted = [([str(a.originating_station_id)], [str(a.sequence_number)]) for a in actions]
    assert sorted(denms) == sorted(wanted)
    wishes = [one.body.requests[0].request for one in said("srem")]
    assert decoded(capture, "srem", "dsrc.requestID", "dsrc.requestType") == [
        ([str(wish.request_id)], [str(wish.request_type)]) for wish in wishes
    ]
    ((statuses,),) = decoded(capture, "ssem", "dsrc.signalStatusPackage.status")
    packages = city_messages()["ssem"][0].body.status[0].sig_status
    assert statuses == [str(package.status) for package in packages]


@needs_tshark
def test_wireshark_finds_nothing_malformed(capture):
    command = ["tshark", "-r", str(capture), "-Y", "_ws.malformed || !btpb"]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    assert found.stdout == ""


def test_the_capture_has_the_times_at_which_the_recorder_received(capture):
    data = capture.read_bytes()
    assert struct.unpack_from("<I", data)[0] == 0xA1B23C4D
    times, at = [], 24
    while at < len(data):
        seconds, ns, length, _ = struct.unpack_from("<IIII", data, at)
        times.append(seconds * 1_000_000_000 + ns)
        assert data[at + 16 + 12 : at + 16 + 14] == b"\x89\x47"
        at += 16 + length
    wanted = sorted(one.t_ns + LATE_NS for kind, one in everything() if kind in codec.CODINGS)
    assert times == wanted
    assert all(a <= b for a, b in pairwise(times))


def test_json_lines_are_all_messages_cpm_too(run, tmp_path, capsys):
    path = tmp_path / "said.jsonl"
    assert main(["v2x", "export", str(run), "--json", str(path)]) == 0
    read = [unwrap(line) for line in path.read_bytes().splitlines()]
    wanted = sorted((one for _, one in everything()), key=lambda one: one.t_ns)
    assert [envelope.timestamp_ms for envelope in read] == [one.t_ns // NS_PER_MS for one in wanted]
    assert [envelope.body for envelope in read] == [one.body for one in wanted]
    assert "2 CPM" in capsys.readouterr().out


def test_neither_form_is_bad_input(run, capsys):
    assert main(["v2x", "export", str(run)]) == 2
    assert "expected --pcap FILE, --json FILE or both" in capsys.readouterr().err


def test_a_run_without_messages_is_refused(tmp_path):
    with RunFile(tmp_path / "mute.mcap", "city") as mute:
        mute.write(RawSample("scm/@v1/city/world/snapshot", b"{}", None, 1))
    with pytest.raises(RecordingError, match="expected messages under v2x/tx/"):
        OnAir(tmp_path / "mute.mcap")


def test_messages_of_an_older_form_are_counted_and_left_out(tmp_path):
    path = record_city(tmp_path / "run.mcap")
    with RunFile(tmp_path / "old.mcap", "city") as old:
        old.write(RawSample("scm/@v1/city/v2x/tx/n1/cam", b'{"body":{"heading":1}}', None, 1))
        for one in read_run(path):
            old.write(RawSample(one.key, one.body, None, one.t_ns))
    air = OnAir(tmp_path / "old.mcap")
    with (tmp_path / "old.pcap").open("wb") as stream:
        count = write_pcap(air, stream)
    assert air.unreadable == 1
    assert count == sum(kind in codec.CODINGS for kind, _ in everything())
