"""The city's Zenoh router, inside this process.

It needs no Python to route, but must not share its process with a busy loop, which would delay all
messages.
"""

import os
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Self

import zenoh

from scm.errors import AccessError, RunError
from scm.v2x import zenoh_config
from scm.v2x.access import is_local

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"

# The thread that watches all links also writes to them: one wake-up less per message. It does not
# read, since reading may wait for a slow listener. Zenoh reads this setting once per process.
THREADS = "(acc: (handover: tx))"


class Router:
    """A router that listens inside its `with` block.

    Args:
        listen: The endpoint.
        access: Access rules from `access.router_settings`; None: everybody on this machine.
        gateways: A second endpoint, a socket in the file system, for the gateways to neighbouring
            cities; empty: there are none.

    Attributes:
        listen: The endpoint that stations connect to.

    Raises:
        AccessError: when other computers could reach it without access rules.
    """

    def __init__(
        self,
        listen: str = DEFAULT_ENDPOINT,
        access: Mapping[str, Any] | None = None,
        gateways: str = "",
    ) -> None:
        if access is None and not is_local(listen):
            msg = (
                f"router: got {listen!r} without a fleet file, which would let everybody on the "
                "network drive the city; expected tcp/127.0.0.1:PORT, or a fleet file"
            )
            raise AccessError(msg)
        self.listen = listen
        self._access: Mapping[str, Any] | None = access
        self._endpoints = [listen]
        if gateways:
            self._endpoints.append(gateways)
            inner = zenoh_config.never_waiting(gateways.partition("/")[0])
            self._access = {**(access or {}), **inner}
        self._session: zenoh.Session | None = None

    def __enter__(self) -> Self:
        """Start to listen.

        Raises:
            RunError: when the endpoint cannot be listened at.
        """
        try:
            self._session = open_router(zenoh_config.router(self._endpoints, self._access))
        except zenoh.ZError as cause:
            why = zenoh_config.reason(cause)
            msg = f"cannot listen at {self.listen!r}: does another city run there? ({why})"
            raise RunError(msg) from cause
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._session is not None:
            self._session.close()  # type: ignore[no-untyped-call]
            self._session = None


def open_router(config: str) -> zenoh.Session:
    """Return a session that routes, with the threads that a router should have."""
    with _environment("ZENOH_RUNTIME", THREADS):
        return zenoh.open(zenoh.Config.from_json5(config))


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    """Set an environment variable for a while, unless the user has set it."""
    if name in os.environ:
        yield
        return
    os.environ[name] = value
    try:
        yield
    finally:
        del os.environ[name]


def free_endpoint() -> str:
    """Return a free endpoint of this machine."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
