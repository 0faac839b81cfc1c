"""Whether a law outside the library is to be believed in place of what the library offers.

A law alone is held against the best listed model under one belief about noise: it must be the
better hypothesis by its price and a margin, and explain a part that no fit has seen better too.
"""

from collections.abc import Callable

import numpy as np

from scm.arrays import Floats
from scm.mismatch.fit import Fitted, Fitter
from scm.mismatch.laws.law import Law
from scm.mismatch.laws.seek import Sought, criterion, seek
from scm.mismatch.laws.sensed import Sensed, Sensing
from scm.mismatch.search import Search

MARGIN = 10.0  # a law that is hardly better than a known effect is that effect
MOST_BESIDE = 2
Tell = Callable[[str], None]


def is_law(effect: object) -> bool:
    """Say whether an effect is a law outside the library."""
    return isinstance(effect, Law | Sensed)


def lawful(
    search: Search, best: Fitted, unseen: Floats, tell: Tell = lambda _: None
) -> tuple[Fitted, Sought | None]:
    """Return the better of a listed model and a law, with known effects beside the law, settled.

    Args:
        search: That found `best`; its model comes from `with_laws`.
        best: The listed model, or the car with its own numbers refitted.
        unseen: Weight of each innovation that no fit has seen, (events,); may be all zero.
        tell: Is told what is being tried.
    """
    model = search.model
    if not isinstance(model, Sensing):
        return best, None
    base = _bare(search, best)
    sought = seek(model, base, search.fitter.part, tell)
    if not sought.found or not _beats(search, sought.found[0], best, unseen):
        return best, None
    settled = search.settle(sought.found[0])
    for _ in range(MOST_BESIDE):
        step = search.extend(settled)
        if not step.rivals or _cost(search, step.rivals[0]) > _cost(search, settled):
            return settled, sought
        settled = search.settle(step.rivals[0])
    return settled, sought


def _bare(search: Search, best: Fitted) -> Fitted:
    """Return the car without effects, refitted under the noise that is believed now."""
    if not best.effects:
        return best
    start = search.fitter.null(best.z)
    (base,) = search.fitter.refine([start], rounds=3, fresh=True)
    return base


def _cost(search: Search, fitted: Fitted) -> float:
    return criterion(fitted, search.events, len(search.library))


def _beats(search: Search, law: Fitted, best: Fitted, unseen: Floats) -> bool:
    """Say whether a law is better than a listed model, by price and on an unseen part."""
    if _cost(search, law) > _cost(search, best) - MARGIN:
        return False
    judge = Fitter(search.model, unseen)
    losses = [float(judge.score(f.e[:, None], np.zeros_like(f.z))[0]) for f in (law, best)]
    return not unseen.any() or losses[0] < losses[1]
