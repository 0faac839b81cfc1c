"""No code of an ETSI field, "unavailable" or "out of range", ever becomes a number.

The table is the definitions themselves. It is held against the named values of ASN.1, and each of
its codes is put through every reader.
"""

import random
import runpy
from dataclasses import replace
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
import pytest

from scm.clock import NS_PER_S
from scm.eye.track.perception import collective_perception
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.signals import SignalGroup
from scm.traffic.misbehaviour.claim import claim_of
from scm.traffic.misbehaviour.limits import Limits
from scm.traffic.signals.detectors import Sightings
from scm.v2x.etsi.cam_spatem import CamBody
from scm.v2x.etsi.codes import codes_in
from scm.v2x.etsi.convert import cam_of, colours_of, place_of, read_cam, spatem_of, station_id
from scm.v2x.etsi.denm import DenmBody
from scm.v2x.etsi.events import DenmSender, stationary
from scm.v2x.etsi.json_form import KINDS
from scm.v2x.etsi.mapem import MapemBody
from scm.v2x.etsi.parts import Altitude
from scm.v2x.etsi.path import LowFrequencySender
from scm.v2x.etsi.priority_requests import (
    PriorityAnswer,
    PriorityRequest,
    answers_of,
    requests_of,
    srem_of,
    ssem_of,
)
from scm.v2x.etsi.topology import mapem_of
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.spat import Spat
from scm.v2x.pcap import Positions
from scm.v2x.uper import cam, codec, denm, mapem, spatem, srem, ssem
from scm.v2x.uper.parts import Chosen, Each, Fields, Names, Only
from scm.vehicles.car import load_car
from scm.vehicles.drivers.channel import ideal
from scm.vehicles.drivers.green_advisor import GreenAdvisor
from scm.vehicles.drivers.hazards import HazardTable
from scm.vehicles.drivers.limits import limits_of
from tests.unit.v2x.etsi_city import a_track
from tests.unit.v2x.test_etsi_convert import NOW, a_state

MAP = load_map("driving_school")
ROADS = Roads(MAP)
JUNCTION = MAP.junctions[0]
TABLE = {kind: dict(codes_in(message.body)) for kind, message in KINDS.items()}
MAPPINGS = {
    "cam": (("cam", "camParameters"), cam._PARAMETERS),
    "denm": (("denm",), denm._CONTAINERS),
    "spatem": (("spat",), spatem._SPAT),
    "mapem": (("map",), mapem._MAP),
    "srem": (("srm",), srem._SRM),
    "ssem": (("ssm",), ssem._SSM),
}
NO_VALUE = {"unavailable", "unknown", "none-unknown", "requestImportanceLevelUnKnown"}
READ = {
    "cam": 9,
    "denm": 2,
    "mapem": 4,
    "spatem": 6,
    "srem": 5,
    "ssem": 0,
}
"""How many fields of a message with codes come out of a reader as numbers."""


@pytest.mark.parametrize("kind", KINDS)
def test_every_integer_is_declared_with_its_codes(kind):
    assert [path for path, codes in TABLE[kind].items() if codes is None] == []


def named_values(inner, asn, path):
    """Yield (path of the record, number, name) of what ASN.1 names within a type."""
    if isinstance(inner, Chosen):
        yield from named_values(inner.inner, asn._cont[inner.name], path)
    elif isinstance(inner, Each):
        yield from named_values(inner.inner, asn._cont, f"{path}[]")
    elif isinstance(inner, Only):
        yield from named_values(inner.inner, asn, f"{path}.{inner.name}")
    elif isinstance(inner, Fields):
        for name, asn_name, part in inner._rows:
            yield from named_values(part, asn._cont[asn_name], f"{path}.{name}")
    elif isinstance(inner, Names):
        yield from ((path, number, name) for number, name in enumerate(inner.names))
    elif asn.TYPE == "INTEGER":
        yield from ((path, number, name) for name, number in (asn._cont or {}).items())


@pytest.mark.parametrize("kind", MAPPINGS)
def test_the_table_has_what_asn1_names(kind):
    """A field of ASN.1 that the records gain fails here until its codes are declared."""
    way, fields = MAPPINGS[kind]
    asn = codec.pdu_of(kind)
    for name in way:
        asn = asn._cont[name]
    found = 0
    for path, number, name in named_values(fields, asn, ""):
        codes = TABLE[kind].get(path.lstrip("."))
        if codes is not None and name in NO_VALUE:
            assert number in codes.unavailable, path
        elif codes is not None and name == "outOfRange":
            assert number in codes.out_of_range, path
        found += codes is not None and name in NO_VALUE
    assert found >= {"cam": 18, "denm": 14, "srem": 5}.get(kind, 1)


