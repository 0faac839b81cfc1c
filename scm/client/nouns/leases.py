"""Operations on leases of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection, part
from scm.records.leases import LeaseRow
from scm.records.page import Page
from scm.v2x.messages.lease_request import LeaseReply


class LeasesNoun:
    """Operations on leases."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def all_leases(self, *, limit: int = 100, cursor: str = "") -> Page[LeaseRow]:
        """Who drives which car.

        Args:
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET", "/api/v1/leases", Page[LeaseRow], query={"limit": limit, "cursor": cursor}
        )

    def one_lease(self, name: str) -> LeaseRow:
        """Who drives a car.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/leases/{part(name)}", LeaseRow)

    def take(
        self,
        name: str,
        *,
        program: str = "",
        ttl_ms: int = 1000,
        reason: str = "",
        idempotency_key: str = "",
    ) -> LeaseReply:
        """Take a car.

        Args:
            name: a name on the bus
            program: distinguishes programs of one caller: each holds its own leases
            ttl_ms: how long it lives unless renewed [ms]
            reason: why it is taken from whoever holds it; empty: only if it is free
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/leases/{part(name)}",
            LeaseReply,
            body={"program": program, "ttl_ms": ttl_ms, "reason": reason},
            key=idempotency_key,
        )

    def renew(
        self,
        name: str,
        *,
        program: str = "",
        epoch: int,
        ttl_ms: int = 1000,
        idempotency_key: str = "",
    ) -> LeaseReply:
        """Keep one's car.

        Args:
            name: a name on the bus
            program: as when it was taken
            epoch: as the lease was given
            ttl_ms: how long it lives unless renewed [ms]
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            f"/api/v1/leases/{part(name)}",
            LeaseReply,
            body={"program": program, "epoch": epoch, "ttl_ms": ttl_ms},
            key=idempotency_key,
        )

    def give_back(
        self, name: str, *, epoch: int, program: str = "", idempotency_key: str = ""
    ) -> LeaseReply:
        """Give one's car back.

        Args:
            name: a name on the bus
            epoch: as the lease was given
            program: as when it was taken
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "DELETE",
            f"/api/v1/leases/{part(name)}",
            LeaseReply,
            query={"epoch": epoch, "program": program},
            key=idempotency_key,
        )
