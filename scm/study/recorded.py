"""A city of a case that is recorded; being recorded changes nothing in it."""

from collections.abc import Iterable
from pathlib import Path

from scm.recorder.part import RecorderPart
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Part
from scm.study.case import MakeLockstep
from scm.v2x.faults import Faults


def recorded_lockstep(path: Path) -> MakeLockstep:
    """Return how to make a city that is recorded to a file."""

    def make(parts: Iterable[Part], faults: Faults | None) -> Lockstep:
        return Lockstep([*parts, RecorderPart(path)], faults=faults)

    return make
