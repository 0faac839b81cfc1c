import dataclasses

import pytest

from scm.vehicles.param import LogNormal, Normal, Param


def test_a_parameter_cannot_be_changed_after_it_is_stated():
    param = Param("mass", 2.4, "kg", "body.mass_kg", (0.2, 60.0), "whole car", Normal(2.4, 0.5))
    with pytest.raises(dataclasses.FrozenInstanceError):
        param.default = 3.0


def test_a_parameter_may_be_fitted_unless_it_says_otherwise():
    assert Param("a", 1.0, "1", "x.a", (0.0, 2.0), "a", LogNormal(1.0, 0.5)).fit
