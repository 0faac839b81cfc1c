"""What a law was held against: the best listed model, other listed effects, and other laws.

A law is chosen by what a hypothesis and the noise that it leaves cost together; so are its rivals.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from scm.mismatch.discovery.seek import Sought, criterion
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.findings import Alternative
from scm.mismatch.fit.fitter import Fitted
from scm.mismatch.select.search import Search

MOST_LISTED, MOST_LAWS = 4, 2
TIE = 6.0


@dataclass(frozen=True, slots=True)
class Standing:
    """What the library offered before a law took its place.

    Attributes:
        name: Of the best listed model, `grade and wind`; empty where no effect was worth its price.
        cost: Of that model, with the noise that it leaves; lower is better.
        behind: By how much other listed effects, each alone, cost more than that model, by name.
        unseen: Whether there was a part that no fit has seen, on which a law must be better too.
    """

    name: str
    cost: float
    behind: Mapping[str, float]
    unseen: bool


def standing(search: Search, listed: Fitted, *, unseen: bool) -> Standing:
    """Return how listed effects stand, under the noise that `listed` leaves.

    Later fits renew `listed` in place: this is to be asked before them.
    """
    behind = dict[str, float]()
    for step in search.steps[:1]:
        best = step.criteria[0] if listed.effects else search.criterion(step.base)
        for fitted, cost in zip(step.rivals, step.criteria, strict=True):
            name = fitted.names[-1]
            if name not in listed.names:
                behind[name] = min(max(cost - best, 0.0), behind.get(name, math.inf))
    return Standing(" and ".join(listed.names), _cost(search, listed), behind, unseen)


def alternatives_to_discovered(
    search: Search, best: Fitted, law: Candidate, held: Standing, sought: Sought
) -> tuple[float, tuple[Alternative, ...]]:
    """Return a law's probability among all that it was held against, and the next ones."""
    worse = held.cost - _cost(search, best)
    others = sorted(held.behind.items(), key=lambda one: one[1])[:MOST_LISTED]
    listed = [(name, worse + more) for name, more in others]
    if held.name:
        listed = [(held.name, worse), *listed[: MOST_LISTED - 1]]
    tried = sorted([*listed, *_other_laws(law, sought)], key=lambda one: one[1])
    weights = [math.exp(-0.5 * min(max(w, 0.0), 1400.0)) for _, w in tried]
    total = 1.0 + sum(weights)
    return 1.0 / total, tuple(
        Alternative(name=name, probability=weight / total,
              ruled_out_by=against(w, unseen=held.unseen and name == held.name))
        for (name, w), weight in zip(tried, weights, strict=True)
    )  # fmt: skip


def against(worse: float, *, unseen: bool = False) -> str:
    """Return what rules a rival out that costs so much more [squared standard deviations].

    Args:
        worse: Than what was found.
        unseen: Whether it explains a part that no fit has seen worse as well.
    """
    if worse < TIE:
        return "nothing in this recording"
    said = f"the recording: it explains it worse by {math.sqrt(worse):.1f} standard deviations"
    return f"{said}, and parts that no fit has seen worse too" if unseen else said


def _cost(search: Search, fitted: Fitted) -> float:
    """Return what a hypothesis and the noise believed now cost together."""
    sizes = float(search.fitter.part @ search.model.log_size)
    return criterion(fitted, search.events, len(search.listed)) + sizes


def _other_laws(law: Candidate, sought: Sought) -> Sequence[tuple[str, float]]:
    """Return other laws that were refitted, and how much more each costs; the best of a name."""
    tried = [(f.effects[-1], c) for f, c in zip(sought.found, sought.criteria, strict=True)]
    mine = next((c for effect, c in tried if effect is law), math.inf)
    found = dict[str, float]()
    for effect, c in tried:
        if effect.name != law.name and c > mine:
            found.setdefault(effect.name, c - mine)
    return list(found.items())[:MOST_LAWS]
