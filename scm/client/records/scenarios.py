"""Records of scenarios.

Written by docs/make/client.py: do not change it here.
"""

import msgspec


class Scenario(msgspec.Struct, kw_only=True, frozen=True):
    """One script; `shipped`: it came with the program, and cannot be changed here.

    Attributes:
        name: What it is called.
        about: What it is for, in a sentence.
        shipped: Whether it came with the program: it cannot be changed.
        text: One sentence for a person.
    """

    name: str
    about: str
    shipped: bool
    text: str = ""


class PageScenario(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[Scenario, ...]
    next_: str | None = msgspec.field(name="next")


class Lines(msgspec.Struct, kw_only=True, frozen=True):
    """What a run printed; `first` is the number of the first line that is still known.

    Attributes:
        run: Id of a scenario's run.
        first: Number of the first of these.
        lines: What was printed, line by line.
    """

    run: str
    first: int
    lines: tuple[str, ...]
