"""The city-wide stop."""

from typing import Annotated

from msgspec import Meta

from scm.records.body import Body, By, Reason


class StopBody(Body, kw_only=True, frozen=True):
    """The requested state: setting it twice is the same as once."""

    engaged: Annotated[bool, Meta(description="true: stop every car", examples=[True])]
    by: By = ""
    reason: Reason = ""
