"""Operations on neighbours of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.neighbours import Neighbours


class NeighboursNoun(Noun):
    """Operations on neighbours."""

    @operation("GET", "/api/v1/neighbours")
    def neighbours(self) -> Neighbours:
        """The neighbouring cities of the map."""
