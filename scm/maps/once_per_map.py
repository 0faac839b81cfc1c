"""What follows from a map alone is computed once for it: cities made one after another share it."""

from collections import OrderedDict
from collections.abc import Callable
from functools import wraps
from threading import Lock
from typing import Concatenate, ParamSpec, TypeVar

from scm.records.city_map import CityMap

P = ParamSpec("P")
T = TypeVar("T")
MAX_MAPS = 4  # a study's cases vary one map; its other maps come and go


def once_per_map(
    make: Callable[Concatenate[CityMap, P], T],
) -> Callable[Concatenate[CityMap, P], T]:
    """Return a function that remembers its results for the last few maps, by identity.

    Results must not be changed by whoever gets them. Maps are told apart by identity, as comparing
    or hashing a large one takes longer than most of what is computed from it.
    """
    found: OrderedDict[tuple[int, object], tuple[CityMap, T]] = OrderedDict()
    lock = Lock()

    @wraps(make)
    def remembered(city_map: CityMap, /, *args: P.args, **kwargs: P.kwargs) -> T:
        key = (id(city_map), (args, tuple(kwargs.items())))
        with lock:
            if key in found:
                found.move_to_end(key)
                return found[key][1]
        made = make(city_map, *args, **kwargs)
        with lock:
            found[key] = (city_map, made)  # the map too: its id stays its own
            while len(found) > MAX_MAPS:
                found.popitem(last=False)
        return made

    return remembered
