"""All harms that are done to a whole city, and the run that does them one after the other."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from scm.errors import RunError, nearest
from scm.maps.load import load_map
from scm.selftest.city import CITY, City
from scm.selftest.harm import HEAD, Harm, Talker, Watch
from scm.selftest.links import commander, links
from scm.selftest.load import flood, fuzz, stuck
from scm.selftest.observer import Observer
from scm.selftest.processes import freezes, full_disk, kills, router
from scm.selftest.table import markdown_table, text_table

Harms = Callable[[City, Watch], Iterator[Harm]]

HARMS: dict[str, Harms] = {
    "kill": kills,
    "freeze": freezes,
    "router": router,
    "disk": full_disk,
    "links": links,
    "commander": commander,
    "stuck": stuck,
    "flood": flood,
    "fuzz": fuzz,
}
AGENT = "n3"
WARM_S = 8.0


def harm_city(
    map_name: str, wanted: Sequence[str], say: Callable[[str], None], out: Path | None
) -> int:
    """Start a city, do it these harms, tell what came of them; return the exit code.

    Raises:
        RunError: when a harm is not known, or the city does not come up.
    """
    for name in wanted:
        if name not in HARMS:
            msg = f"harm: got {name!r}{nearest(name, list(HARMS))}, expected one of {list(HARMS)}"
            raise RunError(msg)
    city_map = load_map(map_name)
    done: list[Harm] = []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        pulls = not wanted or not {"links", "commander"}.isdisjoint(wanted)
        behind = (AGENT, "traffic") if pulls else ()
        city = City(map_name, folder, agents=(AGENT,), behind=behind)
        stack.enter_context(city)
        observer = stack.enter_context(Observer(city_map, city.endpoint, CITY))
        talker = stack.enter_context(Talker(city.endpoint, CITY))
        observer.listen(WARM_S)
        for name in wanted or HARMS:
            for harm in HARMS[name](city, Watch(observer, talker, (AGENT,))):
                done.append(harm)
                say("  " + ", ".join(cell for cell in harm.row() if cell))
    rows = [harm.row() for harm in done]
    say(text_table(HEAD, rows))
    if out is not None:
        out.write_text(markdown_table(HEAD, rows) + "\n")
    return 1 if any(harm.missed for harm in done) else 0
