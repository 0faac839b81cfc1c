"""Everything a city says keeps to its-client's JSON schemas, and its envelopes are read back."""

import json
import os
from pathlib import Path

import jsonschema_rs
import pytest

from scm.errors import MessageError
from scm.v2x.etsi_json import KINDS, unwrap, wrap
from tests.unit.v2x.etsi_city import city_says
from tests.unit.v2x.etsi_facts import FACTS, schema_of

SCHEMAS = os.environ.get("SCM_ITS_SCHEMAS")
every_kind = pytest.mark.parametrize("kind", KINDS)


def envelopes(kind):
    return [json.loads(wrap(one.body, one.station, one.t_ns)) for one in city_says()[kind]]


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
    for one in city_says()[kind]:
        read = unwrap(wrap(one.body, one.station, one.t_ns))
        assert read == (f"scm_{one.station}", one.t_ns // 1_000_000, one.body)


def test_only_those_that_must_tell_their_origin_do():
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
