"""Operations on audit of a city.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

from scm.client.operation import Noun, operation
from scm.records.audit import AuditRow, ChainVerdict
from scm.records.page import Page


class AuditNoun(Noun):
    """Operations on audit."""

    @operation("GET", "/api/v1/audit")
    def deeds(
        self,
        *,
        limit: int = 100,
        cursor: str = "",
        station: str = "",
        by: str = "",
        kind: str = "",
        text: str = "",
    ) -> Page[AuditRow]:
        """Entries, newest first.

        Args:
            station: who did it
            by: who requested it
            kind: part of class or path
            text: to be found in it
        """

    @operation("GET", "/api/v1/audit.{form}")
    def export(
        self,
        form: Literal["csv", "jsonl"],
        *,
        station: str = "",
        by: str = "",
        kind: str = "",
        text: str = "",
    ) -> bytes:
        """Entries as a file.

        Args:
            form: of the file
            station: who did it
            by: who requested it
            kind: part of class or path
            text: to be found in it
        """

    @operation("GET", "/api/v1/audit/verdict")
    def verdict(self, *, number: int = 0, digest: str = "") -> ChainVerdict:
        """Check the whole chain.

        Args:
            number: of an entry noted before; 0: none
            digest: its hash, noted before
        """
