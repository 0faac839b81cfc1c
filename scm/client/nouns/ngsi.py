"""Operations on ngsi of a city.

Written by docs/make/client.py: do not change it here.
"""

from typing import Any, Literal

from scm.client.operation import Noun, operation


class NgsiNoun(Noun):
    """Operations on ngsi."""

    @operation("GET", "/ngsi-ld/v1/entities")
    def all_entities(
        self,
        *,
        type_: str = "",
        limit: int = 20,
        offset: int = 0,
        count: bool = False,
        options: Literal["", "normalized", "keyValues", "simplified"] = "",
    ) -> tuple[dict[str, Any], ...]:
        """NGSI-LD entities of the city.

        Args:
            type_: comma between: Vehicle, RoadSegment, TrafficFlowObserved; none: all
            offset: to skip
            count: return how many there are in all
            options: `keyValues`, `simplified`: attributes are their values
        """

    @operation("GET", "/ngsi-ld/v1/entities/{entity}")
    def one_entity(
        self, entity: str, *, options: Literal["", "normalized", "keyValues", "simplified"] = ""
    ) -> dict[str, Any]:
        """One NGSI-LD entity.

        Args:
            entity: its urn
            options: `keyValues`, `simplified`: attributes are their values
        """
