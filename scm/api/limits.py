"""Limits: so many requests a caller, then 429 with the seconds to wait.

A caller is a key, or an address where there are no keys. Each has two buckets of tokens that refill
steadily, one for reading and one for changing. Answers report what is left, by the IETF's draft of
`RateLimit` headers. Never limited: the red stop, health, streams and teleoperation.
"""

import math
from collections import OrderedDict
from http import HTTPStatus
from typing import NamedTuple

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from scm.api.gate import caller_of
from scm.api.problem import problem
from scm.clock import Clock, seconds

MAX_CALLERS = 4096
FREE = ("/static/", "/healthz", "/readyz", "/api/v1/stop")
STREAMS = ("/stream", "/film", "/scan", ".bin")
_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})


class Policy(NamedTuple):
    """A bucket: how many tokens it holds, and how many come back a second."""

    name: str
    most: int
    per_s: float

    @property
    def header(self) -> str:
        """The policy as `RateLimit-Policy`: quota and the seconds in which it comes back."""
        return f'"{self.name}";q={self.most};w={math.ceil(self.most / self.per_s)}'


LOOKING = Policy("looking", 3000, 600.0)
CHANGING = Policy("changing", 600, 60.0)


class Buckets:
    """The tokens of every caller, under one policy; the one unheard of for longest is forgotten."""

    def __init__(self, policy: Policy, clock: Clock) -> None:
        self.policy = policy
        self._clock = clock
        self._left: OrderedDict[str, tuple[float, int]] = OrderedDict()

    def acquire(self, caller: str) -> tuple[float, float]:
        """Take a token, if there is one; return how many are left, and seconds to wait for one."""
        now_ns = self._clock.now_ns()
        left, at_ns = self._left.pop(caller, (float(self.policy.most), now_ns))
        left = min(self.policy.most, left + self.policy.per_s * seconds(now_ns - at_ns))
        wait_s = max(0.0, (1.0 - left) / self.policy.per_s)
        if wait_s == 0.0:
            left -= 1.0
        self._left[caller] = (left, now_ns)
        if len(self._left) > MAX_CALLERS:
            self._left.popitem(last=False)
        return left, wait_s


class Limited:
    """ASGI middleware behind the gate, which knows who calls."""

    def __init__(
        self, app: ASGIApp, *, clock: Clock, looking: Policy = LOOKING, changing: Policy = CHANGING
    ) -> None:
        self._app = app
        self._looking = Buckets(looking, clock)
        self._changing = Buckets(changing, clock)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request pass, or require its caller to wait."""
        if scope["type"] != "http" or _is_free(str(scope["path"])):
            await self._app(scope, receive, send)
            return
        buckets = self._looking if scope["method"] in _SAFE_METHODS else self._changing
        left, wait_s = buckets.acquire(caller_of(scope))
        policy = buckets.policy
        refill_s = math.ceil((policy.most - left) / policy.per_s)
        headers = {
            "RateLimit-Policy": policy.header,
            "RateLimit": f'"{policy.name}";r={math.floor(left)};t={refill_s}',
        }

        async def send_with_limits(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(headers)
            await send(message)

        if wait_s == 0.0:
            await self._app(scope, receive, send_with_limits)
            return
        detail = (
            f"more than {policy.per_s:g} requests a second ({policy.name}); wait {wait_s:.2g} s"
        )
        refused = problem(HTTPStatus.TOO_MANY_REQUESTS, "too_many", detail, instance=scope["path"])
        refused.headers["Retry-After"] = str(max(1, math.ceil(wait_s)))
        await refused(scope, receive, send_with_limits)


def _is_free(path: str) -> bool:
    return path.startswith(FREE) or path.endswith(STREAMS)
