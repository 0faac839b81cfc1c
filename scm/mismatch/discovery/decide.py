"""Whether a law outside the library is to be believed in place of what the library offers.

A law alone is held against the best listed model under one belief about noise: it must be the
better hypothesis by its price and a margin, and explain a part that no fit has seen better too.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from scm.arrays import Floats
from scm.mismatch.budget import Question
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect
from scm.mismatch.discovery.seek import Sought, criterion, seek
from scm.mismatch.discovery.sensor_effects import SensorEffect, SensorLikelihood
from scm.mismatch.fit.fitter import Fitted, Fitter
from scm.mismatch.fit.noise import Noise, calmed
from scm.mismatch.select.search import Search

MARGIN = 10.0  # a law that is hardly better than a known effect is that effect
MOST_BESIDE, SETTLED = 2, 2
HOPELESS = 50.0  # no belief about noise makes good so much
BY_FAR = 300.0  # what a listed effect more that hardly pays its price never makes good
Notify = Callable[[str], None]


def is_discovered(effect: object) -> bool:
    """Say whether an effect is a law outside the library."""
    return isinstance(effect, DictionaryEffect | SensorEffect)


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


@dataclass(frozen=True, slots=True)
class _Best:
    """The best law that was settled, None where none was near; what was asked, and all tried."""

    asked: tuple[Noise, tuple[str, ...], bytes, bytes]
    law: _Settled | None
    sought: Sought


class Lawful:
    """Holds laws outside the library against what a search finds.

    Args:
        search: Its model comes from `with_general_effect`.
        unseen: Weight of each innovation that no fit has seen, (events,); may be all zero.
        notify: Is told what is being tried.
    """

    def __init__(self, search: Search, unseen: Floats, notify: Notify = lambda _: None) -> None:
        self._search, self._unseen, self._notify = search, unseen, notify
        self._asked = False
        self._last: _Best | None = None
        self._won: _Best | None = None

    def explains_all(self, listed: Fitted) -> bool:
        """Say whether a law alone leaves nothing that listed effects could explain.

        Then no further ones need be looked for: it is better than the listed model by far, on what
        no fit has seen too, and no listed effect beside it is worth its price. It is asked once.

        Args:
            listed: The best listed model so far, settled under the noise believed now.
        """
        search, usual = self._search, self._search.model.noise
        if self._asked or not isinstance(search.model, SensorLikelihood):
            return False
        self._asked = True
        held = _settled(search, listed, self._unseen)
        found = self._best(listed)
        law = found.law
        if law and law.cost < held.cost - BY_FAR and not self._worse(law, held):
            search.model.believe(law.noise)
            step = search.extend(law.fitted)
            if not step.rivals or _price(search, step.rivals[0]) > _price(search, law.fitted):
                self._won = found
        search.model.believe(usual)
        return self._won is not None

    def decide(self, best: Fitted) -> tuple[Fitted, Sought | None]:
        """Return the better of a listed model and a law, with known effects beside it, settled.

        Where the budget ends before one could be held against the other, it is the listed model.

        Args:
            best: The listed model, or the car with its own numbers refitted.
        """
        search = self._search
        if not isinstance(search.model, SensorLikelihood):
            return best, None
        if self._won and self._won.law:
            search.model.believe(self._won.law.noise)
            return self._won.law.fitted, self._won.sought
        decided = search.within(Question.LAWS, partial(self._decided, best), best)
        if decided is None:
            return best, None
        better, law, sought = decided
        return (better if law is None else _with_known(search, law, self._unseen)), sought

    def _decided(self, best: Fitted) -> tuple[Fitted, _Settled | None, Sought | None]:
        """Return the better model alone, and as what it was settled and sought if it is a law."""
        search = self._search
        found = self._best(best)
        law = found.law
        if law is None:
            return best, None, None
        best = search.settle(best)  # as often as a law will be
        listed = _settled(search, best, self._unseen)
        if law.cost > listed.cost - MARGIN or self._worse(law, listed):
            search.model.believe(listed.noise)
            return best, None, None
        search.model.believe(law.noise)
        return law.fitted, law, found.sought

    def _best(self, listed: Fitted) -> _Best:
        """Return the best law beside the car without effects, sought under a calm belief.

        Asked again of the same model under the same belief, it is what was found then.
        """
        search, model, usual = self._search, self._search.model, self._search.model.noise
        calm = calmed(usual, model.drives)
        asked = calm, listed.names, listed.z.tobytes(), listed.values.tobytes()
        if self._last is None or self._last.asked != asked:
            model.believe(calm)
            sought = seek(model, _bare(search, listed), search.fitter.part, self._notify)
            settled = list[_Settled]()
            for fitted in _near(search, listed, sought.found):
                model.believe(calm)
                settled.append(_settled(search, search.settle(fitted), self._unseen))
            model.believe(usual)
            law = min(settled, key=lambda one: one.cost, default=None)
            self._last = _Best(asked, law, sought)
        return self._last

    def _worse(self, law: _Settled, listed: _Settled) -> bool:
        """Say whether a law explains what no fit has seen worse than the listed model."""
        return bool(self._unseen.any()) and law.unseen > listed.unseen


def _near(search: Search, best: Fitted, laws: Sequence[Fitted]) -> list[Fitted]:
    """Return the best laws that are not hopelessly worse, as noise is now.

    Neither than the listed model nor than the best law.
    """
    fitter = search.fitter
    e, _ = search.model([fitter.numbers(best.effects, best.z, best.values)])
    held = float(fitter.score(e, best.z)[0])
    least = min([held, *(law.q for law in laws[:1])])
    return [law for law in laws[:SETTLED] if law.q < least + HOPELESS]


def _with_known(search: Search, law: _Settled, unseen: Floats) -> Fitted:
    """Return a law with the listed effects that it leaves to be found."""
    for _ in range(MOST_BESIDE):
        more = search.within(Question.BESIDE, partial(_with_one, search, law, unseen))
        if more is None or more is law:
            break
        law = more
    return law.fitted


def _with_one(search: Search, law: _Settled, unseen: Floats) -> _Settled:
    """Return a law with the best listed effect beside it; the same where none pays."""
    step = search.extend(law.fitted)
    if not step.rivals or _price(search, step.rivals[0]) > _price(search, law.fitted):
        return law
    more = _settled(search, search.settle(step.rivals[0]), unseen)
    if more.cost > law.cost:
        search.model.believe(law.noise)
        return law
    return more


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
