"""One page of a list."""

from typing import Annotated, Generic, TypeVar

import msgspec

T = TypeVar("T")


class Page(msgspec.Struct, Generic[T], kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next: Cursor of those after them; null at the end.
    """

    items: tuple[T, ...]
    next: Annotated[str | None, msgspec.Meta(examples=["azptaXNtYXRjaC03"])]
