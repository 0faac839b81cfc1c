"""Everything a city says keeps to its-client's JSON schemas, and its envelopes are read back."""

import json
import os
from pathlib import Path

import jsonschema_rs
import pytest

from scm.errors import MessageError
from scm.v2x.etsi.json_form import KINDS, unwrap, wrap
from tests.unit.v2x.etsi_city import city_messages
from tests.unit.v2x.etsi_facts import FACTS, schema_of

SCHEMAS = os.environ.get("SCM_ITS_SCHEMAS")
every_kind = pytest.mark.parametrize("kind", KINDS)


def envelopes(kind):
    return [json.loads(wrap(one.body, one.station, one.t_ns)) for one in city_messages()[kind]]


@every_kind
def test_every_field_is_one_of_the_table_in_its_range(kind):
    validator = jsonschema_rs.validator_for(schema_of(FACTS[kind]))
    for envelope in envelopes(kind):
        validator.validate(envelope["message"])


@every_kind
def test_the_records_refuse_what_the_table_refuses(kind):
    """Each integer in turn is put beyond its range: table and reader must both say no."""
    validator = jsonschema_rs.validator_for(schema_of(FACTS[kind]))
    envelope = envelopes(kind)[-1]
    for holder, name in leaves(envelope["message"]):
        before = holder[name]
        holder[name] = 2**45
        assert not validator.is_valid(envelope["message"]), name
        with pytest.raises(MessageError, match="Expected `int`"):
            unwrap(json.dumps(envelope).encode())
        holder[name] = before


def leaves(record):
    """Yield (holder, name) of every integer inside."""
    items = record.items() if isinstance(record, dict) else enumerate(record)
    for name, value in list(items):
        if isinstance(value, dict | list):
            yield from leaves(value)
        elif type(value) is int:
            yield record, name


@every_kind
@pytest.mark.skipif(SCHEMAS is None, reason="SCM_ITS_SCHEMAS names no folder of their schemas")
def test_every_envelope_is_valid_by_their_own_schema(kind):
    name = f"{kind}_schema_{KINDS[kind].version.replace('.', '-')}.json"
    schema = read_schema(name)
    # A stored schema may be of the days before its release: then its version ends in -dev.
    schema["properties"]["version"] = {"enum": [KINDS[kind].version]}
    validator = jsonschema_rs.validator_for(schema, retriever=read_schema)
    for envelope in envelopes(kind):
        validator.validate(envelope)


def read_schema(uri):
    """Return a schema by the end of its address, wherever it lies in the folder.

    SREM and SSEM still name the first edition of the shared definitions; the second has the same.
    """
    name = uri.rpartition("/")[2].replace("dsrc_schema_1-0-0", "dsrc_schema_2-0-0")
    (path,) = Path(SCHEMAS).rglob(name)
    return json.loads(path.read_text())


@every_kind
def test_an_envelope_is_read_back(kind):
    for one in city_messages()[kind]:
        read = unwrap(wrap(one.body, one.station, one.t_ns))
        assert read == (f"scm_{one.station}", one.t_ns // 1_000_000, one.body)


def test_a_cpm_of_which_only_places_are_known_is_read_and_a_person_is_no_car():
    whole = (one for one in envelopes("cpm") if "perceived_object_container" in one["message"])
    envelope = next(whole)
    seen, *_ = envelope["message"]["perceived_object_container"]
    del envelope["message"]["perceived_object_container"][1:]
    least = {name: seen[name] for name in ("measurement_delta_time", "position")}
    person = {"object_class": {"vru": {"pedestrian": 1}}, "confidence": 90}
    speed = {"polar_velocity": {}}
    seen.clear()
    seen.update(least, velocity=speed, classification=[person])
    (read,) = unwrap(json.dumps(envelope).encode()).body.perceived_object_container
    assert (read.object_id, read.angles, read.z_angular_velocity) == (None, None, None)
    assert read.velocity.cartesian_velocity is None
    assert read.classification[0].object_class.vehicle is None


def test_a_mapem_with_a_crosswalk_and_limits_for_trucks_is_read():
    envelope = envelopes("mapem")[0]
    junction = envelope["message"]["intersections"][0]
    junction["lane_set"][0]["lane_attributes"]["lane_type"] = {"crosswalk": ["audioSupport"]}
    junction["speed_limits"].append({"type": "truckMaxSpeed", "speed": 100})
    envelope["message"]["layer_type"] = "mixedContent"
    read = unwrap(json.dumps(envelope).encode()).body
    lanes = read.intersections[0].lane_set
    assert lanes[0].lane_attributes.lane_type.vehicle is None
    assert lanes[1].lane_attributes.lane_type.vehicle == ()
    assert (read.layer_type, len(read.intersections[0].speed_limits)) == ("mixedContent", 2)


def test_only_messages_that_require_an_origin_have_one():
    told = {kind for kind in KINDS if "origin" in envelopes(kind)[0]}
    assert told == {"mapem", "spatem"}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"message_type": "vam"}, "message_type: expected one of cam.*got 'vam'"),
        ({"version": "1.0.0"}, "cam: expected version 2.4.0, got '1.0.0'"),
        ({"message": {}}, "missing required field"),
    ],
)
def test_an_envelope_that_we_cannot_read_is_refused(change, said):
    line = json.dumps(envelopes("cam")[0] | change).encode()
    with pytest.raises(MessageError, match=said):
        unwrap(line)
    with pytest.raises(MessageError, match="its-client envelope"):
        unwrap(line[:40])
