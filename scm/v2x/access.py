"""Who may do what at the router: Zenoh's access control, made from the fleet file.

What was learnt about Zenoh 1.10 and is kept to here: the router must be allowed to tell a station
who subscribes and who serves (`declare_*` on egress, broad, for it is matched by inclusion), else
a declared publisher falls silent after a while; a request for kept events reaches its cache on a
broad key, so `query` on egress is broad too; and an advanced publisher and its subscribers meet on
keys below `<key>/@adv`. None of the three tells a station anything: it gets only what it may ask
for, and may only ask for what its rights name.
"""

import ipaddress
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

from scm.errors import AccessError
from scm.v2x.credentials import Credentials, read_credentials
from scm.v2x.fleet_file import Fleet, Member, complete, load_fleet
from scm.v2x.key import prefix
from scm.v2x.rights import presence_of, rights_of

ADVANCED = "/@adv/**"
CITY_PARTS = (
    "up",
    "world",
    "traffic",
    "monitor",
    "observer",
    "misbehaviour",
    "demand",
    "record",
    "camera",
    "api",
    "ros2",
)

SCRIPT = "script"
"""Who a script is that the dashboard runs: an operator, however much the server itself may do."""

_Rule = dict[str, object]


@dataclass(frozen=True, slots=True)
class Guard:
    """How a city that runs on this machine keeps its router.

    Attributes:
        listen: The router's endpoint.
        connect: The one that the city's own stations reach it by.
        settings: For `Router`; None: everybody on this machine may enter.
        files: Credentials of the city's own stations.
    """

    listen: str
    connect: str
    settings: Mapping[str, object] | None = None
    files: Mapping[str, Path] = field(default_factory=dict)

    def arguments(self, station: str) -> tuple[str, ...]:
        """Return what the program of a station has to be given."""
        return ("--credentials", str(self.files[station])) if station in self.files else ()

    def credentials(self, station: str) -> Credentials | None:
        """Return who a station in this process is."""
        return read_credentials(self.files[station], station) if station in self.files else None


def guard_of(
    fleet_file: Path | None, city: str, listen: str, stations: Mapping[str, str], now: datetime
) -> Guard:
    """Return the guard of a city with a fleet file, or with none.

    Args:
        fleet_file: None: everybody on this machine may enter.
        city: Chunk of all keys.
        listen: The router's endpoint, with a port.
        stations: The city's own (name -> role), see `own_stations`; added where missing.
        now: For certificates.

    Raises:
        AccessError: when the file is wrong, or does not suit the endpoint.
    """
    if fleet_file is None:
        return Guard(listen, listen)
    fleet = load_fleet(fleet_file)
    settings_first = router_settings(fleet, city, listen)  # refuse before anything is written
    files = credentials_of(fleet, stations, now)
    settings = {**settings_first, "access_control": access_control(fleet, city)}
    connect = listen.replace("/0.0.0.0:", "/127.0.0.1:").replace("/[::]:", "/[::1]:")
    return Guard(listen, connect, settings, files)


def own_stations(eyes: Iterable[str], agents: Iterable[str]) -> dict[str, str]:
    """Return the stations that a whole city starts itself, with their roles."""
    parts, cars = dict.fromkeys((*CITY_PARTS, *eyes), "part"), dict.fromkeys(agents, "vehicle")
    return parts | {SCRIPT: "operator"} | cars


def router_settings(fleet: Fleet, city: str, listen: str) -> dict[str, object]:
    """Return what a fleet adds to the configuration of the router of a city.

    Args:
        fleet: Whose stations may enter.
        city: Chunk of all keys.
        listen: The router's endpoint.

    Raises:
        AccessError: when the endpoint does not suit the fleet: passwords go over the wire as they
            are, so for them it must be of this machine; certificates need `tls/...`.
    """
    is_tls = listen.startswith("tls/")
    if fleet.auth == "mtls" and not is_tls:
        msg = f"router: got {listen!r}, expected tls/HOST:PORT for a fleet with certificates"
        raise AccessError(msg)
    if fleet.auth == "password" and (is_tls or not is_local(listen)):
        msg = (
            f"router: got {listen!r}, expected tcp/127.0.0.1:PORT for a fleet with passwords; "
            "make one with --mtls for other computers"
        )
        raise AccessError(msg)
    return {"transport": _transport(fleet), "access_control": access_control(fleet, city)}


