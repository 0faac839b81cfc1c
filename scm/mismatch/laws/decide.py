"""Whether a law outside the library is to be believed in place of what the library offers.

A law alone is held against the best listed model under one belief about noise: it must be the
better hypothesis by its price and a margin, and explain a part that no fit has seen better too.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.mismatch.fit import Fitted, Fitter
from scm.mismatch.laws.law import Law
from scm.mismatch.laws.seek import Sought, criterion, seek
from scm.mismatch.laws.sensed import Sensed, Sensing
from scm.mismatch.noise import Noise, calmed
from scm.mismatch.search import Search

MARGIN = 10.0  # a law that is hardly better than a known effect is that effect
MOST_BESIDE, SETTLED = 2, 2
HOPELESS = 50.0  # no belief about noise makes good so much
Tell = Callable[[str], None]


def is_law(effect: object) -> bool:
    """Say whether an effect is a law outside the library."""
    return isinstance(effect, Law | Sensed)


@dataclass(frozen=True, slots=True)
class _Settled:
    """A hypothesis under the noise that it leaves, and what both cost together.

    Attributes:
        unseen: Loss on the part that no fit has seen.
    """

    fitted: Fitted
    noise: Noise
    cost: float
    unseen: float


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
    usual = model.noise
    model.believe(calmed(usual, model.drives))
    sought = seek(model, _bare(search, best), search.fitter.part, tell)
    near = _near(search, best, sought.found)
    calm = model.noise
    model.believe(usual)
    if not near:
        return best, None
    best = search.settle(best)  # as often as a law will be
    listed, laws = _settled(search, best, unseen), list[_Settled]()
    for fitted in near:
        model.believe(calm)
        laws.append(_settled(search, search.settle(fitted), unseen))
    law = min(laws, key=lambda one: one.cost, default=listed)
    if law.cost > listed.cost - MARGIN or (unseen.any() and law.unseen > listed.unseen):
        model.believe(listed.noise)
        return best, None
    model.believe(law.noise)
    return _with_known(search, law, unseen), sought


def _near(search: Search, best: Fitted, laws: Sequence[Fitted]) -> list[Fitted]:
    """Return the best laws that are not hopelessly worse than the listed model, as noise is now."""
    fitter = search.fitter
    e, _ = search.model([fitter.numbers(best.effects, best.z, best.values)])
    held = float(fitter.score(e, best.z)[0])
    return [law for law in laws[:SETTLED] if law.q < held + HOPELESS]


def _with_known(search: Search, law: _Settled, unseen: Floats) -> Fitted:
    """Return a law with the listed effects that it leaves to be found."""
    for _ in range(MOST_BESIDE):
        step = search.extend(law.fitted)
        if not step.rivals or _price(search, step.rivals[0]) > _price(search, law.fitted):
            break
        more = _settled(search, search.settle(step.rivals[0]), unseen)
        if more.cost > law.cost:
            search.model.believe(law.noise)
            break
        law = more
    return law.fitted


def _bare(search: Search, best: Fitted) -> Fitted:
    """Return the car without effects, refitted under the noise that is believed now."""
    start = search.fitter.null(best.z)
    (base,) = search.fitter.refine([start], rounds=3, fresh=True)
    return base


def _price(search: Search, fitted: Fitted) -> float:
    return criterion(fitted, search.events, len(search.listed))


def _settled(search: Search, fitted: Fitted, unseen: Floats) -> _Settled:
    """Return a hypothesis with the noise believed now: whoever needs more noise pays for it."""
    sizes = search.model.log_size
    judge = Fitter(search.model, unseen)
    loss = float(judge.score(fitted.e[:, None], np.zeros_like(fitted.z))[0])
    cost = _price(search, fitted) + float(search.fitter.part @ sizes)
    return _Settled(fitted, search.model.noise, cost, loss + float(unseen @ sizes))
