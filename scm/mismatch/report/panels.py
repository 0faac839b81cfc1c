"""The panels of a report's first screen: effects, open questions, problems of the recording."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from scm.mismatch.evidence import Evidence
from scm.mismatch.findings import (
    Diagnosis,
    Effect,
    Equation,
    Located,
    Undecided,
    Verdict,
    folders_of,
)
from scm.mismatch.report.sentences import (
    advice_of,
    alike,
    can_judge,
    checks_of,
    pressing_problems,
    processor_sentence,
    range_sentence,
    sensors,
    since_sentence,
    spans,
    where_and_when,
)
from scm.mismatch.report.wording import (
    amounts,
    capital,
    joined,
    pretty,
    quantity,
    sureness,
    title_of,
)

_ENOUGH_STDS = 5.0  # that separate two explanations, to be sure of one
_MAX_PROBLEM_PANELS = 4  # nobody reads twenty; the table below has all of them
_NO_VERDICT = "no_verdict"


class Panel(NamedTuple):
    """One thing to know: its kind, label and title, and facts by name."""

    kind: str
    label: str
    title: str
    rows: Sequence[tuple[str, str]]


def panels_of(diagnosis: Diagnosis, evidence: Evidence) -> list[Panel]:
    """Return what to know at first sight: effects, questions, problems of the recording."""
    panels = [*_failed(diagnosis), *_effects(diagnosis), *_questions(diagnosis)]
    if diagnosis.located and not diagnosis.effects:
        where = ("Where", where_and_when(diagnosis.located))
        panels.append(Panel("effect", "Located", "Where the error is", [where]))
    panels += [*_dropped(diagnosis), *_at_limit(evidence)]
    if diagnosis.unanswered:
        panels.append(_out_of_time(diagnosis))
    elif diagnosis.verdict is Verdict.NONE and can_judge(diagnosis):
        panels.append(_checked(evidence))
    if diagnosis.verdict is Verdict.MISMATCH and not (diagnosis.effects or diagnosis.failure):
        panels.append(_unexplained(evidence))
    return [*panels, *_problems(diagnosis, evidence)]


def _effects(diagnosis: Diagnosis) -> Iterator[Panel]:
    open_names = {name for question in diagnosis.undecided for name in question.between}
    for i, effect in enumerate(diagnosis.effects, start=1):
        number = f", {i} of {len(diagnosis.effects)}" if len(diagnosis.effects) > 1 else ""
        rows = [
            ("What", pretty(effect.text)),
            ("How much", "\n".join(amounts(effect.parameters))),
            ("Since" if effect.until_s is None else "When", since_sentence(effect)),
            ("Formula", pretty(effect.formula or "").replace(" * ", " · ")),
            ("Where", where_and_when(_located_of(effect, diagnosis.located))),
            ("Range", range_sentence(effect)),
            ("How sure", sureness(effect)),
            ("What to do", advice_of(effect)),
        ]
        kind = "Measurement error" if effect.equation is Equation.SENSOR else "Left out"
        kind = "Likeliest, but undecided" if effect.name in open_names else kind
        label = f"{kind}{number}" + ("" if effect.is_known else ", outside the library")
        yield Panel("effect", label, capital(title_of(effect.name)), rows)


def _located_of(effect: Effect, located: Sequence[Located]) -> Sequence[Located]:
    """Return where an effect's own error is, or else that of its part of the car."""
    same_part = [found for found in located if found.equation is effect.equation]
    own = [found for found in same_part if found.depends_on == effect.depends_on]
    return own[:1] or same_part[:1]


def _questions(diagnosis: Diagnosis) -> Iterator[Panel]:
    folders = folders_of(diagnosis.undecided)
    for question, folder in zip(diagnosis.undecided, folders, strict=True):
        titles = [title_of(name) for name in question.between]
        which = f"{capital(joined(titles, 'or'))}: each explains this recording about as well."
        rows = [
            ("Which", which),
            ("Drive this" if folder else "Do this", question.drive_this),
            ("Then" if folder else "By driving", _separation(question, folder)),
            ("Or check", "\n".join(checks_of(question.between))),
        ]
        yield Panel("question", "Undecided", capital(joined(titles, "or")) + "?", rows)


def _separation(question: Undecided, folder: str) -> str:
    """Return how well the drive would separate the two, and where its files are."""
    stds = question.expected_separation
    if stds <= 0.0:
        return ""
    if not folder:
        return (
            f"The best drive that was simulated separates them by {stds:.1f} standard deviations; "
            f"{_ENOUGH_STDS:g} are enough to be sure."
        )
    return (
        f"They differ by {stds:.1f} standard deviations; {_ENOUGH_STDS:g} are enough to be sure. "
        f"The drive's files are in `{folder}` beside this page, for `scm play`."
    )


