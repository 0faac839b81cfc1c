"""Operations on misbehaviour of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.misbehaviour import Misbehaviour
from scm.v2x.messages.misbehaviour_report import MisbehaviourReport


class MisbehaviourNoun(Noun):
    """Operations on misbehaviour."""

    @operation("GET", "/api/v1/misbehaviour")
    def scores(self) -> Misbehaviour:
        """Scores of all stations, and who is reported."""

    @operation("GET", "/api/v1/misbehaviour/{name}")
    def report(self, name: str) -> MisbehaviourReport:
        """The newest report on a station, with its evidence."""
