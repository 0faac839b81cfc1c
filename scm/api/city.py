"""What every route receives: the view to read from, and a way to request changes of the city."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Annotated, TypeVar

from fastapi import Header, Path, Response

from scm.api.encoding import encode
from scm.api.folders import Folders
from scm.api.problem import RefusedError
from scm.api.view import CityView
from scm.api.wire import Wire
from scm.clock import Clock
from scm.records.city_map import CityMap
from scm.v2x.message import Message, Refused, Request

REQUEST_TIMEOUT_S = 2.0

SendRequest = Callable[[Request, float], Message]
Name = Annotated[
    str, Path(pattern=r"^[a-z0-9_-]{1,32}$", description="a name on the bus", examples=["n1"])
]
IdempotencyKey = Annotated[
    str,
    Header(
        alias="Idempotency-Key",
        max_length=128,
        description="same key, same effect, once: a retry gets the stored answer",
        examples=["6f1c2f0e-0b5e-4d0e-9d55-7d1f6f6c2b1a"],
    ),
]
R = TypeVar("R", bound=Message)


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """What the server knows of its own connection to the bus, and of its city's start.

    Attributes:
        city: Chunk of all keys of the city on the bus; empty: as its map is called.
        is_connected: Whether the router can be reached now.
        rejected: How many arrivals were dropped because they could not be read.
        clock: That of the view's runner; None: time stands still between its steps.
        wire: Publishes commands on the bus; None: nobody can be driven from here.
        connect: Endpoint of the city's router, for scripts run beside it; empty: not known.
        script_credentials: File of who those scripts are; None: an open city.
        words: Arguments that give a program the bus's address and its identity; empty: such a
            program cannot reach the city.
        parts: Those that should be there, by name.
        map_file: Name or path of the map, as passed to other programs; empty: its own name.
    """

    city: str = ""
    is_connected: Callable[[], bool] = lambda: True
    rejected: Callable[[], int] = lambda: 0
    clock: Clock | None = None
    wire: Wire | None = None
    connect: str = ""
    script_credentials: FilePath | None = None
    words: Sequence[str] = ()
    parts: Sequence[str] = ()
    map_file: str = ""


@dataclass(frozen=True, slots=True)
class City:
    """One city as the web sees it.

    Attributes:
        send: Sends a request on the bus and waits for the reply, at most so many seconds.
        plans: Names of the signal plans each junction offers, beyond those that were seen.
        folders: Folders that the interface reads and writes.
        link: Its connection to the bus.
    """

    view: CityView
    send: SendRequest
    city_map: CityMap
    plans: Mapping[str, Sequence[str]] = field(default_factory=dict)
    folders: Folders = field(default_factory=Folders)
    link: Link = field(default_factory=Link)

    @property
    def name(self) -> str:
        """What the city is called."""
        return self.link.city or self.city_map.name

    @property
    def wire(self) -> Wire | None:
        """Publishes commands on the bus; None: nobody can be driven from here."""
        return self.link.wire

    def now_ns(self) -> int:
        """Return the present time, by the clock of the view's runner [ns]."""
        stepped_ns = self.view.picture().now_ns
        return stepped_ns if self.link.clock is None else max(stepped_ns, self.link.clock.now_ns())

    def call(self, request: Request, reply: type[R]) -> R:
        """Send a request and return the reply; blocks, so only for routes in the thread pool.

        Raises:
            RefusedError: when the city refuses, or does not reply in time.
        """
        answer = self.send(request, REQUEST_TIMEOUT_S)
        if isinstance(answer, Refused):
            raise RefusedError(answer)
        if not isinstance(answer, reply):
            kind = type(answer).__name__
            raise RefusedError.of("invalid_reply", f"got a {kind} as the answer")
        return answer


def json_response(
    body: object, status: int = 200, headers: Mapping[str, str] | None = None
) -> Response:
    """Return `body` as JSON that no cache keeps."""
    return Response(
        encode(body),
        status,
        {"Cache-Control": "no-store", **(headers or {})},
        media_type="application/json",
    )


def not_found(what: str, name: str) -> RefusedError:
    """Return the error for a name that the city does not know."""
    return RefusedError.of("not_found", f"there is no {what} named {name!r}")
