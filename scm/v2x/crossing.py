"""What crosses to a neighbouring city: the only table, and the rules that routers make of it.

A city's gateway is a Zenoh router of its own between two links: to its city's router, through a
socket in the file system, and to the gateway of the neighbour. It denies everything but what
`[[neighbours]]` of the map chooses, requests for a hand-over, and what says that the other city is
there. So it does not matter what the neighbour's side calls itself: whatever comes over that link
has the rights of a neighbour, never those of a station of this city.
"""

from collections.abc import Iterable

from scm.v2x.key import check_name, prefix
from scm.v2x.rights import Rights

SHOWN: dict[str, tuple[str, ...]] = {
    "states": ("v/*/state",),
    "cams": ("v2x/tx/*/cam",),
    "denms": ("v2x/tx/*/denm",),
    "cpms": ("v2x/tx/*/cpm",),
    "spatem": ("v2x/tx/*/spatem",),
    "mapem": ("v2x/tx/*/mapem",),
    "events": ("event/*/*",),
}
"""Keys below a city's prefix, by the names of `messages` in `[[neighbours]]`."""

HANDOVER = "handover/"
"""Requests to a city by which cars are handed over: this, and the name of who sends them."""

BORDER = "border/"
"""What a city publishes on its neighbour's keys: its cars near the border, if it shows CAMs."""

GATEWAY = "gateway-"
"""Station of a gateway: this, and the name of the neighbour."""

INNER = "unixsock-stream"


def gateway_station(neighbour: str) -> str:
    """Return the station of the gateway to a neighbour.

    Raises:
        MessageError: when the name is too long for a station's.
    """
    return check_name(GATEWAY + neighbour, "gateway")


def common_name(city: str) -> str:
    """Return the common name of the certificate of a city's gateways; no station can have it."""
    return f"gateway@{city}"


def other_side(rights: Rights) -> Rights:
    """Return the rights of the other end of a link, which receives what this one publishes."""
    return Rights(
        publishes=rights.subscribes,
        subscribes=rights.publishes,
        requests=rights.services,
        services=rights.requests,
    )


def shown_keys(city: str, neighbour: str, names: Iterable[str]) -> tuple[str, ...]:
    """Return the keys of a city that a neighbour may see, `names` of `SHOWN` being chosen."""
    keys = [key for name in names for key in SHOWN[name]]
    return tuple(prefix(city) + key for key in (f"neighbour/{neighbour}", *keys))


def border_keys(city: str, neighbour: str, names: Iterable[str]) -> tuple[str, ...]:
    """Return the neighbour's keys on which a city publishes, if it shows that."""
    return (prefix(neighbour) + BORDER + city,) if "cams" in names else ()


def handover_key(city: str, sender: str) -> str:
    """Return the key of the hand-over requests from `sender` to a city."""
    return prefix(city) + HANDOVER + sender


def neighbour_rights(neighbour: str, city: str, names: Iterable[str]) -> Rights:
    """Return the rights of a neighbour at a city that shows it `names`; full keys."""
    names = tuple(names)
    return Rights(
        publishes=shown_keys(neighbour, city, SHOWN) + border_keys(neighbour, city, SHOWN),
        subscribes=shown_keys(city, neighbour, names) + border_keys(city, neighbour, names),
        requests=(handover_key(city, neighbour),),
        services=(handover_key(neighbour, city),),
    )


def link_rules(name: str, rights: Rights) -> list[dict[str, object]]:
    """Return Zenoh's rules for a link whose far end has these rights; ids begin with `name`."""
    sides = (
        ("ingress", "put", rights.publishes),
        ("egress", "put", rights.subscribes),
        ("ingress", "declare_subscriber", _declared(rights.subscribes)),
        ("egress", "declare_subscriber", _declared(rights.publishes)),
        ("ingress", "query", rights.requests),
        ("egress", "query", rights.services),
        ("ingress", "reply", rights.services),
        ("egress", "reply", rights.requests),
        ("ingress", "declare_queryable", _declared(rights.services)),
        ("egress", "declare_queryable", _declared(rights.requests)),
    )
    return [
        {
            "id": f"{name}:{direction}:{message}",
            "permission": "allow",
            "flows": [direction],
            "messages": [message],
            "key_exprs": list(keys),
        }
        for direction, message, keys in sides
        if keys
    ]


def _declared(keys: Iterable[str]) -> list[str]:
    """Return the keys as a station declares them, which receives them from all its neighbours."""
    found = []
    for key in keys:
        before, _, last = key.rpartition("/")
        to_all = before.endswith(("/" + HANDOVER.rstrip("/"), "/" + BORDER.rstrip("/")))
        found.append(f"{before}/*" if to_all else f"{before}/{last}")
    return found
