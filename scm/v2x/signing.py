"""Sign and verify V2X messages after IEEE 1609.2.

A station signs with a ticket of the city's own authority. It sends the whole certificate once a
second, its digest otherwise. Unlike on real roads a ticket names its station: there are no
pseudonyms, hence no privacy.
"""

import hashlib
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.asymmetric.utils import (
    decode_dss_signature,
    encode_dss_signature,
)

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import AccessError, MessageError
from scm.v2x.signed_data import (
    DIGEST_BYTES,
    NUMBER_BYTES,
    Certificate,
    Point,
    ReadCertificate,
    read_certificate,
    read_message,
    to_be_signed,
    write_message,
)

CAM, DENM = 36, 37
CERTIFICATE_EVERY_NS = NS_PER_S
MAX_AGE_NS = 2 * NS_PER_S
MAX_AHEAD_NS = 500 * NS_PER_MS
MAX_SIGNERS = 4096
HOURS = 24 * 365

_EPOCH_S = 1_072_915_200  # 2004-01-01 UTC, seconds since 1970
_LEAP_S = 5  # leap seconds since then
_ALGORITHM = ec.ECDSA(hashes.SHA256())


class Ticket(NamedTuple):
    """A certificate as bytes, and its private key."""

    certificate: bytes
    key: ec.EllipticCurvePrivateKey

    @property
    def digest(self) -> bytes:
        """The certificate's identifier in messages."""
        return digest_of(self.certificate)


def digest_of(certificate: bytes) -> bytes:
    """Return the last 8 bytes of a certificate's hash."""
    return hashlib.sha256(certificate).digest()[-DIGEST_BYTES:]


def make_authority(name: str, now_ns: int, hours: int = HOURS) -> Ticket:
    """Return a new authority with a self-signed certificate."""
    key = ec.generate_private_key(ec.SECP256R1())
    content = Certificate(
        issuer=None, name=name, start_s=_tai_us(now_ns) // 1_000_000, hours=hours, psids=(),
        key=_point(key),
    )  # fmt: skip
    return Ticket(content.signed(_sign(key, content.to_be_signed(), b"")), key)


def starts_ns(content: Certificate) -> int:
    """Return the start of a certificate's validity, nanoseconds since 1970."""
    return _unix_ns(content.start_s * 1_000_000)


def issue(
    authority: Ticket, station: str, now_ns: int, *, psids: tuple[int, ...] = (CAM, DENM),
    hours: int = 24,
) -> Ticket:  # fmt: skip
    """Return a ticket for a station to sign these kinds of message."""
    key = ec.generate_private_key(ec.SECP256R1())
    content = Certificate(
        issuer=authority.digest, name=station, start_s=_tai_us(now_ns) // 1_000_000, hours=hours,
        psids=psids, key=_point(key),
    )  # fmt: skip
    signature = _sign(authority.key, content.to_be_signed(), authority.certificate)
    return Ticket(content.signed(signature), key)


class Signer:
    """Signs for one station."""

    def __init__(self, ticket: Ticket) -> None:
        self._ticket = ticket
        self._digest = ticket.digest
        self._shown_ns: int | None = None

    def sign(
        self, payload: bytes, psid: int, t_ns: int, place: tuple[int, int, int] | None = None
    ) -> bytes:
        """Return a signed message of a payload generated at `t_ns`.

        A DENM has a `place`: latitude and longitude in 1e-7 degree, elevation.
        """
        tbs = to_be_signed(payload, psid, _tai_us(t_ns), place)
        signature = _sign(self._ticket.key, tbs, self._ticket.certificate)
        if self._shown_ns is None or t_ns - self._shown_ns >= CERTIFICATE_EVERY_NS:
            self._shown_ns = t_ns
            return write_message(tbs, self._ticket.certificate, signature)
        return write_message(tbs, self._digest, signature)


class Verified(NamedTuple):
    """A verified message and its sender."""

    payload: bytes
    psid: int
    station: str
    t_ns: int


@dataclass(frozen=True)
class _Known:
    """A verified certificate."""

    content: Certificate
    raw: bytes

    @cached_property
    def key(self) -> ec.EllipticCurvePublicKey:
        return _public(self.content.key)

    @cached_property
    def hash(self) -> bytes:
        return hashlib.sha256(self.raw).digest()


