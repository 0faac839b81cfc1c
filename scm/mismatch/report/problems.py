"""Problems of the recording as the first screen shows them: alike ones once."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from scm.data_quality.problem import DataProblem, Span
from scm.mismatch.evidence import Evidence
from scm.mismatch.findings import Diagnosis
from scm.mismatch.report.places import sensors, spans
from scm.mismatch.report.verdict_text import other_problems, pressing_problems
from scm.mismatch.report.wording import capital, joined

_MOST_CARDS = 4
_NO_VERDICT = "no_verdict"


@dataclass(slots=True)
class Alike:
    """What is wrong with several channels or recordings in the same way."""

    name: str
    said: str
    record_instead: str
    channels: list[str]
    recordings: list[str]
    when_s: tuple[Span, ...] | None

    def title(self) -> str:
        """Return the problem and where it is."""
        if self.name == _NO_VERDICT:
            return "Why there is no verdict"
        words = capital(self.name.replace("_", " "))
        channels = list(dict.fromkeys(self.channels))
        return words if channels in ([""], ["*"]) else f"{words}: {sensors(channels)}"

    def rows(self) -> list[tuple[str, str]]:
        """Return what to say of it."""
        when = capital(spans(self.when_s)) if self.when_s else ""
        where = joined(list(dict.fromkeys(filter(None, self.recordings))))
        return [
            ("What", self.said),
            ("In", where),
            ("When", when),
            ("Record instead", self.record_instead),
        ]


def alike(problems: Sequence[DataProblem], evidence: Evidence) -> list[Alike]:
    """Return problems, those that say the same of several channels or recordings together."""
    found: dict[tuple[object, ...], Alike] = {}
    for problem in problems:
        recording, said = of_recording(problem.text, evidence)
        key = (problem.name, said, problem.record_instead, problem.when_s)
        one = found.setdefault(
            key, Alike(problem.name, said, problem.record_instead, [], [], problem.when_s)
        )
        one.channels.append(problem.channel)
        one.recordings.append(recording)
    return list(found.values())


def of_recording(said: str, evidence: Evidence) -> tuple[str, str]:
    """Return the recording that a sentence begins with, if it does, and the sentence."""
    for name in evidence.recordings:
        if said.startswith(f"{name}: "):
            return name, said.removeprefix(f"{name}: ")
    return "", said


def problem_cards(
    diagnosis: Diagnosis, evidence: Evidence
) -> Iterator[tuple[str, Sequence[tuple[str, str]]]]:
    """Yield title and rows of what stands in the verdict's way or can be avoided next time.

    The first few of them: a list of twenty is read by nobody, and all stand below.
    """
    for one in alike(pressing_problems(diagnosis), evidence)[:_MOST_CARDS]:
        yield one.title(), one.rows()


def other_problems_said(diagnosis: Diagnosis, evidence: Evidence) -> str:
    """Return one line about the other problems; nothing where there are none."""
    fixed = _named(alike(other_problems(diagnosis, corrected=True), evidence))
    noticed = _named(alike(other_problems(diagnosis, corrected=False), evidence))
    said = f"Put right in the recording before the car was blamed: {fixed}. " if fixed else ""
    return said + (f"Noticed in the recording, and left as it is: {noticed}. " if noticed else "")


def _named(problems: Sequence[Alike]) -> str:
    names = [f"{p.name.replace('_', ' ')} of {sensors(p.channels)}" for p in problems]
    return joined(list(dict.fromkeys(names)))
