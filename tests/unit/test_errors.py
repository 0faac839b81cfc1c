"""The errors: one tree, each also the builtin that a caller would expect."""

import inspect

import pytest

from scm import errors
from scm.errors import ScmError, nearest

KINDS = [
    thing
    for thing in vars(errors).values()
    if inspect.isclass(thing) and issubclass(thing, ScmError) and thing is not ScmError
]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_each_error_is_one_of_ours_and_a_builtin(kind):
    ours, builtin = kind.__bases__
    assert ours is ScmError
    assert builtin.__module__ == "builtins"


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_each_error_stands_in_the_tree_that_the_module_draws(kind):
    lines = [line for line in errors.__doc__.splitlines() if kind.__name__ in line]
    assert len(lines) == 1
    assert kind.__bases__[1].__name__ in lines[0]


def test_a_near_name_is_suggested():
    assert nearest("driving_shool", ["driving_school", "parking"]) == (
        " (did you mean 'driving_school'?)"
    )


def test_nothing_is_suggested_when_nothing_is_near():
    assert nearest("zzz", ["driving_school"]) == ""
