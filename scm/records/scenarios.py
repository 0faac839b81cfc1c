"""Scenarios: scripts that the server runs."""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.records.body import Body
from scm.records.fields import Name, Purpose, Text

MOST_BYTES = 200_000


class Scenario(msgspec.Struct, kw_only=True, frozen=True):
    """One script; `shipped`: it came with the program, and cannot be changed here.

    Attributes:
        shipped: Whether it came with the program: it cannot be changed.
    """

    name: Name
    about: Purpose
    shipped: bool
    text: Text = ""


class Lines(msgspec.Struct, kw_only=True, frozen=True):
    """What a run printed; `first` is the number of the first line that is still known.

    Attributes:
        first: Number of the first of these.
    """

    run: Annotated[str, Meta(description="Id of a scenario's run.", examples=["scenario-3"])]
    first: int
    lines: Annotated[
        tuple[str, ...],
        Meta(description="What was printed, line by line.", examples=[["n1 needed 12.4 s"]]),
    ]


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
