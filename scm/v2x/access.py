"""Access control at the router: Zenoh's rules, generated from the fleet file.

Three facts of Zenoh 1.10 shape the rules. The router must be allowed to declare subscribers and
services to a station (`declare_*` on egress, broad, since it is matched by inclusion), or a
declared publisher stops sending after a while. A query for cached events reaches its cache on a
broad key, so `query` on egress is broad too. An advanced publisher and its subscribers use keys
below `<key>/@adv`. None of this reveals data: a station receives only what its rights allow.
"""

import ipaddress
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

from scm.errors import AccessError
from scm.v2x.credentials import Credentials, read_credentials
from scm.v2x.crossing import (
    INNER,
    SHOWN,
    border_keys,
    gateway_station,
    link_rules,
    neighbour_rights,
    shown_keys,
)
from scm.v2x.fleet_file import Fleet, Member, complete, load_fleet
from scm.v2x.key import prefix
from scm.v2x.rights import EVERYTHING, Rights, presence_of, rights_of

ADVANCED = "/@adv/**"
CITY_PARTS = (
    "up",
    "world",
    "traffic",
    "monitor",
    "observer",
    "misbehaviour",
    "parking",
    "demand",
    "record",
    "camera",
    "api",
    "ros2",
)

SCRIPT = "script"
"""Station of scripts that the dashboard runs: an operator, whatever the server itself may do."""

_Rule = dict[str, object]


@dataclass(frozen=True, slots=True)
class Guard:
    """The router's access settings of a city on this machine.

    Attributes:
        listen: The router's endpoint.
        connect: The endpoint for the city's own stations.
        settings: For `Router`; None: everybody on this machine may connect.
        files: Credentials of the city's own stations.
    """

    listen: str
    connect: str
    settings: Mapping[str, object] | None = None
    files: Mapping[str, Path] = field(default_factory=dict)

    def arguments(self, station: str) -> tuple[str, ...]:
        """Return the command-line arguments for a station's program."""
        return ("--credentials", str(self.files[station])) if station in self.files else ()

    def credentials(self, station: str) -> Credentials | None:
        """Return the credentials of a station in this process."""
        return read_credentials(self.files[station], station) if station in self.files else None


def guard_of(
    fleet_file: Path | None,
    city: str,
    listen: str,
    stations: Mapping[str, str],
    now: datetime,
    neighbours: Iterable[str] = (),
) -> Guard:
    """Return the access settings of a city, with or without a fleet file.

    Args:
        fleet_file: None: everybody on this machine may connect.
        city: Chunk of all keys.
        listen: The router's endpoint, with a port.
        stations: The city's own (name -> role), see `own_stations`; missing ones are added.
        now: For certificates.
        neighbours: Cities to which this one has a gateway.

    Raises:
        AccessError: when the file is invalid or does not suit the endpoint.
    """
    if fleet_file is None:
        return Guard(listen, listen)
    neighbours = tuple(neighbours)
    fleet = load_fleet(fleet_file)
    settings_first = router_settings(fleet, city, listen)  # raises before anything is written
    files = credentials_of(fleet, stations, now)
    settings = {**settings_first, "access_control": access_control(fleet, city, neighbours)}
    connect = listen.replace("/0.0.0.0:", "/127.0.0.1:").replace("/[::]:", "/[::1]:")
    return Guard(listen, connect, settings, files)


def own_stations(
    eyes: Iterable[str], agents: Iterable[str], neighbours: Iterable[str] = ()
) -> dict[str, str]:
    """Return the stations that a city starts itself, with their roles."""
    parts = dict.fromkeys((*CITY_PARTS, *eyes, *map(gateway_station, neighbours)), "part")
    cars = dict.fromkeys(agents, "vehicle")
    return parts | {SCRIPT: "operator"} | cars


def router_settings(fleet: Fleet, city: str, listen: str) -> dict[str, object]:
    """Return what a fleet adds to the configuration of a city's router.

    Args:
        fleet: The fleet whose stations may connect.
        city: Chunk of all keys.
        listen: The router's endpoint.

    Raises:
        AccessError: when the endpoint does not suit the fleet. Passwords travel in plain text, so
            they need an endpoint of this machine; certificates need `tls/...`.
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
    """Return whether only this machine can reach an address bound to `host`."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def credentials_of(fleet: Fleet, stations: Mapping[str, str], now: datetime) -> dict[str, Path]:
    """Return the credentials files of a city's own stations (name -> role); create missing ones."""
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


def access_control(fleet: Fleet, city: str, neighbours: Sequence[str] = ()) -> dict[str, object]:
    """Return Zenoh's `access_control`: deny everything except what the fleet's roles allow.

    Gateways to `neighbours` may carry what crosses; their own rules choose from it.
    """
    everyone = [member.name for member in fleet.members.values()]
    rules = [_declarations(city)]
    policies: list[dict[str, object]] = [{"rules": [rules[0]["id"]], "subjects": everyone}]
    for member in fleet.members.values():
        own = _rules(member, city) + _rules_abroad(member, city, neighbours)
        rules += own
        policies.append({"rules": [rule["id"] for rule in own], "subjects": [member.name]})
    kind = "usernames" if fleet.auth == "password" else "cert_common_names"
    subjects = [{"id": m.name, kind: [m.identity]} for m in fleet.members.values()]
    for neighbour in neighbours:
        carried = link_rules(f"to {neighbour}", neighbour_rights(neighbour, city, SHOWN))
        rules += carried
        policies.append({"rules": [rule["id"] for rule in carried], "subjects": ["gateways"]})
    if neighbours:
        subjects.append({"id": "gateways", "link_protocols": [INNER]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies if subjects else [],
    }


def _declarations(city: str) -> _Rule:
    """Return the rule that lets the router declare subscribers and queries to every station."""
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


def _rules_abroad(member: Member, city: str, neighbours: Sequence[str]) -> list[_Rule]:
    """Return what a station of this city may do on the keys of its neighbours.

    Who watches this city sees what they show; the world also hands cars over; a gateway learns
    whether the other city is there.
    """
    watches = set(EVERYTHING) <= set(rights_of(member.role, member.name).subscribes)
    found = list[_Rule]()
    for neighbour in neighbours:
        rights = Rights()
        if member.name == gateway_station(neighbour):
            rights = Rights(subscribes=shown_keys(neighbour, city, ()))
        elif (member.role, member.name) == ("part", "world"):
            theirs = neighbour_rights(neighbour, city, SHOWN)
            near = border_keys(city, neighbour, SHOWN)
            rights = Rights(publishes=near, subscribes=theirs.publishes, requests=theirs.services)
        elif watches:
            rights = Rights(subscribes=shown_keys(neighbour, city, SHOWN))
        found += link_rules(f"{member.name}:{neighbour}", rights)
    return found


def _rule(name: str, flow: str, messages: Iterable[str], keys: list[str]) -> _Rule:
    return {
        "id": name,
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": keys,
    }
