"""Whether a simulated car still drives."""

from enum import IntEnum

from scm.vehicles.body14 import STATUS_DIVERGED, STATUS_OK, STATUS_ROLLED


class VehicleStatus(IntEnum):
    """The state of a car in the kernel."""

    OK = STATUS_OK
    DIVERGED = STATUS_DIVERGED
    ROLLED = STATUS_ROLLED

    @property
    def sentence(self) -> str:
        """The state in words."""
        if self is VehicleStatus.OK:
            return "The car drives."
        if self is VehicleStatus.ROLLED:
            return "The car rolled over: it is frozen where it last stood on its wheels."
        return (
            "The car's motion left every physical range, or a command was no number: it is frozen "
            "where it last made sense."
        )
