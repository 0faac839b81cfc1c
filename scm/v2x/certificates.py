"""Certificates of a fleet: its own authority, one per station, for the router, for the gateways.

ECDSA on P-256. A station's certificate is not valid for a router.
"""

import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from scm.errors import AccessError

AUTHORITY_DAYS = 3650
STATION_DAYS = 365
EARLY = timedelta(hours=1)  # computers' clocks differ


@dataclass(frozen=True, slots=True)
class Pair:
    """A certificate and its private key, both as PEM."""

    certificate: str
    private_key: str


def make_authority(name: str, now: datetime) -> Pair:
    """Return a new self-signed authority."""
    key = ec.generate_private_key(ec.SECP256R1())
    builder = (
        _builder(name, name, key, now, AUTHORITY_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
    )
    return _pair(builder.sign(key, hashes.SHA256()), key)


def issue_station(authority: Pair, name: str, now: datetime, days: int = STATION_DAYS) -> Pair:
    """Return a station's certificate; the router identifies it by the common name `name`."""
    return _issue(authority, name, now, days, [ExtendedKeyUsageOID.CLIENT_AUTH], ())


def issue_router(
    authority: Pair, hosts: Sequence[str], now: datetime, days: int = STATION_DAYS
) -> Pair:
    """Return the router's certificate, valid for the addresses that stations connect to."""
    return _issue(authority, "router", now, days, [ExtendedKeyUsageOID.SERVER_AUTH], hosts)


def issue_gateway(
    authority: Pair, name: str, hosts: Sequence[str], now: datetime, days: int = STATION_DAYS
) -> Pair:
    """Return the certificate of a city's gateways, for both ends of a link to a neighbour."""
    both = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    return _issue(authority, name, now, days, both, hosts)


def check_authority(pem: str) -> None:
    """Check that a text is the certificate of an authority, and no more than that.

    Raises:
        AccessError: when it is not, or holds a private key.
    """
    if "PRIVATE KEY" in pem:
        msg = "it holds a private key, which must stay where it was made; expected a certificate"
        raise AccessError(msg)
    try:
        (found,) = x509.load_pem_x509_certificates(pem.encode())
        basic = found.extensions.get_extension_for_class(x509.BasicConstraints).value
    except (ValueError, x509.ExtensionNotFound) as cause:
        msg = "expected one certificate of an authority in PEM, as `scm fleet authority` writes it"
        raise AccessError(msg) from cause
    if not basic.ca:
        msg = "it is a station's certificate; expected that of the authority"
        raise AccessError(msg)


def fingerprint_of(pem: str) -> str:
    """Return the SHA-256 fingerprint of a certificate, for people to compare."""
    digest = x509.load_pem_x509_certificate(pem.encode()).fingerprint(hashes.SHA256())
    return digest.hex(":").upper()


def expiry_of(pem: str) -> datetime:
    """Return when a certificate expires, UTC."""
    return x509.load_pem_x509_certificate(pem.encode()).not_valid_after_utc


def _issue(
    authority: Pair,
    name: str,
    now: datetime,
    days: int,
    purposes: Sequence[x509.ObjectIdentifier],
    hosts: Sequence[str],
) -> Pair:
    issuer = x509.load_pem_x509_certificate(authority.certificate.encode())
    signer = serialization.load_pem_private_key(authority.private_key.encode(), None)
    if not isinstance(signer, ec.EllipticCurvePrivateKey):
        msg = "the fleet's authority: expected an ECDSA key, as `scm fleet add` makes it"
        raise AccessError(msg)
    key = ec.generate_private_key(ec.SECP256R1())
    parent = str(issuer.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)
    builder = (
        _builder(name, parent, key, now, days)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(purposes), critical=False)
    )
    if hosts:
        names = [_general_name(host) for host in hosts]
        builder = builder.add_extension(x509.SubjectAlternativeName(names), critical=False)
    return _pair(builder.sign(signer, hashes.SHA256()), key)


def _builder(
    name: str, issuer: str, key: ec.EllipticCurvePrivateKey, now: datetime, days: int
) -> x509.CertificateBuilder:
    now = now.astimezone(UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)]))
        .issuer_name(x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, issuer)]))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - EARLY)
        .not_valid_after(now + timedelta(days=days))
    )


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        encipher_only=False,
        decipher_only=False,
    )


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _pair(certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> Pair:
    return Pair(
        certificate.public_bytes(serialization.Encoding.PEM).decode(),
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        ).decode(),
    )
