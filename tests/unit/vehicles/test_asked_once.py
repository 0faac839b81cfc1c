"""What numba's operators give is worked out once for the same types, and again for others."""

import operator

import pytest
from numba import float64, int64
from numba.core.errors import TypingError
from numba.core.registry import cpu_target
from numba.extending import overload

from scm.vehicles import jit


@pytest.fixture
def give():
    """Return what looking into something gives for types, as numba's compiler asks."""
    jit.load_compiler()
    context = cpu_target.typing_context
    look = context.resolve_value_type(operator.getitem)
    return lambda *types: look.get_call_type(context, types, {})


def test_the_same_question_is_answered_once(give):
    assert give(float64[:], int64) is give(float64[:], int64)


def test_other_types_are_another_question(give):
    assert give(float64[:], int64).return_type == float64
    assert give(int64[:], int64).return_type == int64


def test_what_cannot_be_is_refused_each_time(give):
    for _ in range(2):
        with pytest.raises(TypingError):
            give(float64, int64)


def test_a_rule_that_comes_later_is_known_after_a_refresh():
    jit.load_compiler()

    def halved(x):
        return 0.5 * x

    @overload(halved)
    def _give(x):
        return lambda x: 0.5 * x

    context = cpu_target.typing_context
    cpu_target.target_context.refresh()
    assert context.resolve_value_type(halved).get_call_type(context, (float64,), {})
