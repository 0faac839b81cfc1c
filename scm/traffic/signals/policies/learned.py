"""Learned: a callable of your own that gets what every policy gets and returns groups to be green.

    scm traffic MAP --learned my_module:decide

`decide(view)` gets a `LearnedView` and returns names of groups that do not conflict. It is named
when the process starts and never over the bus: it is code. When it raises, answers something else,
or leaves somebody who is called without green for `STARVED_NS`, the junction falls back to fixed
time and says so.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from scm.clock import NS_PER_S
from scm.errors import PlanError
from scm.traffic.signals.kernel import Phase
from scm.traffic.signals.policy import Answer, JunctionView, Policy, Site

STARVED_NS = 180 * NS_PER_S  # longest wait of a called group

Memory = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class LearnedView:
    """What the callable sees: the junction for good, and the view of this step."""

    site: Site
    view: JunctionView


def load_learned(name: str) -> Callable[[Any], Any]:
    """Return the callable that `module:function` names.

    Raises:
        PlanError: when there is none.
    """
    module_name, _, function = name.partition(":")
    try:
        found = getattr(importlib.import_module(module_name), function)
    except (ImportError, AttributeError, ValueError) as cause:
        msg = f"learned policy {name!r}: expected module:function that can be imported: {cause}"
        raise PlanError(msg) from cause
    if not callable(found):
        raise PlanError(f"learned policy {name!r}: got {found!r}, expected a function")
    decide: Callable[[Any], Any] = found
    return decide


def start(site: Site) -> Memory:
    """Begin with nobody waiting."""
    return (0,) * len(site.program.groups)


def step(site: Site, memory: Memory, view: JunctionView) -> tuple[Memory, Answer]:
    """Call the callable.

    Raises:
        PlanError: when there is none, or its answer is none or lets somebody starve.
    """
    if site.learned is None:
        raise PlanError("no callable was named: start with --learned module:function")
    requested = _checked(site, site.learned(LearnedView(site, view)))
    waits = tuple(
        wait + view.dt_ns if _waits(view, i, name) else 0
        for i, (name, wait) in enumerate(zip(site.program.groups, memory, strict=True))
    )
    if max(waits) > STARVED_NS:
        late = site.program.groups[waits.index(max(waits))]
        raise PlanError(f"group {late!r} is called and got no green for {STARVED_NS / 1e9:g} s")
    return waits, Answer(requested)


def _waits(view: JunctionView, number: int, name: str) -> bool:
    detector = view.detectors.get(name)
    is_green = view.state[number].phase is Phase.GREEN
    return detector is not None and detector.call and not is_green


def _checked(site: Site, answer: Any) -> frozenset[str]:
    groups = site.program.groups
    if isinstance(answer, str) or not isinstance(answer, list | tuple | set | frozenset):
        raise PlanError(f"got {answer!r}, expected names of groups")
    unknown = [name for name in answer if name not in groups]
    if unknown:
        raise PlanError(f"got {unknown}, expected groups of {list(groups)}")
    for pair in combinations(sorted(answer), 2):
        if frozenset(pair) in site.program.conflicts:
            raise PlanError(f"wishes {pair[0]!r} and {pair[1]!r} at once, which conflict")
    return frozenset(answer)


POLICY = Policy("learned: a callable of your own; falls back to fixed time", start, step)
