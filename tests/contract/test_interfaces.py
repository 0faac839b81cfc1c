"""What programs of other people rely on changes only where somebody means it to."""

import json

import pytest

from tests.contract.interfaces import FOLDER, PARTS, meaning, text_of


@pytest.mark.parametrize("part", PARTS)
def test_an_interface_is_as_it_was_written_down(part: str) -> None:
    """After a change that is meant: python -m tests.contract.interfaces, and look at the diff."""
    before = json.loads((FOLDER / f"{part}.json").read_text(encoding="utf-8"))
    now = json.loads(text_of(part))
    assert sorted(now) == sorted(before)
    for name, content in before.items():
        if part == "rest":
            assert meaning(now[name]) == meaning(content), f"{part}: {name}"
        else:
            assert now[name] == content, f"{part}: {name}"
