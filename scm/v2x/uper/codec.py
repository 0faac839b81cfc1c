"""Bodies to UPER bytes and back, by pycrate's compiled ASN.1.

pycrate keeps the value inside the type's one object, so a lock makes each call whole.
"""

import threading
from collections.abc import Callable
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import msgspec

from scm.errors import MessageError
from scm.v2x.etsi.cam_spatem import CAM_ID, SPATEM_ID, CamBody, SpatemBody
from scm.v2x.etsi.denm import DENM_ID, DenmBody
from scm.v2x.etsi.json_form import Body, type_of
from scm.v2x.etsi.mapem import MAPEM_ID, MapemBody
from scm.v2x.etsi.priority import SREM_ID, SSEM_ID, SremBody, SsemBody
from scm.v2x.uper import cam, denm, mapem, spatem, srem, ssem

EXTRA = "scm[v2x]"

_lock = threading.Lock()


class Coding(NamedTuple):
    """How one kind of message is coded: pycrate's file, module and type, and the two mappings."""

    file: str
    module: str
    pdu: str
    body: type[Body]
    message_id: int
    to_asn: Callable[[Any], dict[str, Any]]
    of_asn: Callable[[dict[str, Any]], dict[str, Any]]


CODINGS = {
    "cam": Coding(
        "ITS_CAM_2", "CAM_PDU_Descriptions", "CAM", CamBody, CAM_ID, cam.to_asn, cam.of_asn
    ),
    "denm": Coding(
        "ITS_DENM_3", "DENM_PDU_Descriptions", "DENM", DenmBody, DENM_ID, denm.to_asn, denm.of_asn
    ),
    "spatem": Coding(
        "ITS_IS",
        "SPATEM_PDU_Descriptions",
        "SPATEM",
        SpatemBody,
        SPATEM_ID,
        spatem.to_asn,
        spatem.of_asn,
    ),
    "mapem": Coding(
        "ITS_IS", "MAPEM_PDU_Descriptions", "MAPEM", MapemBody, MAPEM_ID, mapem.to_asn, mapem.of_asn
    ),
    "srem": Coding(
        "ITS_IS", "SREM_PDU_Descriptions", "SREM", SremBody, SREM_ID, srem.to_asn, srem.of_asn
    ),
    "ssem": Coding(
        "ITS_IS", "SSEM_PDU_Descriptions", "SSEM", SsemBody, SSEM_ID, ssem.to_asn, ssem.of_asn
    ),
}
"""By message_type; a CPM is not among them."""


@cache
def _compiled(file: str) -> ModuleType:
    import importlib  # noqa: PLC0415  together with what it loads

    try:
        return importlib.import_module(f"pycrate_asn1dir.{file}")
    except ImportError as cause:
        msg = f"UPER needs pycrate, which is not installed: pip install '{EXTRA}'"
        raise MessageError(msg) from cause


def pdu_of(kind: str) -> Any:
    """Return pycrate's object of a kind of message.

    Raises:
        MessageError: for a kind without UPER, or when the extra is not installed.
    """
    coding = CODINGS.get(kind)
    if coding is None:
        msg = f"{kind}: expected one of {', '.join(CODINGS)}; pycrate has no ASN.1 of any other"
        raise MessageError(msg)
    return getattr(getattr(_compiled(coding.file), coding.module), coding.pdu)


def encode(body: Body) -> bytes:
    """Return a body as UPER.

    Raises:
        MessageError: for a kind without UPER, a value that its type does not allow, or when the
            extra is not installed.
    """
    kind = type_of(body)
    pdu = pdu_of(kind)
    value = CODINGS[kind].to_asn(body)
    with _lock:
        try:
            pdu.set_val(value)
            coded: bytes = pdu.to_uper()
        except Exception as cause:  # pycrate raises of many kinds, some bare
            msg = f"{kind}: cannot be coded: {cause}"
            raise MessageError(msg) from cause
    return coded


def decode(kind: str, data: bytes) -> Body:
    """Read a body back.

    Raises:
        MessageError: for bytes that are no such message, or a choice that we do not read.
    """
    pdu = pdu_of(kind)
    coding = CODINGS[kind]
    if data[1:2] != bytes((coding.message_id,)):
        msg = f"{kind}: expected messageID {coding.message_id}, got {data[1:2].hex() or 'nothing'}"
        raise MessageError(msg)
    try:
        with _lock:
            pdu.from_uper(data)
            value = pdu.get_val()
        return msgspec.convert(coding.of_asn(value), coding.body, strict=False)
    except MessageError:
        raise
    except Exception as cause:  # likewise: these bytes come from the air
        msg = f"{kind}: {len(data)} bytes that are none: {type(cause).__name__}: {cause}"
        raise MessageError(msg) from cause
