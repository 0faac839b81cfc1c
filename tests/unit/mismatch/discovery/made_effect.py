"""Made drives of a car that obeys a law outside the library, and what is found in them."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from scm.mismatch.discovery.decide import Lawful
from scm.mismatch.discovery.dictionary import dictionary
from scm.mismatch.discovery.general_effect import learned_terms
from scm.mismatch.discovery.seek import Sought, seek, with_general_effect
from scm.mismatch.discovery.sensor_effects import SensorLikelihood, sensor_effects
from scm.mismatch.effect_catalogue import by_name, candidates
from scm.mismatch.fit.fitter import Fitted, Fitter
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.select.alternatives import Standing, standing
from scm.mismatch.select.search import Search
from scm.replay.drive import Drive
from tests.unit.mismatch.made_drive import big_nigel, made_drive

GUST = (1.0, 0.9, 4.0, 0.5)
GUST_NAME = "floor force against time"


@cache
def lawful_nigel():
    return big_nigel().with_terms(learned_terms(big_nigel()))


def law(name, curve):
    return next(x for x in dictionary() if x.name == name and x.curve.name == curve)


def gust():
    return law(GUST_NAME, "swing")


def side():
    return law("wheel angle against steering sign", "side")


def lawful_drive(numbers=(), seconds=12.0, **more):
    """A drive of a car whose general effect has these numbers."""
    recording = made_drive(tuple(dict(numbers).items()), seconds, car=lawful_nigel(), **more)
    return Drive(recording, lawful_nigel())


def sought(drive):
    """What is found in a drive, beside the car with its own numbers refitted."""
    model = Likelihood([drive], lawful_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    (base,) = fitter.refine([fitter.null()], rounds=2, fresh=True)
    return seek(model, base, np.ones(len(model.t)))


def searched(drive):
    """A search with two effects through a drive, and the part that it may not see."""
    return _search(with_general_effect(Likelihood([drive], lawful_nigel())))


def _search(model):
    part = np.where(np.arange(len(model.t)) % 1000 < 800, 1.0, 0.0)
    library = tuple(by_name(candidates(lawful_nigel()), n) for n in ("wind", "steer_trim"))
    return Search(model, part, library, lambda _: None), 1.0 - part


@cache
def gusty_drive():
    return lawful_drive(gust().numbers(GUST))


@dataclass(frozen=True)
class Gusty:
    """What a search finds under a gust.

    Attributes:
        listed: The listed model, and `held` how it stood before a law took its place.
        best: What was taken in its place; `sought`: the laws that were tried.
    """

    search: Search
    listed: Fitted
    held: Standing
    best: Fitted
    sought: Sought


@cache
def gusty():
    """A round of a search under a gust, and a law in place of what it took.

    It is long, so whoever asks about it stands in one file.
    """
    search, unseen = searched(gusty_drive())
    search.steps.append(search.extend(search.retuned))
    listed = search.settle(search.steps[0].rivals[0])
    held = standing(search, listed, unseen=True)
    return Gusty(search, listed, held, *Lawful(search, unseen).decide(listed))


@cache
def _asked():
    search, unseen = searched(gusty_drive())
    listed, noise = search.retuned, search.model.noise
    return search.model, listed, noise, Lawful(search, unseen)._best(listed)


def asked():
    """A search under a gust with its own numbers fitted, and the laws that were sought beside them.

    Both are made once: everybody gets copies, for later fits renew what was found in place.
    """
    model, listed, noise, best = _asked()
    model.believe(noise)
    search, unseen = _search(model)
    search.retuned, laws = replace(listed), Lawful(search, unseen)
    laws._last = replace(best, law=replace(best.law, fitted=replace(best.law.fitted)))
    return search, laws


@cache
def lens():
    """A camera whose scale grows with |x|, as a cheap lens."""
    drive = lawful_drive(seconds=30.0, sense=_bent())
    model = SensorLikelihood(Likelihood([drive], lawful_nigel()), lawful_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    (base,) = fitter.refine([fitter.null()], rounds=2, fresh=True)
    model.learn(fitter.numbers((), base.z, base.values))
    law = sensor_effects()[0]
    (found,) = fitter.refine(fitter.begin(base, [((law,), np.array([0.01]))]), rounds=3)
    return model, base, found


def _bent(size=0.05):
    """Spoil x as it comes, and y by the x of the same samples."""
    true_x = []

    def sense(name, _, values):
        if name == "pose.x":
            true_x.append(values)
            return values * (1.0 + size * np.abs(values))
        if name == "pose.y":
            return values * (1.0 + size * np.abs(true_x[0]))
        return values

    return sense


@cache
def healthy():
    return sought(lawful_drive())
