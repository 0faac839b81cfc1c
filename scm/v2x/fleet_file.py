"""The fleet file: the stations of a city and their roles, in TOML, without secrets.

Secrets are in the folder beside it (`fleet.toml` -> `fleet.secrets/`): one credentials file per
station, and the router's list of passwords or authority with its key. New credentials increase a
station's number, and the router accepts only the newest: a stolen file becomes invalid with the
next `scm fleet add` and a restart of the router.
"""

import re
import secrets
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from scm.errors import AccessError, nearest
from scm.v2x.credentials import Credentials, read_credentials, write_credentials, write_secret
from scm.v2x.key import check_name
from scm.v2x.rights import rights_of

if TYPE_CHECKING:
    from scm.v2x.certificates import Pair

Auth = Literal["password", "mtls"]
HERE = ("127.0.0.1", "::1", "localhost")
PASSWORD_BYTES = 32
RENEW_BEFORE = timedelta(days=30)
_HOST = re.compile(r"[A-Za-z0-9_.:-]{1,253}")

_HEAD = (
    "# Who may enter the city. Written by `scm fleet add`; secrets lie in the folder beside it.\n"
)


@dataclass(frozen=True, slots=True)
class Member:
    """One station: its name, its role, and how many credentials it was issued."""

    name: str
    role: str
    issued: int = 1

    @property
    def identity(self) -> str:
        """The user name or common name by which the router identifies it."""
        return f"{self.name}.{self.issued}"


@dataclass(slots=True)
class Fleet:
    """The stations of a city.

    Attributes:
        path: Of the file.
        auth: How its stations authenticate.
        hosts: Addresses of the router, named in its certificate.
        members: By name.
        issued: Number of credentials ever issued to each name, removed ones included.
    """

    path: Path
    auth: Auth
    hosts: tuple[str, ...] = HERE
    members: dict[str, Member] = field(default_factory=dict)
    issued: dict[str, int] = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """The folder of its secrets."""
        return self.path.with_suffix(".secrets")

    @property
    def users(self) -> Path:
        """The router's list of passwords."""
        return self.folder / "router.users"

    def credentials(self, name: str) -> Path:
        """Return the credentials file of a station."""
        return self.folder / f"{name}.toml"

    def pem(self, name: str) -> Path:
        """Return the path of `.crt` or `.key` of `authority`, `router` or `gateway`."""
        return self.folder / name

    def authority_of(self, neighbour: str) -> Path:
        """Return where the certificate of a neighbouring city's authority is."""
        return self.folder / "neighbours" / f"{neighbour}.crt"

    @property
    def neighbours(self) -> list[str]:
        """The cities whose authority is known."""
        return sorted(path.stem for path in self.authority_of("").parent.glob("*.crt"))


def load_fleet(path: Path) -> Fleet:
    """Read a fleet file.

    Raises:
        AccessError: when it cannot be read or is invalid.
    """
    try:
        values = tomllib.loads(path.read_text("utf-8"))
    except OSError as cause:
        msg = f"fleet {path}: {cause.strerror}; `scm fleet add` makes one"
        raise AccessError(msg) from cause
    except ValueError as cause:
        msg = f"fleet {path}: {cause}; expected TOML as `scm fleet add` writes it"
        raise AccessError(msg) from cause
    auth = values.get("auth")
    if auth not in ("password", "mtls"):
        msg = f"fleet {path}: auth: got {auth!r}, expected password or mtls"
        raise AccessError(msg)
    try:
        fleet = Fleet(path, auth, tuple(map(str, values.get("hosts", HERE))))
        check_hosts(fleet.hosts)
        for name, of_station in values.get("stations", {}).items():
            member = Member(check_name(name, "station"), of_station["role"], of_station["issued"])
            rights_of(member.role, name)
            fleet.members[name] = member
        fleet.issued = {name: int(count) for name, count in values.get("removed", {}).items()}
    except (AccessError, ValueError, KeyError, TypeError, AttributeError) as cause:
        msg = f"fleet {path}: {cause!r}; expected what `scm fleet add` writes"
        raise AccessError(msg) from cause
    fleet.issued |= {member.name: member.issued for member in fleet.members.values()}
    return fleet


