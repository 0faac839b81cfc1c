"""The configuration of Zenoh as JSON text, for a station and for the city's router.

There is no discovery on the network: a station knows its router's endpoint. Shared memory is off
(its start races under load), and a silent peer is dropped after one second, not ten.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

LEASE_MS = 1000
RETRY_FIRST_MS = 100
RETRY_MOST_MS = 500
_RETRY = {
    "period_init_ms": RETRY_FIRST_MS,
    "period_max_ms": RETRY_MOST_MS,
    "period_increase_factor": 2,
}

LARGEST_BYTES = 32 << 20
"""Of one message: a raw 4K picture. Zenoh's default is 1 GiB, and a thousand may be queued."""

# Batches that may wait for sending, by priority, before messages are dropped. Zenoh's default 2 is
# soon full of commands, which each have their own batch.
BURST = {"real_time": 16, "data_high": 16, "data": 16}


def client(
    endpoint: str, connect_timeout_s: float, transport: Mapping[str, Any] | None = None
) -> str:
    """Return the configuration of a station that reaches its city through one endpoint.

    `transport` holds its credentials, see `Credentials.client_settings`.
    """
    return json.dumps(
        _with(
            _both(),
            {
                "mode": "client",
                "connect": {
                    "endpoints": [endpoint],
                    "timeout_ms": round(connect_timeout_s * 1000),
                    "exit_on_failure": True,
                    "retry": _RETRY,
                },
                "transport": dict(transport or {}),
            },
        )
    )


def router(
    listen: Sequence[str],
    access: Mapping[str, Any] | None = None,
    connect: Sequence[str] = (),
) -> str:
    """Return the configuration of a router.

    Args:
        listen: Its endpoints.
        access: The access rules, see `access.router_settings`; None: everybody.
        connect: Endpoints of other routers. It connects to each as soon as it can, and again when
            the link is lost; it opens without them.
    """
    own = {
        "mode": "router",
        "listen": {"endpoints": list(listen)},
        "connect": {
            "endpoints": list(connect),
            "timeout_ms": -1,
            "exit_on_failure": False,
            "retry": _RETRY,
        },
    }
    return json.dumps(_with(_with(_both(), own), access or {}))


def never_waiting(link: str) -> dict[str, object]:
    """Return settings that drop what a link of this protocol cannot take at once.

    Otherwise a request that waits for a slow link holds up everything else of its sender.
    """
    rule = {
        "id": f"no waiting for {link}",
        "link_protocols": [link],
        "messages": ["put", "delete", "query"],
        "flows": ["egress"],
        "overwrite": {"congestion_control": "drop"},
    }
    return {"qos": {"network": [rule]}}


def _with(settings: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings merged with others, level by level."""
    laid = dict(settings)
    for name, value in more.items():
        below = laid.get(name)
        if isinstance(below, Mapping) and isinstance(value, Mapping):
            laid[name] = _with(below, value)
        else:
            laid[name] = value
    return laid


def _both() -> dict[str, Any]:
    off = {"enabled": False}
    return {
        "scouting": {"delay": 0, "multicast": off, "gossip": off},
        "transport": {
            "shared_memory": off,
            "link": {
                "tx": {"lease": LEASE_MS, "queue": {"size": BURST}},
                "rx": {"max_message_size": LARGEST_BYTES},
            },
        },
        "timestamping": {"enabled": True},
    }


def reason(cause: Exception) -> str:
    """Return Zenoh's error text without the place in its sources."""
    return str(cause).partition(" at /")[0]
