"""Operations on scenarios of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection, part
from scm.records.operations import Operation
from scm.records.page import Page
from scm.records.scenarios import Lines, Scenario


class ScenariosNoun:
    """Operations on scenarios."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def all_scenarios(self, *, limit: int = 100, cursor: str = "") -> Page[Scenario]:
        """All scripts, one's own first.

        Args:
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET", "/api/v1/scenarios", Page[Scenario], query={"limit": limit, "cursor": cursor}
        )

    def one(self, name: str) -> Scenario:
        """One script with its text.

        Args:
            name: a script without .py
        """
        return self._connection.request("GET", f"/api/v1/scenarios/{part(name)}", Scenario)

    def write(
        self,
        name: str,
        *,
        if_match: str | None = None,
        if_none_match: str | None = None,
        text: str,
        idempotency_key: str = "",
    ) -> Scenario:
        """Write a script.

        Args:
            name: a script without .py
            if_match: ETag of the state that was edited; `*`: whichever there is
            if_none_match: `*`: only where there is none yet
            text: Python that drives the fleet, with `scm.fleet`
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            f"/api/v1/scenarios/{part(name)}",
            Scenario,
            headers={"if-match": if_match, "if-none-match": if_none_match},
            body={"text": text},
            key=idempotency_key,
        )

    def remove(
        self,
        name: str,
        *,
        if_match: str | None = None,
        if_none_match: str | None = None,
        idempotency_key: str = "",
    ) -> None:
        """Delete a script.

        Args:
            name: a script without .py
            if_match: ETag of the state that was edited; `*`: whichever there is
            if_none_match: `*`: only where there is none yet
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        self._connection.send_only(
            "DELETE",
            f"/api/v1/scenarios/{part(name)}",
            headers={"if-match": if_match, "if-none-match": if_none_match},
            key=idempotency_key,
        )

    def run(
        self, name: str, *, arguments: tuple[str, ...] = (), idempotency_key: str = ""
    ) -> Operation:
        """Run a script.

        Args:
            name: a script without .py
            arguments: of its command line; {connect} becomes the address of this city's router
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/scenarios/{part(name)}/runs",
            Operation,
            body={"arguments": arguments},
            key=idempotency_key,
        )

    def lines(self, run: str, *, after: int = 0) -> Lines:
        """What a run printed.

        Args:
            run: its operation
            after: number of the first line
        """
        return self._connection.request(
            "GET", f"/api/v1/scenarios/runs/{part(run)}/lines", Lines, query={"after": after}
        )
