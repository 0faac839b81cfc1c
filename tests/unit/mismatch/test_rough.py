"""Judging by strides: a rare effect gives way to usual ones that explain more together."""

from types import SimpleNamespace

import numpy as np
import pytest

from scm.mismatch.budget import Budget
from scm.mismatch.fit.fitter import Fitted
from scm.mismatch.select.many_effects import ManyEffectsSearch
from scm.mismatch.select.search import Step
from tests.unit.mismatch.made_fit import candidate

NONE = np.zeros(0)


def hypothesis(*names):
    effects = tuple(candidate(name) for name in names)
    return Fitted(effects, NONE, np.zeros(sum(len(e.parameters) for e in effects)), NONE, 0.0, NONE)


class Scripted(ManyEffectsSearch):
    """A round finds a slope, or where slopes are not listed two usual effects, at given costs."""

    def __init__(self, costs):
        names = ("grade", "steer_trim", "pose_heading")
        self.listed, self.costs = tuple(candidate(name) for name in names), costs
        self.model = SimpleNamespace(noise="at first", believe=self.believe)
        self.steps, self.notify, self.budget = [], lambda _: None, Budget()

    def believe(self, noise):
        self.model.noise = noise

    retuned = hypothesis()

    def extend(self, base):
        found = [e.name for e in self.listed if e.name not in base.names]
        self.believe(f"of {found}")
        return Step(base, tuple(hypothesis(*base.names, name) for name in found), (0.0,))

    def _compared(self, step):
        return step

    def _at_once(self, step):
        usual = step.rivals[:1] if step.rivals and step.rivals[0].effects[-1].rare else step.rivals
        return [Step(step.base, (one,), (0.0,)) for one in usual if not step.base.effects]

    def _joined(self, base, found):
        return hypothesis(*base.names, *(f.names[-1] for f in found))

    def settle(self, fitted):
        self.believe(f"beside {fitted.names}")
        return fitted

    def prune(self, fitted):
        return fitted

    def _without_each(self, fitted):
        return [hypothesis(*(n for n in fitted.names if n != gone)) for gone in fitted.names]

    def _with_noise(self, fitted):
        return self.costs[fitted.names]


SLOPE, USUAL = ("grade",), ("steer_trim", "pose_heading")


@pytest.mark.parametrize(("cost", "names"), [(-1.0, USUAL), (1.0, SLOPE)])
def test_a_rare_effect_gives_way_to_usual_ones_that_explain_more(cost, names):
    search = Scripted({SLOPE: 0.0, USUAL: cost})
    found = search.run()
    assert found.names == names
    assert candidate("grade") in search.listed
    taken = {step.rivals[0].names[-1] for step in search.steps}
    assert taken >= set(names)


def test_noise_is_believed_that_goes_with_the_effects_kept():
    for cost, names in ((-1.0, USUAL), (1.0, SLOPE)):
        search = Scripted({SLOPE: 0.0, USUAL: cost})
        assert search._usually(search.settle(hypothesis(*SLOPE)), ()).names == names
        assert search.model.noise == f"beside {names}"


def test_a_rare_effect_that_stood_already_is_not_questioned_again():
    search = Scripted({SLOPE: 0.0, USUAL: -1.0})
    assert search._usually(hypothesis(*SLOPE), SLOPE).names == SLOPE
