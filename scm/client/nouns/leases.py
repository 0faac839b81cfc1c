"""Operations on leases of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.leases import LeaseRow
from scm.records.page import Page
from scm.v2x.messages.lease_request import LeaseReply


class LeasesNoun(Noun):
    """Operations on leases."""

    @operation("GET", "/api/v1/leases")
    def all_leases(self, *, limit: int = 100, cursor: str = "") -> Page[LeaseRow]:
        """Who drives which car."""

    @operation("GET", "/api/v1/leases/{name}")
    def one_lease(self, name: str) -> LeaseRow:
        """Who drives a car."""

    @operation("POST", "/api/v1/leases/{name}")
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
            program: distinguishes programs of one caller: each holds its own leases
            ttl_ms: how long it lives unless renewed [ms]
            reason: why it is taken over from its owner; empty: only if it is free
        """

    @operation("PUT", "/api/v1/leases/{name}")
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
            program: as when it was taken
            epoch: as the lease was given
            ttl_ms: how long it lives unless renewed [ms]
        """

    @operation("DELETE", "/api/v1/leases/{name}")
    def give_back(
        self, name: str, *, epoch: int, program: str = "", idempotency_key: str = ""
    ) -> LeaseReply:
        """Give one's car back.

        Args:
            epoch: as the lease was given
            program: as when it was taken
        """