def save_fleet(fleet: Fleet) -> None:
    """Write a fleet file; replace an existing one."""
    hosts = ", ".join(f'"{host}"' for host in fleet.hosts)
    lines = [_HEAD, f'auth = "{fleet.auth}"', f"hosts = [{hosts}]", ""]
    for member in sorted(fleet.members.values(), key=lambda member: member.name):
        lines += [f"[stations.{member.name}]", f'role = "{member.role}"']
        lines += [f"issued = {member.issued}", ""]
    gone = {name: count for name, count in fleet.issued.items() if name not in fleet.members}
    if gone:
        lines += ["[removed]", *(f"{name} = {count}" for name, count in sorted(gone.items())), ""]
    write_secret(fleet.path, "\n".join(lines))


def add(fleet: Fleet, name: str, role: str, now: datetime) -> Credentials:
    """Add a station or issue new credentials; write all files and return the credentials.

    Raises:
        AccessError: when the role is unknown, or files cannot be written.
        MessageError: when the name is not valid in a key.
    """
    rights_of(role, check_name(name, "station"))
    member = Member(name, role, fleet.issued.get(name, 0) + 1)
    made = _with_password(member) if fleet.auth == "password" else _certified(fleet, member, now)
    made = _with_ticket(fleet, made, now)
    write_credentials(fleet.credentials(name), made)
    fleet.members[name] = member
    fleet.issued[name] = member.issued
    if fleet.auth == "password":
        _write_users(fleet, {member.identity: made.password})
    save_fleet(fleet)
    return made


def remove(fleet: Fleet, name: str) -> None:
    """Remove a station, with effect from the router's next start.

    Raises:
        AccessError: when there is no such station.
    """
    if name not in fleet.members:
        close = nearest(name, list(fleet.members))
        msg = f"fleet {fleet.path}: there is no station named {name!r}{close}"
        raise AccessError(msg)
    del fleet.members[name]
    if fleet.auth == "password":
        _write_users(fleet, {})
    save_fleet(fleet)
    fleet.credentials(name).unlink(missing_ok=True)


def complete(fleet: Fleet, stations: Mapping[str, str], now: datetime) -> None:
    """Issue missing credentials of a city's own stations (name -> role); renew expiring ones."""
    for name, role in stations.items():
        if _lacks_credentials(fleet, name, now):
            add(fleet, name, role, now)
    name_hosts(fleet, (), now)


def check_hosts(hosts: Iterable[str]) -> None:
    """Check that all hosts are addresses or host names.

    Raises:
        AccessError: naming the first invalid one.
    """
    for host in hosts:
        if not _HOST.fullmatch(host):
            msg = f"host: got {host!r}, expected an address or a name, as in 192.168.1.5"
            raise AccessError(msg)


def name_hosts(fleet: Fleet, hosts: Iterable[str], now: datetime) -> None:
    """Add addresses to the router's certificate, and renew it when it expires soon."""
    all_hosts = (*fleet.hosts, *(host for host in hosts if host not in fleet.hosts))
    is_new = all_hosts != fleet.hosts
    fleet.hosts = all_hosts
    if fleet.auth == "mtls":
        from scm.v2x.certificates import issue_router  # noqa: PLC0415  slow to load, rarely needed

        authority, old = _authority(fleet, now), fleet.pem("router.crt")
        if is_new or not old.is_file() or _ends_soon(old.read_text(), now):
            pair = issue_router(authority, fleet.hosts, now)
            write_secret(fleet.pem("router.key"), pair.private_key)
            write_secret(fleet.pem("router.crt"), pair.certificate)
    save_fleet(fleet)


def authority_certificate(fleet: Fleet, now: datetime) -> str:
    """Return the certificate of the fleet's authority, which a neighbouring city needs.

    Raises:
        AccessError: when the fleet has none: its stations use passwords.
    """
    if fleet.auth != "mtls":
        msg = f"fleet {fleet.path}: its stations use passwords; expected one made with --mtls"
        raise AccessError(msg)
    return _authority(fleet, now).certificate


def add_neighbour(fleet: Fleet, neighbour: str, certificate: str, now: datetime) -> None:
    """Trust the authority of a neighbouring city, for its gateway and nothing else.

    Raises:
        AccessError: when the text is not the certificate of another authority.
        MessageError: when the name is not valid in a key.
    """
    from scm.v2x.certificates import check_authority, fingerprint_of  # noqa: PLC0415  slow to load

    check_name(neighbour, "neighbour")
    check_authority(certificate)
    if fingerprint_of(certificate) == fingerprint_of(authority_certificate(fleet, now)):
        msg = "it is this fleet's own authority; expected that of the neighbour"
        raise AccessError(msg)
    write_secret(fleet.authority_of(neighbour), certificate)


