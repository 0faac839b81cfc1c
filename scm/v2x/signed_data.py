"""The bytes of signed messages: IEEE 1609.2 data and certificates, in canonical OER.

Only our own profile is written and read: ECDSA on P-256, SHA-256, explicit certificates, a payload
inside. Its layout is fixed and the reader rejects everything else. Tests compare every byte with
pycrate, which implements the whole standard.
"""

from dataclasses import dataclass
from typing import NamedTuple

from scm.errors import MessageError

VERSION = 3
DIGEST_BYTES = 8
NUMBER_BYTES = 32

# Preambles of optional fields, and tags of the choices in our profile.
_SIGNED_DATA = bytes([VERSION, 0x81, 0x00])  # version, signedData, hash sha256
_TBS_START = bytes([0x40, VERSION, 0x80])  # its payload: data, version, unsecuredData
_WITH_TIME, _WITH_TIME_AND_PLACE = 0x40, 0x50
_BY_DIGEST, _BY_CERTIFICATE = 0x80, 0x81
_SIGNATURE = b"\x80\x80"  # ecdsaNistP256, r as x only
_ISSUED_BY, _SELF = b"\x80", b"\x81\x00"
_EVEN, _ODD = 0x82, 0x83
_MAY_SEND, _MAY_ISSUE = 0x10, 0x08


class Point(NamedTuple):
    """A public key on P-256, compressed."""

    x: bytes
    is_odd: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """The content of a certificate.

    Attributes:
        issuer: Digest of the issuer's certificate; None: self-signed.
        name: Of the station, or of the authority.
        start_s: Start of validity, TAI seconds since 2004.
        hours: Duration of validity.
        psids: Kinds of message it may sign; empty: it issues certificates.
        key: Public key.
    """

    issuer: bytes | None
    name: str
    start_s: int
    hours: int
    psids: tuple[int, ...]
    key: Point

    def to_be_signed(self) -> bytes:
        """Return the part that its signature covers."""
        name = self.name.encode()
        perms = bytes([1, len(self.psids)]) + b"".join(b"\x00" + _integer(p) for p in self.psids)
        if not self.psids:
            # One group: all kinds, with the defaults of the standard for the rest.
            perms = bytes([1, 1, 0x00, 0x81])
        return b"".join(
            (
                bytes([_MAY_SEND if self.psids else _MAY_ISSUE, 0x81, len(name)]),
                name,
                bytes(5),  # no revocation list
                self.start_s.to_bytes(4, "big"),
                b"\x84" + self.hours.to_bytes(2, "big"),
                perms,
                bytes([0x80, 0x80, _ODD if self.key.is_odd else _EVEN]),
                self.key.x,
            )
        )

    def signed(self, signature: bytes) -> bytes:
        """Return the whole certificate; `signature` is r and s, 64 bytes."""
        issuer = _SELF if self.issuer is None else _ISSUED_BY + self.issuer
        head = bytes([0x80, VERSION, 0x00])  # with a signature, version, explicit
        return head + issuer + self.to_be_signed() + _SIGNATURE + signature


