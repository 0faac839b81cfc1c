"""Operations on operations of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.operations import Operation
from scm.records.page import Page


class OperationsNoun(Noun):
    """Operations on operations."""

    @operation("GET", "/api/v1/operations")
    def all_operations(self, *, limit: int = 100, cursor: str = "") -> Page[Operation]:
        """Long work, newest first."""

    @operation("GET", "/api/v1/operations/{name}")
    def one_operation(self, name: str) -> Operation:
        """One piece of work."""

    @operation("DELETE", "/api/v1/operations/{name}")
    def cancel(self, name: str, *, idempotency_key: str = "") -> Operation:
        """Cancel long work."""
