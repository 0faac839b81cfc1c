"""Records of operations.

Written by docs/make/client.py: do not change it here.
"""

import msgspec

from scm.client.records.shared import Operation


class PageOperation(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[Operation, ...]
    next_: str | None = msgspec.field(name="next")
