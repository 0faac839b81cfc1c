"""UPER of everything a city says: read back equal, and bit for bit what another codec makes."""

import sys

import msgspec
import pytest
from msgspec.structs import replace

from scm.errors import MessageError
from scm.v2x.etsi.mapem import MapemBody
from scm.v2x.uper import codec
from tests.unit.v2x.asn1_text import for_asn1tools, module_of
from tests.unit.v2x.etsi_city import city_messages, everything

asn1tools = pytest.importorskip("asn1tools", reason="asn1tools is the second codec: extra dev")
pytest.importorskip("pycrate_asn1dir", reason="UPER needs the extra v2x")

every_kind = pytest.mark.parametrize("kind", codec.CODINGS)


@pytest.fixture(scope="module")
def peer():
    """Return asn1tools' codec of each kind of message."""
    return {
        kind: asn1tools.compile_string(module_of(coding.pdu, codec.pdu_of(kind)), "uper")
        for kind, coding in codec.CODINGS.items()
    }


@every_kind
def test_what_is_coded_is_read_back_equal(kind):
    for said in city_messages()[kind]:
        assert codec.decode(kind, codec.encode(said.body)) == said.body


@every_kind
def test_the_bytes_are_those_of_asn1tools_both_ways(kind, peer):
    """Prove that two codecs, written by different people, agree on every bit.

    The ASN.1 that asn1tools compiles is written from pycrate's compiled types. So this proves the
    packing and our values' fit to the types; it cannot find an error in pycrate's copy of the
    standards' ASN.1. Wireshark's own copy does that, in the tests of the export.
    """
    coding = codec.CODINGS[kind]
    for said in city_messages()[kind]:
        value = for_asn1tools(coding.to_asn(said.body))
        ours = codec.encode(said.body)
        assert peer[kind].encode(coding.pdu, value) == ours
        read = peer[kind].decode(coding.pdu, ours)
        assert contains(read, value)
        assert peer[kind].encode(coding.pdu, read) == ours


def contains(read, value):
    """Return whether one has everything that the other has; the first may hold defaults more."""
    if isinstance(value, dict):
        return all(name in read and contains(read[name], part) for name, part in value.items())
    if isinstance(value, list):
        return len(read) == len(value) and all(map(contains, read, value))
    if isinstance(value, tuple) and isinstance(value[0], str):
        return read[0] == value[0] and contains(read[1], value[1])
    return read == value


def test_a_cam_with_its_slow_container_is_longer_and_whole():
    cams = [said.body for said in city_messages()["cam"]]
    slow = next(cam for cam in cams if cam.slow is not None and cam.slow.path_history)
    quick = replace(slow, low_frequency_container=None)
    assert len(codec.encode(slow)) > len(codec.encode(quick))
    assert codec.decode("cam", codec.encode(slow)).slow == slow.slow


def test_a_node_takes_as_few_bits_as_its_offset_needs():
    (mapem,) = codec.CODINGS["mapem"].to_asn(city_messages()["mapem"][0].body)["map"][
        "intersections"
    ]
    nodes = [node["delta"] for lane in mapem["laneSet"] for node in lane["nodeList"][1]]
    limits = {
        f"node-XY{n}": 2**bits for n, bits in zip(range(1, 7), (9, 10, 11, 12, 13, 15), strict=True)
    }
    for size, offset in nodes:
        smaller = f"node-XY{int(size[-1]) - 1}"
        far = max(abs(offset["x"]), abs(offset["y"]))
        assert far <= limits[size]
        assert smaller not in limits or far >= limits[smaller]


def test_a_spatem_has_likely_ends_and_their_confidence():
    timings = [
        codec.CODINGS["spatem"].to_asn(said.body)["spat"]["intersections"][0]["states"][0][
            "state-time-speed"
        ][0]["timing"]
        for said in city_messages()["spatem"]
    ]
    assert any(t.get("likelyTime") == t["minEndTime"] and t["confidence"] == 15 for t in timings)


def test_a_lane_that_is_none_for_vehicles_is_read_as_such_and_never_written():
    coding, body = codec.CODINGS["mapem"], city_messages()["mapem"][0].body
    value = coding.to_asn(body)
    value["map"]["intersections"][0]["laneSet"][0]["laneAttributes"]["laneType"] = (
        "crosswalk",
        (0, 16),
    )
    read = msgspec.convert(coding.of_asn(value), MapemBody)
    first, second = read.intersections[0].lane_set[:2]
    assert first.lane_attributes.lane_type.vehicle is None
    assert second.lane_attributes.lane_type.vehicle == ()
    with pytest.raises(MessageError, match="none for vehicles, which is not written here"):
        coding.to_asn(read)


def test_a_cpm_has_no_uper_and_the_error_states_it():
    with pytest.raises(MessageError, match="cpm: expected one of cam, denm, spatem"):
        codec.encode(city_messages()["cpm"][0].body)


def test_what_the_type_does_not_allow_is_refused():
    cam = city_messages()["cam"][0].body
    wrong = replace(cam, generation_delta_time=70_000)
    with pytest.raises(MessageError, match=r"cam: cannot be coded.*generationDeltaTime"):
        codec.encode(wrong)


@every_kind
def test_bytes_that_are_no_message_are_refused_and_the_next_one_is_read(kind):
    body = city_messages()[kind][0].body
    good = codec.encode(body)
    for bad in (b"", b"\xff" * 12, good[: len(good) // 2]):
        with pytest.raises(MessageError, match=kind):
            codec.decode(kind, bad)
    assert codec.decode(kind, good) == body


def test_another_kinds_bytes_are_refused_by_their_header():
    with pytest.raises(MessageError, match="ssem: expected messageID 10, got 09"):
        codec.decode("ssem", codec.encode(city_messages()["srem"][0].body))


def test_without_the_extra_the_error_names_it(monkeypatch):
    codec._compiled.cache_clear()
    monkeypatch.setitem(sys.modules, "pycrate_asn1dir.ITS_CAM_2", None)
    try:
        with pytest.raises(MessageError, match=r"pip install 'scm\[v2x\]'"):
            codec.encode(city_messages()["cam"][0].body)
    finally:
        codec._compiled.cache_clear()


def test_all_message_types_occur_in_the_city():
    assert {kind for kind, _ in everything()} == {*codec.CODINGS, "cpm"}
