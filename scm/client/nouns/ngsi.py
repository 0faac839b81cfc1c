"""Operations on ngsi of a city.

Written by docs/make/client.py: do not change it here.
"""

from typing import Any, Literal

from scm.client.connection import Connection, part


class NgsiNoun:
    """Operations on ngsi."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

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
            limit: at most
            offset: to skip
            count: tell how many there are in all
            options: `keyValues`, `simplified`: attributes are their values
        """
        return self._connection.request(
            "GET",
            "/ngsi-ld/v1/entities",
            tuple[dict[str, Any], ...],
            query={
                "type": type_,
                "limit": limit,
                "offset": offset,
                "count": count,
                "options": options,
            },
        )

    def one_entity(
        self, entity: str, *, options: Literal["", "normalized", "keyValues", "simplified"] = ""
    ) -> dict[str, Any]:
        """One NGSI-LD entity.

        Args:
            entity: its urn
            options: `keyValues`, `simplified`: attributes are their values
        """
        return self._connection.request(
            "GET",
            f"/ngsi-ld/v1/entities/{part(entity)}",
            dict[str, Any],
            query={"options": options},
        )
