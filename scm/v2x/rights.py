"""What each role may publish, subscribe to, request and serve: the only table of rights.

Entries are keys below `scm/@v1/<city>/` with Zenoh's `*` and `**`; `{me}` is the station's own
name. Everything else is denied. Tests compare the table with what the parts of a running city do,
so a new message that is missing here fails a test.
"""

from dataclasses import dataclass
from typing import Literal, get_args

from scm.errors import AccessError, nearest

Role = Literal["vehicle", "part", "viewer", "operator", "driver", "camera", "emulator"]
ROLES: tuple[str, ...] = get_args(Role)


@dataclass(frozen=True, slots=True)
class Rights:
    """Keys below the city's prefix.

    Attributes:
        publishes: Messages that it publishes.
        subscribes: Messages that it subscribes to, presence included.
        requests: Requests that it sends.
        services: Requests that it answers.
    """

    publishes: tuple[str, ...] = ()
    subscribes: tuple[str, ...] = ()
    requests: tuple[str, ...] = ()
    services: tuple[str, ...] = ()

    def of(self, name: str) -> "Rights":
        """Return these rights with a station's name filled in."""

        def own(keys: tuple[str, ...]) -> tuple[str, ...]:
            return tuple(key.replace("{me}", name) for key in keys)

        return Rights(
            own(self.publishes), own(self.subscribes), own(self.requests), own(self.services)
        )

    def __add__(self, other: "Rights") -> "Rights":
        """Return the rights of both."""
        return Rights(
            self.publishes + other.publishes,
            self.subscribes + other.subscribes,
            self.requests + other.requests,
            self.services + other.services,
        )


# `**` does not match chunks that begin with @: pictures have to be named.
EVERYTHING = ("**", "v/*/@camera/*", "v/*/@network", "eye/*/@preview", "eye/*/@picture")
EVERY_REQUEST = (
    "v/*/lease",
    "v/*/cmd/*",
    "v/*/remove",
    "v/*/park",
    "v/*/twin/version",
    "v/*/twin/send",
    "parking/bay",
    "world/spawn",
    "world/boxes",
    "world/stop_request",
    "tl/*/req",
    "tl/*/wish",
    "tl/*/mon/reset",
    "eye/*/req",
)

_EVERYBODY = Rights(
    publishes=("part/{me}/status", "event/info/{me}", "event/warning/{me}", "event/error/{me}")
)
_WATCHES = Rights(subscribes=EVERYTHING)

_OF_ROLE: dict[str, Rights] = {
    # Not `v/{me}/**`: a car cannot send itself what others send it (commands, contacts), nor what
    # only roadside units send (SPATEM, MAPEM, SSEM).
    "vehicle": Rights(
        publishes=(
            "v/{me}/state",
            "v/{me}/sensors",
            "v/{me}/scan",
            "v/{me}/trip",
            "v/{me}/@camera/*",
            "v2x/tx/{me}/cam",
            "v2x/tx/{me}/cpm",
            "v2x/tx/{me}/denm",
            "v2x/tx/{me}/srem",
        ),
        subscribes=(
            "world/def",
            "world/stop",
            "world/radio",
            "tl/*/mon",
            "tl/*/spat",
            "v/{me}/alive/*",
            "v/{me}/contact",
            "v/{me}/cmd/drive",
            "v/{me}/twin",
            "v2x/rx/{me}/*/*",
            "eye/pose/{me}",
            "eye/*/pose/{me}",
        ),
        requests=("v/{me}/join", "v/{me}/lease", "v/{me}/remove"),
        services=("v/{me}/cmd/*",),
    ),
    "viewer": _WATCHES,
    "operator": _WATCHES + Rights(requests=EVERY_REQUEST),
    "driver": _WATCHES
    + Rights(
        publishes=(
            "v/*/cmd/drive",
            "v/*/autonomy",
            "v/*/autonomy/plan",
            "v/*/costmap",
            "v/*/map",
            "v/*/@network",
        ),
        requests=EVERY_REQUEST,
        services=("v/*/park",),
    ),
    "camera": Rights(publishes=("eye/{me}/@picture",)),
    # Not under the vehicle's name: the emulated car is another station with fewer rights.
    "emulator": Rights(
        publishes=("v/*/emulated",), subscribes=("world/def", "world/snapshot", "v/*/emulated")
    ),
}