class ByteReader:
    """Reads bytes from the front."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self.at = 0

    def read(self, count: int) -> bytes:
        """Return the next bytes.

        Raises:
            MessageError: when there are fewer.
        """
        found = self._data[self.at : self.at + count]
        if len(found) < count:
            msg = f"signed data: got {len(self._data)} bytes, expected {count} from {self.at} on"
            raise MessageError(msg)
        self.at += count
        return found

    def expect(self, wanted: bytes) -> None:
        """Read bytes and compare them with the expected ones.

        Raises:
            MessageError: when they differ.
        """
        begun = self.at
        found = self.read(len(wanted))
        if found != wanted:
            msg = f"signed data, byte {begun}: got {found.hex()}, expected {wanted.hex()}"
            raise MessageError(msg)

    def byte(self) -> int:
        """Return the next byte."""
        return self.read(1)[0]

    def number(self, count: int) -> int:
        """Return the next bytes as a number."""
        return int.from_bytes(self.read(count), "big")

    def length(self) -> int:
        """Return a length: one byte, or the number of its bytes followed by them."""
        first = self.byte()
        return first if first < 0x80 else self.number(first & 0x7F)

    def since(self, start: int) -> bytes:
        """Return the bytes read since a position."""
        return self._data[start : self.at]

    def end(self) -> None:
        """Check that nothing is left.

        Raises:
            MessageError: when there are more bytes.
        """
        left = len(self._data) - self.at
        if left:
            msg = f"signed data: {left} bytes more than expected"
            raise MessageError(msg)


class ReadCertificate(NamedTuple):
    """A received certificate, with the bytes that its signature covers."""

    content: Certificate
    raw: bytes
    to_be_signed: bytes
    signature: bytes


class SignedMessage(NamedTuple):
    """A received signed message.

    Attributes:
        payload: The signed content, mostly UPER.
        psid: Kind of message: 36 CAM, 37 DENM.
        time_us: Time of generation, TAI microseconds since 2004.
        to_be_signed: Bytes that the signature covers, together with the signer.
        digest: Of the signer's certificate, if only the digest was sent.
        certificate: The signer's, if the whole one was sent.
        signature: r and s.
    """

    payload: bytes
    psid: int
    time_us: int
    to_be_signed: bytes
    digest: bytes | None
    certificate: ReadCertificate | None
    signature: bytes


def to_be_signed(
    payload: bytes, psid: int, time_us: int, place: tuple[int, int, int] | None = None
) -> bytes:
    """Return the bytes of a message that are signed.

    `place` is latitude and longitude [1e-7 degree] and elevation [0.1 m above -409.6 m].
    """
    head = _WITH_TIME if place is None else _WITH_TIME_AND_PLACE
    parts = [
        _TBS_START, _length(len(payload)), payload,
        bytes([head]), _integer(psid), time_us.to_bytes(8, "big"),
    ]  # fmt: skip
    if place is not None:
        latitude, longitude, elevation = place
        parts += [
            latitude.to_bytes(4, "big", signed=True),
            longitude.to_bytes(4, "big", signed=True),
            elevation.to_bytes(2, "big"),
        ]
    return b"".join(parts)


def write_message(tbs: bytes, signer: bytes, signature: bytes) -> bytes:
    """Return a signed message; `signer` is an 8-byte digest or a whole certificate."""
    if len(signer) == DIGEST_BYTES:
        who = bytes([_BY_DIGEST]) + signer
    else:
        who = bytes([_BY_CERTIFICATE, 1, 1]) + signer
    return _SIGNED_DATA + tbs + who + _SIGNATURE + signature


def read_message(data: bytes) -> SignedMessage:
    """Decode a signed message.

    Raises:
        MessageError: when it is invalid or not of our profile.
    """
    reader = ByteReader(data)
    reader.expect(_SIGNED_DATA)
    begun = reader.at
    reader.expect(_TBS_START)
    payload = reader.read(reader.length())
    head = reader.byte()
    psid = reader.number(reader.length())
    time_us = reader.number(8)
    if head == _WITH_TIME_AND_PLACE:
        reader.read(10)
    elif head != _WITH_TIME:
        msg = f"signed data: header {head:#x}, expected a time, and a place or none"
        raise MessageError(msg)
    tbs = reader.since(begun)
    digest, certificate = _read_signer(reader)
    reader.expect(_SIGNATURE)
    signature = reader.read(2 * NUMBER_BYTES)
    reader.end()
    return SignedMessage(payload, psid, time_us, tbs, digest, certificate, signature)


def _read_signer(reader: ByteReader) -> tuple[bytes | None, ReadCertificate | None]:
    kind = reader.byte()
    if kind == _BY_DIGEST:
        return reader.read(DIGEST_BYTES), None
    if kind != _BY_CERTIFICATE:
        msg = f"signed data: signer {kind:#x}, expected a digest or a certificate"
        raise MessageError(msg)
    reader.expect(b"\x01\x01")
    return None, _read_certificate(reader)


def read_certificate(data: bytes) -> ReadCertificate:
    """Decode a certificate.

    Raises:
        MessageError: when it is invalid or not of our profile.
    """
    reader = ByteReader(data)
    found = _read_certificate(reader)
    reader.end()
    return found


def _read_certificate(reader: ByteReader) -> ReadCertificate:
    begun = reader.at
    reader.expect(bytes([0x80, VERSION, 0x00]))
    issuer = reader.read(DIGEST_BYTES) if reader.byte() == _ISSUED_BY[0] else None
    if issuer is None:
        reader.expect(_SELF[1:])
    covered = reader.at
    kind = reader.byte()
    reader.expect(b"\x81")
    name = reader.read(reader.byte())
    reader.expect(bytes(5))
    start_s = reader.number(4)
    reader.expect(b"\x84")
    hours = reader.number(2)
    psids = _read_psids(reader, kind)
    reader.expect(b"\x80\x80")
    parity = reader.byte()
    key = Point(reader.read(NUMBER_BYTES), parity == _ODD)
    tbs = reader.since(covered)
    reader.expect(_SIGNATURE)
    signature = reader.read(2 * NUMBER_BYTES)
    try:
        content = Certificate(
            issuer=issuer, name=name.decode(), start_s=start_s, hours=hours, psids=psids, key=key
        )
    except UnicodeDecodeError as cause:
        msg = f"certificate: name {name!r} is no text"
        raise MessageError(msg) from cause
    if content.to_be_signed() != tbs:
        msg = "certificate: it is not written as the standard's canonical form has it"
        raise MessageError(msg)
    return ReadCertificate(content, reader.since(begun), tbs, signature)


def _read_psids(reader: ByteReader, kind: int) -> tuple[int, ...]:
    if kind == _MAY_ISSUE:
        reader.expect(bytes([1, 1, 0x00, 0x81]))
        return ()
    if kind != _MAY_SEND:
        msg = f"certificate: fields {kind:#x}, expected what it may send, or that it may issue"
        raise MessageError(msg)
    reader.expect(b"\x01")
    psids = []
    for _ in range(reader.byte()):
        reader.expect(b"\x00")
        psids.append(reader.number(reader.length()))
    return tuple(psids)


def _length(count: int) -> bytes:
    if count < 0x80:
        return bytes([count])
    size = (count.bit_length() + 7) // 8
    return bytes([0x80 | size]) + count.to_bytes(size, "big")


def _integer(value: int) -> bytes:
    size = max(1, (value.bit_length() + 7) // 8)
    return bytes([size]) + value.to_bytes(size, "big")