def is_local(endpoint: str) -> bool:
    """Return whether only this machine can reach an endpoint (`tcp/127.0.0.1:7447`)."""
    link, _, address = endpoint.partition("/")
    host = address.rpartition(":")[0].strip("[]")
    return link.startswith("unix") or is_loopback(host)


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach what is bound to `host`."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def credentials_of(fleet: Fleet, stations: Mapping[str, str], now: datetime) -> dict[str, Path]:
    """Return the credentials files of a city's own stations (name -> role), made where missing."""
    complete(fleet, stations, now)
    return {name: fleet.credentials(name) for name in stations}


def _transport(fleet: Fleet) -> dict[str, object]:
    if fleet.auth == "password":
        return {"auth": {"usrpwd": {"dictionary_file": str(fleet.users)}}}
    return {
        "link": {
            "tls": {
                "enable_mtls": True,
                "root_ca_certificate": str(fleet.pem("authority.crt")),
                "listen_certificate": str(fleet.pem("router.crt")),
                "listen_private_key": str(fleet.pem("router.key")),
            }
        }
    }


def access_control(fleet: Fleet, city: str) -> dict[str, object]:
    """Return Zenoh's `access_control`: everything is denied but what the fleet's roles may do."""
    everyone = [member.name for member in fleet.members.values()]
    rules = [_declarations(city)]
    policies: list[dict[str, object]] = [{"rules": [rules[0]["id"]], "subjects": everyone}]
    for member in fleet.members.values():
        own = _rules(member, city)
        rules += own
        policies.append({"rules": [rule["id"] for rule in own], "subjects": [member.name]})
    kind = "usernames" if fleet.auth == "password" else "cert_common_names"
    subjects = [{"id": m.name, kind: [m.identity]} for m in fleet.members.values()]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies if everyone else [],
    }


def _declarations(city: str) -> _Rule:
    """Return the rule by which the router tells every station who listens and who asks."""
    city_keys = prefix(city)
    keys = [
        *(city_keys + key for key in ("**", "v/*/@camera/*", "eye/*/@preview", "eye/*/@picture")),
        city_keys + "**" + ADVANCED,
    ]
    return _rule(
        "declarations", "egress", ("declare_subscriber", "declare_queryable", "query"), keys
    )


def _rules(member: Member, city: str) -> list[_Rule]:
    rights, name = rights_of(member.role, member.name), member.name

    def full(keys: Iterable[str]) -> list[str]:
        return [prefix(city) + key for key in keys]

    publishes, subscribes = full(rights.publishes), full(rights.subscribes)
    requests, services = full(rights.requests), full(rights.services)
    caches, recovery = [key + ADVANCED for key in publishes], [key + ADVANCED for key in subscribes]
    here = full([presence_of(member.role, name)])
    of_others = ("declare_subscriber", "declare_liveliness_subscriber", "liveliness_query")
    rules = [
        _rule(f"{name}:publish", "ingress", ("put",), publishes + caches),
        _rule(f"{name}:reply", "ingress", ("reply",), publishes + services),
        _rule(f"{name}:serve", "ingress", ("declare_queryable",), services + caches),
        _rule(f"{name}:presence", "ingress", ("liveliness_token",), here + caches),
        _rule(f"{name}:subscribe", "ingress", of_others, subscribes + recovery),
        _rule(f"{name}:request", "ingress", ("query",), requests + recovery),
        _rule(f"{name}:receive", "egress", ("put", "liveliness_token"), subscribes + recovery),
        _rule(f"{name}:receive_reply", "egress", ("reply",), requests + subscribes),
    ]
    return [rule for rule in rules if rule["key_exprs"]]


def _rule(name: str, flow: str, messages: Iterable[str], keys: list[str]) -> _Rule:
    return {
        "id": name,
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": keys,
    }