class Verifier:
    """Verifies messages under one authority; stores verified certificates."""

    def __init__(self, authority: bytes) -> None:
        found = read_certificate(authority)
        root = _Known(found.content, found.raw)
        _check(root.key, found.to_be_signed, hashlib.sha256(b"").digest(), found.signature)
        self._root = root
        self._root_digest = digest_of(authority)
        self._known: OrderedDict[bytes, _Known] = OrderedDict()

    def verify(self, data: bytes, now_ns: int) -> Verified:
        """Return the payload and sender of a message.

        Raises:
            MessageError: when it cannot be decoded.
            AccessError: when its signer is unknown or not permitted, or the signature is invalid.
        """
        message = read_message(data)
        if message.certificate is not None:
            signer = self._verified_signer(message.certificate)
        else:
            signer = self._known_signer(message.digest or b"")
        t_ns = _unix_ns(message.time_us)
        _check_permission(signer.content, message.psid, message.time_us)
        if not -MAX_AHEAD_NS <= now_ns - t_ns <= MAX_AGE_NS:
            msg = f"{signer.content.name}: it is {(now_ns - t_ns) / NS_PER_S:.1f} s old"
            raise AccessError(msg)
        _check(signer.key, message.to_be_signed, signer.hash, message.signature)
        return Verified(message.payload, message.psid, signer.content.name, t_ns)

    def _known_signer(self, digest: bytes) -> _Known:
        found = self._known.get(digest)
        if found is None:
            msg = f"signer {digest.hex()}: its certificate has not come yet"
            raise AccessError(msg)
        return found

    def _verified_signer(self, certificate: ReadCertificate) -> _Known:
        digest = digest_of(certificate.raw)
        known = self._known.get(digest)
        if known is not None and known.raw == certificate.raw:
            return known
        root = self._root
        if certificate.content.issuer != self._root_digest or not certificate.content.psids:
            msg = f"{certificate.content.name}: its certificate is not of our authority"
            raise AccessError(msg)
        _check(root.key, certificate.to_be_signed, root.hash, certificate.signature)
        found = self._known[digest] = _Known(certificate.content, certificate.raw)
        if len(self._known) > MAX_SIGNERS:
            self._known.popitem(last=False)
        return found


def _check_permission(content: Certificate, psid: int, time_us: int) -> None:
    if psid not in content.psids:
        msg = f"{content.name}: it may sign {content.psids}, not {psid}"
        raise AccessError(msg)
    age_s = time_us // 1_000_000 - content.start_s
    if not 0 <= age_s <= content.hours * 3600:
        msg = f"{content.name}: its certificate was not good when this was signed"
        raise AccessError(msg)


def _sign(key: ec.EllipticCurvePrivateKey, tbs: bytes, signer: bytes) -> bytes:
    hashed = hashlib.sha256(tbs).digest() + hashlib.sha256(signer).digest()
    r, s = decode_dss_signature(key.sign(hashed, _ALGORITHM))
    return r.to_bytes(NUMBER_BYTES, "big") + s.to_bytes(NUMBER_BYTES, "big")


def _check(key: ec.EllipticCurvePublicKey, tbs: bytes, signer_hash: bytes, rs: bytes) -> None:
    """Raise AccessError if a signature (r and s) is not the key's."""
    r = int.from_bytes(rs[:NUMBER_BYTES], "big")
    s = int.from_bytes(rs[NUMBER_BYTES:], "big")
    try:
        hashed = hashlib.sha256(tbs).digest() + signer_hash
        key.verify(encode_dss_signature(r, s), hashed, _ALGORITHM)
    except InvalidSignature as cause:
        msg = "signature: it is not the signer's, or what was signed was changed"
        raise AccessError(msg) from cause


def _point(key: ec.EllipticCurvePrivateKey) -> Point:
    numbers = key.public_key().public_numbers()
    return Point(numbers.x.to_bytes(NUMBER_BYTES, "big"), bool(numbers.y & 1))


def _public(point: Point) -> ec.EllipticCurvePublicKey:
    encoded = (b"\x03" if point.is_odd else b"\x02") + point.x
    try:
        return ec.EllipticCurvePublicKey.from_encoded_point(ec.SECP256R1(), encoded)
    except ValueError as cause:
        msg = f"certificate: {point.x.hex()} is no point of P-256"
        raise MessageError(msg) from cause


def _tai_us(t_ns: int) -> int:
    return t_ns // 1000 + (_LEAP_S - _EPOCH_S) * 1_000_000


def _unix_ns(time_us: int) -> int:
    return (time_us - (_LEAP_S - _EPOCH_S) * 1_000_000) * 1000
