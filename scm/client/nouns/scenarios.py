"""Operations on scenarios of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.operations import Operation
from scm.records.page import Page
from scm.records.scenarios import Lines, Scenario


class ScenariosNoun(Noun):
    """Operations on scenarios."""

    @operation("GET", "/api/v1/scenarios")
    def all_scenarios(self, *, limit: int = 100, cursor: str = "") -> Page[Scenario]:
        """All scripts, one's own first."""

    @operation("GET", "/api/v1/scenarios/{name}")
    def one(self, name: str) -> Scenario:
        """One script with its text.

        Args:
            name: a script without .py
        """

    @operation("PUT", "/api/v1/scenarios/{name}")
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
            text: Python that drives the fleet, with `scm.fleet`
        """

    @operation("DELETE", "/api/v1/scenarios/{name}")
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
        """

    @operation("POST", "/api/v1/scenarios/{name}/runs")
    def run(
        self, name: str, *, arguments: tuple[str, ...] = (), idempotency_key: str = ""
    ) -> Operation:
        """Run a script.

        Args:
            name: a script without .py
            arguments: of its command line; {connect} becomes the address of this city's router
        """

    @operation("GET", "/api/v1/scenarios/runs/{run}/lines")
    def lines(self, run: str, *, after: int = 0) -> Lines:
        """What a run printed.

        Args:
            run: its operation
            after: number of the first line
        """
