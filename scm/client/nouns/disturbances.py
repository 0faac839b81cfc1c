"""Operations on disturbances of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.disturbances import DisturbanceList


class DisturbancesNoun(Noun):
    """Operations on disturbances."""

    @operation("GET", "/api/v1/disturbances")
    def disturbances(self) -> DisturbanceList:
        """What made measurements void in the last hour, and does so now."""
