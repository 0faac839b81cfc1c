"""ETSI messages in the envelope of Orange's its-client, as used over MQTT.

    {"message_type": "cam", "source_uuid": "scm_n1", "timestamp": ms since 1970,
     "version": "2.4.0", "message": {...the body...}}

SPATEM and MAPEM also have an `origin`. The schemas allow only timestamps of the years 2018 to
2027: envelopes of a city on a stepped clock from 1970 are invalid.
"""

from typing import Any, NamedTuple

import msgspec

from scm.clock import NS_PER_MS
from scm.errors import MessageError
from scm.v2x.etsi.cam_spatem import CamBody, SpatemBody
from scm.v2x.etsi.cpm import CpmBody
from scm.v2x.etsi.denm import DenmBody
from scm.v2x.etsi.mapem import MapemBody
from scm.v2x.etsi.priority import SremBody, SsemBody

Body = CamBody | CpmBody | DenmBody | MapemBody | SpatemBody | SremBody | SsemBody

ORIGIN = "self"


class Kind(NamedTuple):
    """One kind of message: its body's class, its schema's version, whether it has an origin."""

    body: type[Body]
    version: str
    has_origin: bool = False


KINDS = {
    "cam": Kind(CamBody, "2.4.0"),
    "cpm": Kind(CpmBody, "2.1.1"),
    "denm": Kind(DenmBody, "2.3.0"),
    "mapem": Kind(MapemBody, "2.0.0", has_origin=True),
    "spatem": Kind(SpatemBody, "2.0.0", has_origin=True),
    "srem": Kind(SremBody, "2.0.1"),
    "ssem": Kind(SsemBody, "2.0.1"),
}
"""By message_type."""
_TYPES = {kind.body: name for name, kind in KINDS.items()}


class Envelope(NamedTuple):
    """A message with its source and time of sending [ms since 1970]."""

    source: str
    timestamp_ms: int
    body: Body


class _Raw(msgspec.Struct, kw_only=True):
    message_type: str
    source_uuid: str
    timestamp: int
    version: str
    message: msgspec.Raw


def type_of(body: Body) -> str:
    """Return the message_type of a body: `cam`, `denm` ..."""
    return _TYPES[type(body)]


def wrap(body: Body, station: str, t_ns: int) -> bytes:
    """Return a body in its envelope, one line of JSON without a newline."""
    name = type_of(body)
    kind = KINDS[name]
    envelope: dict[str, Any] = {"message_type": name}
    if kind.has_origin:
        envelope["origin"] = ORIGIN
    envelope["version"] = kind.version
    envelope["source_uuid"] = f"scm_{station}"
    envelope["timestamp"] = t_ns // NS_PER_MS
    envelope["message"] = body
    return msgspec.json.encode(envelope)


def unwrap(line: bytes) -> Envelope:
    """Decode an envelope, ours or another tool's.

    Raises:
        MessageError: for invalid bytes, an unknown type or version, or a body out of its ranges.
    """
    try:
        raw = msgspec.json.decode(line, type=_Raw)
        kind = KINDS.get(raw.message_type)
        if kind is None:
            msg = f"message_type: expected one of {', '.join(KINDS)}, got {raw.message_type!r}"
            raise MessageError(msg)
        if raw.version.partition("-")[0] != kind.version:
            msg = f"{raw.message_type}: expected version {kind.version}, got {raw.version!r}"
            raise MessageError(msg)
        body = msgspec.json.decode(raw.message, type=kind.body)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as cause:
        msg = f"its-client envelope: {cause}"
        raise MessageError(msg) from cause
    return Envelope(raw.source_uuid, raw.timestamp, body)
