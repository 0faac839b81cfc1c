"""What to do about an effect, in a sentence for who has the car before them."""

import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from scm.mismatch.findings import Effect
from scm.mismatch.report.wording import capital, title_of

_UNLISTED = (
    "No known effect explains it, so look at what changes with {drivers}. Until the cause is "
    "found, car.toml holds the law as it was measured."
)
_LISTED = (
    "Hold the car against the numbers above, and correct the car file where they are right: "
    "car.toml has them."
)


def advice_of(effect: Effect) -> str:
    """Return what to check or mend; for an effect outside the library, where to look."""
    if effect.is_known:
        return _table().get(effect.name, _LISTED)
    return _UNLISTED.format(drivers=" and ".join(effect.depends_on) or "the drive")


def checks_of(names: Sequence[str]) -> list[str]:
    """Return what to check for each of several effects of which one is there."""
    table = _table()
    return [f"{capital(title_of(name))}: {table[name]}" for name in names if name in table]


@cache
def _table() -> Mapping[str, str]:
    path = Path(__file__).with_name("advice.toml")
    table: dict[str, str] = tomllib.loads(path.read_text(encoding="utf-8"))
    return table
