"""Scenarios: scripts that the server runs."""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.records.body import Body

MOST_BYTES = 200_000


class Scenario(msgspec.Struct, kw_only=True, frozen=True):
    """One script; `shipped`: it came with the program, and cannot be changed here."""

    name: str
    about: str
    shipped: bool
    text: str = ""


class Lines(msgspec.Struct, kw_only=True, frozen=True):
    """What a run printed; `first` is the number of the first line that is still known."""

    run: str
    first: int
    lines: tuple[str, ...]


class ScenarioBody(Body, kw_only=True, frozen=True):
    """A script, whole."""

    text: Annotated[
        str,
        Meta(
            max_length=MOST_BYTES,
            description="Python that drives the fleet, with `scm.fleet`",
            examples=['"""Say hello."""\nprint("hello")\n'],
        ),
    ]


class RunBody(Body, kw_only=True, frozen=True):
    """How to run a script."""

    arguments: Annotated[
        tuple[Annotated[str, Meta(max_length=200, pattern="^[^\\x00]*$")], ...],
        Meta(
            max_length=50,
            description=(
                "of its command line; {connect} becomes the address of this city's router"
            ),
            examples=[["--live", "--connect", "{connect}"]],
        ),
    ] = ()
