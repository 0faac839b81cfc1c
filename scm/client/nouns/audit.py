"""Operations on audit of a city.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

from scm.client.connection import Connection, part
from scm.records.audit import AuditRow, ChainVerdict
from scm.records.page import Page


class AuditNoun:
    """Operations on audit."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

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
        """Deeds, newest first.

        Args:
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
            station: who did it
            by: who asked
            kind: part of class or path
            text: to be found in it
        """
        return self._connection.request(
            "GET",
            "/api/v1/audit",
            Page[AuditRow],
            query={
                "limit": limit,
                "cursor": cursor,
                "station": station,
                "by": by,
                "kind": kind,
                "text": text,
            },
        )

    def export(
        self,
        form: Literal["csv", "jsonl"],
        *,
        station: str = "",
        by: str = "",
        kind: str = "",
        text: str = "",
    ) -> bytes:
        """Deeds as a file.

        Args:
            form: of the file
            station: who did it
            by: who asked
            kind: part of class or path
            text: to be found in it
        """
        return self._connection.fetch(
            f"/api/v1/audit.{part(form)}",
            query={"station": station, "by": by, "kind": kind, "text": text},
        )

    def verdict(self, *, number: int = 0, digest: str = "") -> ChainVerdict:
        """Check the whole chain.

        Args:
            number: of an entry noted before; 0: none
            digest: its hash, noted before
        """
        return self._connection.request(
            "GET", "/api/v1/audit/verdict", ChainVerdict, query={"number": number, "digest": digest}
        )
