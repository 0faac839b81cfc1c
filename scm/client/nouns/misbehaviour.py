"""Operations on misbehaviour of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection, part
from scm.records.misbehaviour import Misbehaviour
from scm.v2x.messages.misbehaviour_report import MisbehaviourReport


class MisbehaviourNoun:
    """Operations on misbehaviour."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def scores(self) -> Misbehaviour:
        """Scores of all stations, and who is reported."""
        return self._connection.request("GET", "/api/v1/misbehaviour", Misbehaviour)

    def report(self, name: str) -> MisbehaviourReport:
        """The newest report on a station, with its evidence.

        Args:
            name: a name on the bus
        """
        return self._connection.request(
            "GET", f"/api/v1/misbehaviour/{part(name)}", MisbehaviourReport
        )