_OF_PART: dict[str, Rights] = {
    "world": Rights(
        publishes=(
            "world/*",
            "v/*/state",
            "v/*/sensors",
            "v/*/scan",
            "v/*/trip",
            "v/*/contact",
            "v/*/cmd/drive",
            "v2x/tx/*/*",
            "v2x/rx/*/*/*",
        ),
        subscribes=(
            "border/*",
            "v/*/alive/*",
            "v/*/state",
            "v/*/cmd/drive",
            "v2x/tx/*/*",
            "tl/*/mon",
            "tl/*/spat",
        ),
        requests=("v/*/cmd/*",),
        services=("world/*", "v/*/lease", "v/*/join", "v/*/remove", "v/*/cmd/*", "handover/*"),
    ),
    "traffic": Rights(
        publishes=("tl/*/spat", "tl/*/site", "tl/*/status", "v2x/tx/*/*"),
        subscribes=(
            "tl/*/mon",
            "v2x/rx/*/*/*",
            "eye/pose/*",
            "world/def",
            "v/*/twin",
            "event/*/world",
        ),
        services=("tl/*/req", "tl/*/wish"),
    ),
    "monitor": Rights(
        publishes=("tl/*/mon",), subscribes=("tl/*/spat",), services=("tl/*/mon/reset",)
    ),
    "eye": Rights(
        publishes=("eye/*/*", "eye/*/pose/*", "eye/pose/*", "eye/*/@preview", "v2x/tx/*/cpm"),
        subscribes=("world/snapshot", "v/*/emulated", "eye/*/pose/*", "eye/*/@picture"),
        services=("eye/*/req",),
    ),
    "camera": Rights(
        publishes=("v/*/@camera/*",),
        subscribes=("world/snapshot", "world/def", "tl/*/spat", "v/*/emulated"),
    ),
    "record": _WATCHES,
    "api": _WATCHES + Rights(publishes=("v/*/cmd/drive",), requests=EVERY_REQUEST),
    "up": _WATCHES,
    "selftest": _WATCHES + Rights(publishes=("**",), requests=("**",)),
    "observer": Rights(
        publishes=("traffic/counts", "violation/*"),
        subscribes=("eye/pose/*", "v/*/state", "v/*/contact", "tl/*/spat"),
    ),
    "misbehaviour": Rights(
        publishes=("misbehaviour/scores", "misbehaviour/*/report"),
        subscribes=("v2x/rx/*/*/*", "eye/pose/*"),
    ),
    "parking": Rights(
        publishes=("parking/status",),
        subscribes=("v/*/autonomy", "v/*/state"),
        services=("parking/bay",),
    ),
    "twin": Rights(
        publishes=("v/*/twin",),
        subscribes=(
            "v/*/state",
            "v/*/sensors",
            "v/*/trip",
            "world/def",
            "eye/*/pose/*",
            "event/*/*",
            "part/world/status",
        ),
        requests=("v/*/twin/version", "v/*/cmd/route"),
        services=("v/*/twin/version", "v/*/twin/send"),
    ),
    "demand": Rights(
        publishes=("demand/status",),
        subscribes=("v/*/trip",),
        requests=("world/spawn", "v/*/cmd/route", "v/*/remove"),
    ),
    "ros2": _WATCHES + Rights(publishes=("v/*/cmd/drive",), requests=("v/*/lease", "v/*/park")),
    "gateway": Rights(publishes=("neighbour/*",)),
}
"""By the part's name; `eye-<camera>` has the rights of `eye`, `gateway-<city>` of `gateway`."""

_FAMILIES = ("eye", "gateway")
_RESERVED = ("eye-", "gateway-", "rsu-")
_PRESENCE = {"vehicle": "v/{me}/alive/*", "part": "part/{me}/alive/*"}
_CLIENT = "client/{me}/alive/*"


def rights_of(role: str, name: str) -> Rights:
    """Return what a station may do.

    Raises:
        AccessError: when there is no such role, or no such part of the city.
    """
    if role == "part":
        family = name.partition("-")[0]
        kind = family if family in _FAMILIES else name
        if kind not in _OF_PART:
            close = nearest(name, list(_OF_PART))
            msg = f"part: got {name!r}, expected one of {sorted(_OF_PART)} or eye-<camera>{close}"
            raise AccessError(msg)
        return (_EVERYBODY + _OF_PART[kind]).of(name)
    if name in _OF_PART or name.startswith(_RESERVED):
        msg = f"{role}: got {name!r}, a name of the city's own; expected another"
        raise AccessError(msg)
    if role not in _OF_ROLE:
        msg = f"role: got {role!r}, expected one of {sorted(ROLES)}{nearest(role, ROLES)}"
        raise AccessError(msg)
    return (_EVERYBODY + _OF_ROLE[role]).of(name)


def presence_of(role: str, name: str) -> str:
    """Return the presence key of a station."""
    return _PRESENCE.get(role, _CLIENT).replace("{me}", name)
