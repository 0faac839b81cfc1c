"""The credentials file of one station: its identity, and how it authenticates at the router.

One TOML file, readable only by its owner, to be copied to the computer of the station. It holds
either a password, or a certificate with its private key and the authority of the router's
certificate.
"""

import base64
import json
import os
import stat
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from scm.errors import AccessError

OTHERS = stat.S_IRWXG | stat.S_IRWXO


@dataclass(frozen=True, slots=True, kw_only=True)
class Credentials:
    """The credentials of one station.

    Attributes:
        station: Its name on the bus.
        role: Its role in the fleet file.
        user: User name of the password; empty with a certificate.
        password: Empty with a certificate.
        certificate, private_key, authority: PEM; empty with a password.
        ticket, ticket_key: For signing V2X messages, base64 and PEM; empty: it sends none.
        air_authority: Issuer of all tickets, base64; empty: messages are not signed.
    """

    station: str
    role: str
    user: str = ""
    password: str = ""
    certificate: str = ""
    private_key: str = ""
    authority: str = ""
    ticket: str = ""
    ticket_key: str = ""
    air_authority: str = ""

    def client_settings(self) -> dict[str, object]:
        """Return the `transport` settings of Zenoh for a client with these credentials."""
        if self.password:
            return {"auth": {"usrpwd": {"user": self.user, "password": self.password}}}
        return {
            "link": {
                "tls": {
                    "enable_mtls": True,
                    "verify_name_on_connect": True,
                    "root_ca_certificate_base64": _base64(self.authority),
                    "connect_certificate_base64": _base64(self.certificate),
                    "connect_private_key_base64": _base64(self.private_key),
                }
            }
        }


def read_credentials(path: Path, station: str | None = None) -> Credentials:
    """Read a credentials file.

    Args:
        path: Of the file.
        station: Expected station; None: any.

    Raises:
        AccessError: when it cannot be read, is readable by others, is incomplete, or belongs to
            another station.
    """
    try:
        mode = path.stat().st_mode
        values = tomllib.loads(path.read_text("utf-8"))
    except OSError as cause:
        msg = f"credentials {path}: {cause.strerror}"
        raise AccessError(msg) from cause
    except ValueError as cause:
        msg = f"credentials {path}: {cause}; expected TOML as `scm fleet add` writes it"
        raise AccessError(msg) from cause
    if mode & OTHERS:
        got = stat.filemode(mode)
        msg = f"credentials {path}: got {got}, expected only its owner to read it: chmod 600 {path}"
        raise AccessError(msg)
    found = _checked(path, values)
    if station is not None and found.station != station:
        msg = f"credentials {path}: they are of {found.station!r}, expected {station!r}"
        raise AccessError(msg)
    return found


def _checked(path: Path, values: Mapping[str, object]) -> Credentials:
    known = tuple(Credentials.__dataclass_fields__)
    texts = {name: value for name, value in values.items() if isinstance(value, str)}
    wrong = sorted(set(values) - set(known) | (set(values) - set(texts)))
    if wrong:
        msg = f"credentials {path}: {wrong[0]}: expected a text, and one of {known}"
        raise AccessError(msg)
    with_certificate = all(texts.get(name) for name in ("certificate", "private_key", "authority"))
    with_password = bool(texts.get("user") and texts.get("password"))
    if not texts.get("station") or with_certificate == with_password:
        msg = (
            f"credentials {path}: expected station, role, and either user and password or "
            "certificate, private_key and authority"
        )
        raise AccessError(msg)
    return Credentials(**{"role": "", **texts})


def write_credentials(path: Path, credentials: Credentials) -> None:
    """Write a credentials file; replace an existing one."""
    lines = [f"{name} = {_toml(value)}" for name, value in asdict(credentials).items() if value]
    write_secret(path, "\n".join(lines) + "\n")


def write_secret(path: Path, text: str) -> None:
    """Write a file that only its owner can read, atomically.

    Raises:
        AccessError: when it cannot be written.
    """
    beside = path.with_name(f".{path.name}.new")
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        beside.unlink(missing_ok=True)
        with os.fdopen(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except OSError as cause:
        msg = f"{path}: {cause.strerror}; expected a place to write a secret to"
        raise AccessError(msg) from cause


def _toml(text: str) -> str:
    return f"'''\n{text}'''" if "\n" in text else json.dumps(text)


def _base64(text: str) -> str:
    return base64.b64encode(text.encode()).decode()