def _failed(diagnosis: Diagnosis) -> Iterator[Panel]:
    """Yield that a plain model is better, by how much, and what can be read off."""
    failure = diagnosis.failure
    if failure is None:
        return
    rows = [
        ("What", failure.text),
        ("Likely reasons", "\n".join(failure.reasons)),
        ("What to do", "Measure the numbers that are named, or give them an honest `std`; check "
                       "the clocks and the units of commands. Then search again."),
    ]  # fmt: skip
    yield Panel("question", "Fit failed", "A plain model drives more like the car", rows)


def _dropped(diagnosis: Diagnosis) -> Iterator[Panel]:
    """Yield effects that were selected and did not hold."""
    if not diagnosis.dropped:
        return
    titles = joined([title_of(one.name) for one in diagnosis.dropped])
    text = "\n".join(one.text for one in diagnosis.dropped)
    yield Panel("question", "Not confirmed", capital(titles), [("What", text)])


def _at_limit(evidence: Evidence) -> Iterator[Panel]:
    """Yield which of the car's own numbers were moved to a physical bound."""
    at_limit = [(own, own.limit) for own in evidence.refitted if own.limit is not None]
    if not at_limit:
        return
    moved = [
        f"`{own.key}` moved from {quantity(own.given, own.found.unit)} to "
        f"{quantity(limit, own.found.unit)}, "
        f"the {'least' if limit < own.given else 'most'} that is physically possible."
        for own, limit in at_limit
    ]
    rows = [
        ("What", "\n".join(moved)),
        ("What to do", "Measure it on the car. If it is far from its limit, it stands in for "
                       "something else that the simulator leaves out: do not rely on it."),
    ]  # fmt: skip
    title = "A number at its limit" if len(at_limit) == 1 else "Numbers at their limits"
    yield Panel("question", "Car file", title, rows)


def _out_of_time(diagnosis: Diagnosis) -> Panel:
    rows = [
        ("What", "\n".join(question.text for question in diagnosis.unanswered)),
        ("Why", processor_sentence(diagnosis)),
        ("What to do", "Search again with more time, `--budget-s`. The search for what is reported "
                       "above was completed."),
    ]  # fmt: skip
    return Panel("question", "Not answered", "Time ran out", rows)


def _checked(evidence: Evidence) -> Panel:
    text = "Its nominal parameters may move within the standard deviations of the car file."
    if evidence.tried:
        best = max(evidence.tried, key=lambda t: t.gain - t.needed)
        title = title_of(best.name)
        nearest = f"The best, {title}, explains something, but not enough to be called an effect."
        if best.gain <= best.needed:
            nearest = f"None explains more than chance would; {title} comes nearest."
        text = f"Every effect that this car can show was tried, each alone. {nearest}"
    rows = [
        ("Checked", text),
        ("What to do", "Nothing. If the car still surprises you, record faster turns, harder "
                       "starts and stops, and another part of the floor."),
    ]  # fmt: skip
    return Panel("clear", "No mismatch", "What was checked", rows)


def _unexplained(evidence: Evidence) -> Panel:
    """Return what to do about a difference that nothing explains."""
    tried = " No effect that was tried explains it." if evidence.tried else ""
    rows = [
        ("What", f"The car deviates from the simulator by far more than noise.{tried}"),
        ("What to do", "See below where and when it deviates. Weigh and measure the car, and give "
                       "an honest `std` for each number in its file: a number that is far off and "
                       "may not move is the usual cause. Are the commands those of this drive?"),
    ]  # fmt: skip
    return Panel("question", "No name", "Cause unknown", rows)


def _problems(diagnosis: Diagnosis, evidence: Evidence) -> Iterator[Panel]:
    """Yield what prevents a verdict or can be avoided next time."""
    groups = alike(pressing_problems(diagnosis), evidence.recordings)
    for problem, channels, recordings in groups[:_MAX_PROBLEM_PANELS]:
        title = capital(problem.name.replace("_", " "))
        if problem.name == _NO_VERDICT:
            title = "Why there is no verdict"
        elif channels not in ([""], ["*"]):
            title += f": {sensors(channels)}"
        rows = [
            ("What", problem.text),
            ("In", joined(recordings)),
            ("When", capital(spans(problem.when_s)) if problem.when_s else ""),
            ("Record instead", problem.record_instead),
        ]
        yield Panel("data", "Problem of the recording", title, rows)