def test_the_page_shows_the_table():
    made = runpy.run_path(str(Path(__file__).parents[3] / "docs" / "make" / "etsi_codes.py"))
    assert made["PAGE"].read_text(encoding="utf-8") == made["page"]()


@cache
def bodies():
    state = a_state(x_m=1.0, y_m=0.5)
    news = LowFrequencySender()
    news.due(a_state(t_ns=NOW - NS_PER_S), 0.2)
    groups = tuple(
        SignalGroup(
            group=group.name, colour="red", since_ns=NOW, min_end_ns=NOW + NS_PER_S,
            max_end_ns=NOW + 3 * NS_PER_S, likely_end_ns=NOW + 2 * NS_PER_S, likely_confidence=0.8,
        )
        for group in JUNCTION.groups
    )  # fmt: skip
    spat = Spat(
        junction=JUNCTION.name, t_ns=NOW, seq=0, mode="plan", plan="calm", groups=groups,
        revision=MAP.revision,
    )  # fmt: skip
    wish = PriorityRequest(
        station_id=station_id("n1"), number=1, junction=JUNCTION.number, lane_in=2, lane_out=4,
        arrives_ns=NOW + NS_PER_S, lasts_s=3.0,
    )  # fmt: skip
    sender = DenmSender("n1")
    sender.trigger(stationary(state), NOW)
    slow = news.due(state, 0.2)
    return {
        "cam": cam_of(state, length_m=0.3, width_m=0.18, front_m=0.2, low_frequency=slow),
        "denm": sender.due(NOW)[0],
        "cpm": collective_perception([a_track(NOW)], "rsu-crossing", NOW).body,
        "spatem": spatem_of(spat, JUNCTION),
        "mapem": mapem_of(ROADS, JUNCTION),
        "srem": srem_of(wish, state),
        "ssem": ssem_of(JUNCTION, [PriorityAnswer(wish, "granted")], 0, NOW),
    }


SAMPLES = {
    "path_history": [{"path_position": {"delta_latitude": 1, "delta_longitude": 1}}],
    "path": [{"path_position": {"delta_latitude": 1, "delta_longitude": 1}}],
    "linked_cause": {"cause": 94},
    "timing": {"min_end_time": 1},
    "location_container": {"detection_zones_to_event_position": [{}]},
    "outbound_lane": {},
    "outbound_on": {},
    "requester": {"id": 1, "request": 1, "sequence_number": 1},
}
"""Records that a message may leave out."""


def with_value(kind, path, value):
    """Return a message with one of its fields set; the first of each list."""
    record = msgspec.to_builtins(bodies()[kind])
    holder, names = record, path.split(".")
    for name in names[:-1]:
        plain = name.removesuffix("[]")
        holder[plain] = holder.get(plain) or SAMPLES[plain]
        holder = holder[plain][0] if name.endswith("[]") else holder[plain]
    holder[names[-1]] = value
    return msgspec.convert(record, KINDS[kind].body)


def numbers_in(value, path=""):
    """Return path to number of all numbers in what a reader returned."""
    if isinstance(value, msgspec.Struct | dict):
        fields = value if isinstance(value, dict) else msgspec.structs.asdict(value)
        parts = fields.items()
    elif hasattr(value, "__dataclass_fields__"):
        parts = [(name, getattr(value, name)) for name in value.__dataclass_fields__]
    elif isinstance(value, tuple | list):
        names = getattr(value, "_fields", range(len(value)))
        parts = zip(names, value, strict=True)
    else:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return {path: value} if is_number and value == value else {}
    return {k: v for name, one in parts for k, v in numbers_in(one, f"{path}.{name}").items()}


def read(kind, body):
    """Return all numbers that the readers of the product make of a message."""
    if kind == "cam":
        claim = claim_of("n1", "rsu", NOW, body, Limits())
        if claim is not None:  # how sure it is has a stated default
            claim = msgspec.structs.asdict(claim)
            claim = {k: v for k, v in claim.items() if k != "body" and not k.startswith("own_")}
        seen = Sightings().of_cam(CamRx(receiver="rsu", station="n1", t_ns=NOW, body=body))
        seen = None if seen is None else seen._replace(length_m=None)  # likewise
        place = Positions().of(body)[2:4]
        return numbers_in([read_cam(body), claim or (), seen, place if any(place) else ()])
    if kind == "denm":
        warnings = HazardTable(ideal())
        warnings.receive(body, NOW)
        return numbers_in(warnings.hazards.at[warnings.hazards.ends_ns > 0].tolist())
    if kind == "mapem":
        return numbers_in(advice(body, bodies()["spatem"]))
    if kind == "spatem":
        decoded = advice(bodies()["mapem"], body)
        # who knows no end of a red is advised the limit
        return numbers_in([colours_of(body), decoded and decoded._replace(speed_mps=None)])
    if kind == "srem":
        return numbers_in(list(requests_of(body, NOW)))
    return numbers_in(answers_of(body, station_id("n1")))


