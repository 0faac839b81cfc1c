"""Operations on operations of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection, part
from scm.records.operations import Operation
from scm.records.page import Page


class OperationsNoun:
    """Operations on operations."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def all_operations(self, *, limit: int = 100, cursor: str = "") -> Page[Operation]:
        """Long work, newest first.

        Args:
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET", "/api/v1/operations", Page[Operation], query={"limit": limit, "cursor": cursor}
        )

    def one_operation(self, name: str) -> Operation:
        """One piece of work.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/operations/{part(name)}", Operation)

    def cancel(self, name: str, *, idempotency_key: str = "") -> Operation:
        """Cancel long work.

        Args:
            name: a name on the bus
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "DELETE", f"/api/v1/operations/{part(name)}", Operation, key=idempotency_key
        )
