"""Made drives of a car that obeys a law outside the library, and what is found in them."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from scm.mismatch.discovery import decide
from scm.mismatch.discovery.decide import Discovery
from scm.mismatch.discovery.dictionary import dictionary
from scm.mismatch.discovery.general_effect import learned_terms
from scm.mismatch.discovery.sensor_effects import sensor_effects, signatures_of
from scm.mismatch.discovery.try_dictionary import try_dictionary
from scm.mismatch.effect_catalogue import candidates
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.select.round import Context, extend, fit_with_noise
from scm.mismatch.select.search import Selection, retune
from scm.mismatch.select.selected import Selected
from scm.replay.drive import Drive
from tests.unit.mismatch.made_drive import big_nigel, made_drive
from tests.unit.mismatch.made_fit import by_name

GUST = (1.0, 0.9, 4.0, 0.5)
GUST_NAME = "floor force against time"


@cache
def lawful_nigel():
    return big_nigel().with_terms(learned_terms(big_nigel()))


def law(name, curve):
    return next(x for x in dictionary() if x.name == name and x.shape.name == curve)


def gust():
    return law(GUST_NAME, "swing")


def side():
    return law("wheel angle against steering sign", "side")


def lawful_drive(numbers=(), seconds=7.0, **more):
    """A drive of a car whose general effect has these numbers."""
    recording = made_drive(tuple(dict(numbers).items()), seconds, car=lawful_nigel(), **more)
    return Drive(recording, lawful_nigel())


def tried_in(drive):
    """What the dictionary offers for a drive, beside the car with its own numbers refitted."""
    model = Likelihood.of([drive], lawful_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    (base,) = fitter.refine([fitter.unfitted()], rounds=2, fresh=True)
    return try_dictionary(base, np.ones(len(model.t)))


def context_of(drive):
    """A selection with two effects for a drive, and the part that it may not see."""
    model = Likelihood.of([drive], lawful_nigel())
    part = np.where(np.arange(len(model.t)) % 1000 < 800, 1.0, 0.0)
    catalogue = tuple(by_name(candidates(lawful_nigel()), n) for n in ("wind", "steer_trim"))
    return Context(part, catalogue), model, 1.0 - part


@cache
def gusty_drive():
    return lawful_drive(gust().numbers(GUST))


@dataclass(frozen=True)
class Gusty:
    """What a selection finds under a gust.

    Attributes:
        known: The best hypothesis of the catalogue, and `offered` how it stood.
        best: What was found in its place; `discovery`: what the dictionary offered.
    """

    selected: Selected
    known: Hypothesis
    best: Hypothesis
    discovery: Discovery


@cache
def gusty():
    """A round of a selection under a gust, and a discovered effect in place of what it found.

    It is long, so whoever asks about it stands in one file.
    """
    context, model, unseen = context_of(gusty_drive())
    retuned = retune(context, model)
    one = extend(context, retuned)
    known = fit_with_noise(context, one.alternatives[0])
    found = Selection(known, retuned, (one,))
    offered = decide.offered(context, found, has_unseen=True)
    best, discovery = decide.decide(context, found, unseen)
    selection = replace(found, best=best)
    drives, tried = model.drives, discovery
    chosen = Selected((), drives, lawful_nigel(), context, None, selection, (), offered, tried)
    return Gusty(chosen, known, best, discovery)


@cache
def discovered():
    """A selection under a gust without an effect yet, and what the dictionary offers beside it."""
    context, model, unseen = context_of(gusty_drive())
    retuned = retune(context, model)
    found = Selection(retuned, retuned)
    return context, found, unseen, decide.discover(context, found, unseen)


@cache
def lens():
    """A camera whose scale grows with |x|, as a cheap lens."""
    model = Likelihood.of([lawful_drive(seconds=14.0, sense=_bent())], lawful_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    (base,) = fitter.refine([fitter.unfitted()], rounds=2, fresh=True)
    fitter = fitter.under(model.with_signatures(signatures_of(base)))
    effect = sensor_effects()[0]
    (found,) = fitter.refine(fitter.begin(base, [((effect,), np.array([0.01]))]), rounds=3)
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
    return tried_in(lawful_drive())