def advice(mapem_body, spatem_body):
    advisor = GreenAdvisor(limits_of(load_car("nigel")))
    advisor.receive_mapem(mapem_body)
    advisor.receive_spatem(spatem_body, NOW)
    line = ROADS.stop_lines_of(JUNCTION.name, JUNCTION.groups[0].name)[0]
    pose = ROADS.lane(line.lane).at(line.at_m - 0.6)
    return advisor.advise(Pose2(pose.x, pose.y, pose.yaw), NOW)


def ordinary(rng, kind, path):
    """Return a message whose field holds some number that is no code."""
    codes = TABLE[kind][path]
    for size in (2**29, 40_000, 1000, 100, 10, 2, 2, 2, 2, 2, 2):
        value = rng.randrange(size)
        if value in codes.unavailable or value in codes.out_of_range:
            continue
        try:
            return with_value(kind, path, value)
        except msgspec.ValidationError:
            continue
    raise AssertionError(f"{kind}: no number was found for {path}")


@pytest.mark.parametrize("kind", READ)
def test_what_depends_on_a_field_is_no_number_where_the_field_holds_a_code(kind):
    """What changes with a field's numbers must be absent, or None, when the field has none."""
    rng, read_fields = random.Random(kind), 0
    for path, codes in TABLE[kind].items():
        if not (codes.unavailable or codes.out_of_range):
            continue
        one, others = (
            read(kind, bodies()[kind]),
            [read(kind, ordinary(rng, kind, path)) for _ in range(3)],
        )
        depends = {k for other in others for k in {*one, *other} if one.get(k) != other.get(k)}
        read_fields += bool(depends)
        for code in {*codes.unavailable[:1], *codes.unavailable[-1:], *codes.out_of_range}:
            found = read(kind, with_value(kind, path, code))
            assert depends.isdisjoint(found), (path, code, {k: found.get(k) for k in depends})
    assert read_fields >= READ[kind]


@pytest.mark.parametrize("code", [(900_000_001, 5), (5, 1_800_000_001)])
def test_half_a_place_is_no_place(code):
    assert place_of(*code) is None


def test_a_cam_without_size_and_position_has_none():
    body = with_value("cam", f"{FAST}.vehicle_length.value", 1023)
    assert read_cam(body).length_m is None
    assert read_cam(with_value("cam", f"{FAST}.vehicle_width", 62)).width_m is None
    view = read_cam(with_value("cam", "basic_container.reference_position.latitude", 900_000_001))
    assert (view.x_m, view.y_m, view.place) == (None, None, None)


FAST = "high_frequency_container.basic_vehicle_container_high_frequency"


def test_a_sender_uses_the_standards_code_for_out_of_range():
    state = a_state(speed_mps=20.0, yaw_rate_radps=-9.0, accel_mps2=-3.0)
    decoded = cam_of(state, length_m=9.0, width_m=2.0, front_m=0.2).motion
    assert (decoded.vehicle_length.value, decoded.vehicle_width) == (1022, 61)
    assert (decoded.speed.value, decoded.yaw_rate.value) == (16_382, -32_766)
    assert decoded.longitudinal_acceleration.value == -160
    view = read_cam(cam_of(state, length_m=9.0, width_m=2.0, front_m=0.2))
    assert view[4:] == (None, None, None, None)
    far = cam_of(a_state(y_m=1e6), length_m=0.3, width_m=0.2, front_m=0.2)
    assert (far.position.latitude, far.position.longitude) == (900_000_001, 1_800_000_001)


def test_a_perceived_car_beyond_the_fields_is_out_of_range_on_its_own_side():
    track = replace(a_track(NOW), x_m=-1e3, speed_mps=-99.0, yaw_rad=0.0)
    (seen,) = collective_perception([track], "rsu", NOW).body.perceived_object_container
    assert seen.position.x_coordinate.value == -131_072
    assert seen.velocity.cartesian_velocity.x_velocity.value == -16_383


def test_a_speed_limit_beyond_the_field_stays_a_limit():
    lanes = tuple(msgspec.structs.replace(one, speed_limit_mps=50.0) for one in MAP.lanes)
    body = mapem_of(Roads(msgspec.structs.replace(MAP, lanes=lanes)), JUNCTION)
    assert body.intersections[0].speed_limits[0].speed == 8190


@pytest.mark.parametrize("kind", [CamBody, DenmBody, MapemBody])
def test_a_listing_of_codes_includes_lists_and_optional_fields(kind):
    assert any("[]" in path for path, _ in codes_in(kind))
    assert dict(codes_in(Altitude))["value"].out_of_range == (-100_000, 800_000)
    assert np.all([codes is not None for _, codes in codes_in(kind)])
