"""The tickets with which a fleet's stations sign V2X messages, as text in files.

The authority for tickets is stored with the fleet's other secrets. It is separate from that of TLS,
since IEEE 1609.2 has its own certificate format.
"""

import base64
import binascii
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec

from scm.clock import NS_PER_S
from scm.errors import AccessError, MessageError
from scm.v2x.credentials import write_secret
from scm.v2x.signed_data import read_certificate
from scm.v2x.signing import CAM, DENM, HOURS, Ticket, issue, make_authority, starts_ns

AUTHORITY_HOURS = 65_535
"""The longest validity of a certificate: seven and a half years."""
EARLY = timedelta(hours=1)
"""How long before its creation a ticket is valid, since clocks of cars differ."""


class TicketText(NamedTuple):
    """A ticket in a credentials file: base64, PEM, and the authority's certificate as base64."""

    ticket: str
    key: str
    authority: str


def issue_ticket(folder: Path, station: str, now: datetime) -> TicketText:
    """Return a new ticket of the authority in a fleet's folder; create a missing authority.

    Raises:
        AccessError: when the authority's files cannot be read or written.
    """
    authority = _authority(folder, now)
    made = issue(authority, station, _ns(now - EARLY), psids=(CAM, DENM), hours=HOURS)
    return TicketText(_text(made.certificate), _pem(made.key), _text(authority.certificate))


def air_authority(folder: Path, now: datetime) -> str:
    """Return the certificate of the authority in a fleet's folder, base64; see `issue_ticket`."""
    return _text(_authority(folder, now).certificate)


def read_ticket(ticket: str, key: str) -> Ticket:
    """Return a ticket from the text of a credentials file.

    Raises:
        AccessError: when it is none.
    """
    try:
        found = serialization.load_pem_private_key(key.encode(), None)
    except (ValueError, TypeError) as cause:
        msg = f"ticket_key: {cause}; expected what `scm fleet add` writes"
        raise AccessError(msg) from cause
    if not isinstance(found, ec.EllipticCurvePrivateKey):
        msg = f"ticket_key: got a {type(found).__name__}, expected one of P-256"
        raise AccessError(msg)
    return Ticket(certificate_of(ticket), found)


def certificate_of(text: str) -> bytes:
    """Return the bytes of a base64 certificate.

    Raises:
        AccessError: when it is none.
    """
    try:
        found = base64.b64decode(text, validate=True)
        read_certificate(found)
    except (binascii.Error, MessageError) as cause:
        msg = f"ticket: {cause}; expected what `scm fleet add` writes"
        raise AccessError(msg) from cause
    return found


def ticket_ends(ticket: str) -> datetime:
    """Return when a ticket expires.

    Raises:
        AccessError: when it is none.
    """
    content = read_certificate(certificate_of(ticket)).content
    begins = datetime.fromtimestamp(starts_ns(content) // NS_PER_S, UTC)
    return begins + timedelta(hours=content.hours)


def _authority(folder: Path, now: datetime) -> Ticket:
    key, certificate = folder / "air.key", folder / "air.crt"
    if key.is_file() and certificate.is_file():
        return read_ticket(certificate.read_text(), key.read_text())
    made = make_authority("air", _ns(now - EARLY), AUTHORITY_HOURS)
    write_secret(key, _pem(made.key))
    write_secret(certificate, _text(made.certificate))
    return made


def _pem(key: ec.EllipticCurvePrivateKey) -> str:
    form = serialization.PrivateFormat.PKCS8
    pem = key.private_bytes(serialization.Encoding.PEM, form, serialization.NoEncryption())
    return pem.decode()


def _text(certificate: bytes) -> str:
    return base64.b64encode(certificate).decode()


def _ns(moment: datetime) -> int:
    return round(moment.timestamp()) * NS_PER_S
