"""All faults of a whole city, and the run that injects them one after the other."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from scm.errors import RunError, nearest
from scm.maps.load import load_map
from scm.selftest.city import CITY, City
from scm.selftest.city_fault import HEAD, FaultOutcome, StreamMonitor, Talker
from scm.selftest.links import commander, links
from scm.selftest.load import flood, fuzz, stuck
from scm.selftest.observer import Observer
from scm.selftest.processes import freezes, full_disk, kills, router
from scm.selftest.table import markdown_table, text_table

CityFault = Callable[[City, StreamMonitor], Iterator[FaultOutcome]]

CITY_FAULTS: dict[str, CityFault] = {
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


def inject_city_faults(
    map_name: str, wanted: Sequence[str], report: Callable[[str], None], out: Path | None
) -> int:
    """Start a city, inject these faults, report the outcomes; return the exit code.

    Raises:
        RunError: when a fault is not known, or the city does not come up.
    """
    for name in wanted:
        if name not in CITY_FAULTS:
            known = list(CITY_FAULTS)
            msg = f"fault: got {name!r}{nearest(name, known)}, expected one of {known}"
            raise RunError(msg)
    city_map = load_map(map_name)
    done: list[FaultOutcome] = []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        pulls = not wanted or not {"links", "commander"}.isdisjoint(wanted)
        behind = (AGENT, "traffic") if pulls else ()
        city = City(map_name, folder, agents=(AGENT,), behind=behind)
        stack.enter_context(city)
        observer = stack.enter_context(Observer(city_map, city.endpoint, CITY))
        talker = stack.enter_context(Talker(city.endpoint, CITY))
        observer.listen(WARM_S)
        for name in wanted or CITY_FAULTS:
            for outcome in CITY_FAULTS[name](city, StreamMonitor(observer, talker, (AGENT,))):
                done.append(outcome)
                report("  " + ", ".join(cell for cell in outcome.row() if cell))
    rows = [outcome.row() for outcome in done]
    report(text_table(HEAD, rows))
    if out is not None:
        out.write_text(markdown_table(HEAD, rows) + "\n")
    return 1 if any(outcome.missed for outcome in done) else 0
