"""Formulas of a description: however deep they are nested, they end in an answer or a sentence."""

import numpy as np
import pytest

from scm.errors import RecordingError
from scm.recording.expression import columns_of, evaluate

DEEP = ["-" * 990 + "a", "a" + "+a" * 480, "not " * 240 + "a", "abs(" * 150 + "a" + ")" * 150]
DEEP += ["a" + ".b" * 300, "a" + "[0]" * 300, "(" * 300 + "a" + ")" * 300, "a**" * 300 + "a"]


@pytest.mark.parametrize("text", DEEP, ids=lambda text: text[:6])
def test_what_is_nested_too_deep_is_refused_with_the_limit(text):
    for ask in (lambda: evaluate(text, {"a": np.ones(2)}, 2, "a.csv: where"),
                lambda: columns_of(text, "a.csv: where")):  # fmt: skip
        with pytest.raises(RecordingError, match=r"^a.csv: where: .*(too deep|nested)"):
            ask()


def test_ninety_levels_are_worked_out():
    assert evaluate("-" * 90 + "a", {"a": np.ones(2)}, 2, "x").tolist() == [1.0, 1.0]
    assert evaluate("a" + "+a" * 90, {"a": np.ones(2)}, 2, "x").tolist() == [91.0, 91.0]
