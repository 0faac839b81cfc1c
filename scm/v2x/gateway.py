"""The gateway to one neighbouring city: a Zenoh router with two links, which denies by default.

It is a process of its own: what a slow or dead link holds up there is not held up in the city.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import zenoh

from scm.errors import AccessError, RunError
from scm.v2x import zenoh_config
from scm.v2x.access import is_local
from scm.v2x.crossing import INNER, common_name, link_rules, neighbour_rights, other_side
from scm.v2x.router import open_router

_ENDPOINT = re.compile(r"(?:tcp|tls)/[^/\s]+:([0-9]{1,5})")


@dataclass(frozen=True, slots=True, kw_only=True)
class Border:
    """Where a gateway stands, and what may pass it.

    Attributes:
        city: The own city.
        neighbour: The other one.
        inner: The socket of the own city's router.
        endpoint: Of the neighbour's gateway, or where this one waits for it.
        listens: Whether it waits; else it connects.
        shows: What the neighbour may see, names of `SHOWN`.
        secrets: Folder with `gateway.crt`, `gateway.key` and the neighbour's authority; None: an
            endpoint of this machine, without certificates.
    """

    city: str
    neighbour: str
    inner: str
    endpoint: str
    listens: bool
    shows: tuple[str, ...] = ()
    secrets: Path | None = None


def check_endpoint(endpoint: str, auth: str | None) -> None:
    """Check that a link to another city goes over TLS, or does not leave this machine.

    Args:
        endpoint: Of either end.
        auth: How the own fleet authenticates; None: the city has no fleet file.

    Raises:
        AccessError: when it does not suit.
    """
    parts = _ENDPOINT.fullmatch(endpoint)
    if parts is None or not 0 < int(parts[1]) < 65536:
        msg = f"got {endpoint!r}, expected tls/HOST:PORT, or tcp/127.0.0.1:PORT on this machine"
        raise AccessError(msg)
    if auth == "password":
        msg = "the fleet has passwords; expected one with certificates (--mtls), or no fleet file"
        raise AccessError(msg)
    if auth == "mtls":
        if not endpoint.startswith("tls/"):
            msg = f"got {endpoint!r}, expected tls/HOST:PORT for a fleet with certificates"
            raise AccessError(msg)
    elif endpoint.startswith("tls/"):
        msg = f"got {endpoint!r} without a fleet of certificates; `scm fleet add --mtls` makes one"
        raise AccessError(msg)
    elif not (endpoint.startswith("tcp/") and is_local(endpoint)):
        msg = f"got {endpoint!r}, expected tls/HOST:PORT, or tcp/127.0.0.1:PORT on this machine"
        raise AccessError(msg)


class Gateway:
    """A gateway that runs inside its `with` block."""

    def __init__(self, border: Border) -> None:
        self.border = border
        self._session: zenoh.Session | None = None

    def __enter__(self) -> Self:
        """Start to listen or to connect; neither the city nor the neighbour needs to be there.

        Raises:
            RunError: when the endpoint cannot be listened at.
        """
        self._open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._close()

    def reopen(self) -> None:
        """Make both links anew.

        After a link was cut and made again within milliseconds, Zenoh 1.10 sometimes routes nothing
        over it any more, in one direction or both, until it is made once more.
        """
        self._close()
        self._open()

    def _open(self) -> None:
        border = self.border
        here, there = ([border.endpoint], []) if border.listens else ([], [border.endpoint])
        try:
            config = zenoh_config.router(here, settings_of(border), [border.inner, *there])
            self._session = open_router(config)
        except zenoh.ZError as cause:
            why = zenoh_config.reason(cause)
            msg = f"cannot wait for {border.neighbour} at {border.endpoint!r}: {why}"
            raise RunError(msg) from cause

    def _close(self) -> None:
        if self._session is not None:
            self._session.close()  # type: ignore[no-untyped-call]
            self._session = None

    def far_names(self) -> list[str | None]:
        """Return the common names of who is linked from outside; None: without a certificate."""
        links = [] if self._session is None else self._session.info.links()
        return [link.auth_identifier for link in links if not _is_inner(link)]


def _is_inner(link: zenoh.Link) -> bool:
    return f"{INNER}/" in (link.src + link.dst)


def settings_of(border: Border) -> dict[str, Any]:
    """Return what a gateway adds to the configuration of a router."""
    outer = border.endpoint.partition("/")[0]
    return {
        "transport": _transport(border),
        "access_control": _access_control(border),
        **zenoh_config.never_waiting(outer),
    }


def _transport(border: Border) -> Mapping[str, Any]:
    if border.secrets is None:
        return {}
    certificate, key = (str(border.secrets / f"gateway.{end}") for end in ("crt", "key"))
    authority = border.secrets / "neighbours" / f"{border.neighbour}.crt"
    tls = {
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "root_ca_certificate": str(authority),
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
    }
    return {"link": {"tls": tls}}


def _access_control(border: Border) -> dict[str, object]:
    """Return Zenoh's `access_control` of a gateway: what crosses, by the side that it comes from.

    A station of the neighbour with a certificate of the same authority is no gateway.
    """
    rights = neighbour_rights(border.neighbour, border.city, border.shows)
    rules = {
        "city": link_rules("city", other_side(rights)),
        "neighbour": link_rules("neighbour", rights),
    }
    neighbour: dict[str, object] = {"id": "neighbour", "link_protocols": ["tcp"]}
    if border.secrets is not None:
        names = [common_name(border.neighbour)]
        neighbour = {"id": "neighbour", "link_protocols": ["tls"], "cert_common_names": names}
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [*rules["city"], *rules["neighbour"]],
        "subjects": [{"id": "city", "link_protocols": [INNER]}, neighbour],
        "policies": [
            {"rules": [rule["id"] for rule in own], "subjects": [side]}
            for side, own in rules.items()
        ],
    }