def remove_neighbour(fleet: Fleet, neighbour: str) -> None:
    """Forget the authority of a neighbouring city, with effect from the next start.

    Raises:
        AccessError: when it is not known.
    """
    if neighbour not in fleet.neighbours:
        close = nearest(neighbour, fleet.neighbours)
        msg = f"fleet {fleet.path}: there is no neighbour named {neighbour!r}{close}"
        raise AccessError(msg)
    fleet.authority_of(neighbour).unlink()


def issue_gateway_files(fleet: Fleet, common_name: str, now: datetime) -> None:
    """Write a new certificate of the city's gateways, valid for the addresses of its router."""
    from scm.v2x.certificates import issue_gateway  # noqa: PLC0415  slow to load, rarely needed

    pair = issue_gateway(_authority(fleet, now), common_name, fleet.hosts, now)
    write_secret(fleet.pem("gateway.key"), pair.private_key)
    write_secret(fleet.pem("gateway.crt"), pair.certificate)


def _lacks_credentials(fleet: Fleet, name: str, now: datetime) -> bool:
    path = fleet.credentials(name)
    if name not in fleet.members or not path.is_file():
        return True
    held = read_credentials(path)
    if not _has_ticket(fleet.members[name], held, now):
        return True
    return fleet.auth == "mtls" and _ends_soon(held.certificate, now)


def _has_ticket(member: Member, held: Credentials, now: datetime) -> bool:
    from scm.v2x.tickets import ticket_ends  # noqa: PLC0415  slow to load, rarely needed

    if not held.air_authority:
        return False
    return not sends_cams(member.role, member.name) or (
        bool(held.ticket) and ticket_ends(held.ticket) - now >= RENEW_BEFORE
    )


def _ends_soon(certificate: str, now: datetime) -> bool:
    from scm.v2x.certificates import expiry_of  # noqa: PLC0415  slow to load, rarely needed

    return expiry_of(certificate) - now < RENEW_BEFORE


def sends_cams(role: str, name: str) -> bool:
    """Return whether a station sends CAMs: a car, or the world for the cars that it hosts."""
    return role == "vehicle" or (role, name) == ("part", "world")


def _with_ticket(fleet: Fleet, made: Credentials, now: datetime) -> Credentials:
    """Return credentials with what a station needs for signed V2X messages."""
    from scm.v2x.tickets import air_authority, issue_ticket  # noqa: PLC0415  slow to load

    if not sends_cams(made.role, made.station):
        return replace(made, air_authority=air_authority(fleet.folder, now))
    text = issue_ticket(fleet.folder, made.station, now)
    return replace(made, ticket=text.ticket, ticket_key=text.key, air_authority=text.authority)


def _with_password(member: Member) -> Credentials:
    return Credentials(
        station=member.name,
        role=member.role,
        user=member.identity,
        password=secrets.token_urlsafe(PASSWORD_BYTES),
    )


def _certified(fleet: Fleet, member: Member, now: datetime) -> Credentials:
    from scm.v2x.certificates import issue_station  # noqa: PLC0415  slow to load, rarely needed

    name_hosts(fleet, (), now)
    authority = _authority(fleet, now)
    pair = issue_station(authority, member.identity, now)
    return Credentials(
        station=member.name,
        role=member.role,
        certificate=pair.certificate,
        private_key=pair.private_key,
        authority=authority.certificate,
    )


def _authority(fleet: Fleet, now: datetime) -> "Pair":
    from scm.v2x.certificates import Pair, make_authority  # noqa: PLC0415  slow, rarely needed

    key, certificate = fleet.pem("authority.key"), fleet.pem("authority.crt")
    if key.is_file() and certificate.is_file():
        return Pair(certificate.read_text(), key.read_text())
    made = make_authority(f"scm {fleet.path.stem}", now)
    write_secret(key, made.private_key)
    write_secret(certificate, made.certificate)
    return made


def _write_users(fleet: Fleet, new: Mapping[str, str]) -> None:
    """Write the router's passwords, which Zenoh reads in plain text."""
    lines = fleet.users.read_text().splitlines() if fleet.users.is_file() else []
    known = dict(line.split(":", 1) for line in lines) | dict(new)
    current = [member.identity for member in fleet.members.values()]
    users = [f"{user}:{known[user]}\n" for user in sorted(current) if user in known]
    write_secret(fleet.users, "".join(users))
