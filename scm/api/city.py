"""What every route is given: the view to read from, and a way to ask the city for changes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, TypeVar

from fastapi import Header, Path, Response

from scm.api.encoding import encode
from scm.api.problem import RefusedError
from scm.api.shelves import Shelves
from scm.api.view import CityView
from scm.maps.model import CityMap
from scm.v2x.message import Message, Refused, Request

ASK_TIMEOUT_S = 2.0

Ask = Callable[[Request, float], Message]
Name = Annotated[str, Path(pattern=r"^[a-z0-9_-]{1,32}$", description="a name on the bus")]
IdempotencyKey = Annotated[
    str,
    Header(
        alias="Idempotency-Key",
        max_length=128,
        description="same key, same effect, once: a retry gets the stored answer",
    ),
]
R = TypeVar("R", bound=Message)


@dataclass(frozen=True, slots=True)
class City:
    """One city as the web sees it.

    Attributes:
        send: Asks a request on the bus and waits for the reply, at most so many seconds.
        plans: Names of the signal plans each junction offers, beyond those that were seen.
        shelves: Folders that the interface reads and writes.
        connect: Endpoint of the city's router; empty: not known.
    """

    view: CityView
    send: Ask
    city_map: CityMap
    plans: Mapping[str, Sequence[str]] = field(default_factory=dict)
    shelves: Shelves = field(default_factory=Shelves)
    connect: str = ""

    def ask(self, request: Request, reply: type[R]) -> R:
        """Ask the city and return its answer; blocks, so only for routes in the thread pool.

        Raises:
            RefusedError: when the city says no, or does not answer in time.
        """
        answer = self.send(request, ASK_TIMEOUT_S)
        if isinstance(answer, Refused):
            raise RefusedError(answer)
        if not isinstance(answer, reply):
            kind = type(answer).__name__
            raise RefusedError(Refused(code="invalid_reply", detail=f"got a {kind} as the answer"))
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
    return RefusedError(Refused(code="not_found", detail=f"there is no {what} named {name!r}"))
