"""What the city is: its map, for everybody who joins without having the file."""

from typing import ClassVar

from scm.records.city_map import CityMap
from scm.v2x.message import Delivery, Message


class WorldDefinition(Message, kw_only=True, frozen=True):
    """The map and the scale of the city; late joiners get it. The same is sent every 10 s."""

    KEY: ClassVar[str] = "world/def"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT

    t_ns: int
    seed: int
    map: CityMap


MESSAGE = WorldDefinition
