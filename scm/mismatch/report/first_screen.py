"""The first screen: what, where, how sure, how much better, and what to do."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from scm.mismatch.evidence import Evidence, Tried
from scm.mismatch.experiment.folders import folders_of
from scm.mismatch.findings import Diagnosis, Effect, Equation, Located, Undecided, Verdict
from scm.mismatch.report.advice import advice_of, checks_of
from scm.mismatch.report.bars import better_picture
from scm.mismatch.report.html_text import around, tag
from scm.mismatch.report.places import where_and_when
from scm.mismatch.report.plot import Picture
from scm.mismatch.report.problems import other_problems_said, problem_cards
from scm.mismatch.report.verdict_text import all_named, can_judge, processor_said, verdict_sentence
from scm.mismatch.report.wording import (
    capital,
    interval,
    joined,
    pretty,
    quantities,
    quantity,
    sureness,
    title_of,
)

_ENOUGH_STDS = 5.0


class Card(NamedTuple):
    """One thing to know: of what kind it is, its label and title, and facts by name."""

    kind: str
    label: str
    title: str
    rows: Sequence[tuple[str, str]]


def first_screen(diagnosis: Diagnosis, evidence: Evidence) -> str:
    """Return the page's head."""
    kind = str(diagnosis.verdict) if can_judge(diagnosis) else "unable"
    recordings = "recordings" if len(evidence.recordings) > 1 else "recording"
    where = f"Car {evidence.vehicle}, {recordings} {joined(evidence.recordings) or 'unnamed'}"
    head = tag("p", where, "inputs") + tag("h1", verdict_sentence(diagnosis))
    names = all_named(diagnosis.effects)
    head += tag("p", names) if names else ""
    verdict = around("div", head + better(diagnosis, evidence.retuned_m), "words")
    picture = better_picture(diagnosis, evidence.retuned_m)
    bars = around("div", _bars(diagnosis, picture), "bars") if picture else ""
    cards = "".join(card(*one) for one in cards_of(diagnosis, evidence))
    return (
        around("header", verdict + bars, f"verdict {kind}")
        + around("div", cards, "cards")
        + _other_problems_line(diagnosis, evidence)
    )


def cards_of(diagnosis: Diagnosis, evidence: Evidence) -> list[Card]:
    """Return what is to be known at first sight: effects, questions, problems of the recording."""
    cards = [*_effect_cards(diagnosis), *_undecided_cards(diagnosis), *_located_card(diagnosis)]
    cards += _limit_card(evidence)
    if diagnosis.unanswered:
        cards.append(_unasked_card(diagnosis))
    elif diagnosis.verdict is Verdict.NONE and can_judge(diagnosis):
        cards.append(_checked_card(evidence))
    if diagnosis.verdict is Verdict.MISMATCH and not diagnosis.effects:
        cards.append(_no_name_card(evidence))
    cards += [
        Card("data", "Problem of the recording", title, rows)
        for title, rows in problem_cards(diagnosis, evidence)
    ]
    return cards


def better(diagnosis: Diagnosis, retuned_m: float | None = None) -> str:
    """Return `better_said` as a paragraph; nothing where it says nothing."""
    said = better_said(diagnosis, retuned_m)
    return tag("p", said) if said else ""


def better_said(diagnosis: Diagnosis, retuned_m: float | None = None) -> str:
    """Return how much better it got, in words; nothing where nothing was fitted.

    Args:
        diagnosis: What was found.
        retuned_m: Error of the car with its own numbers refitted alone; None: not said.
    """
    fit = diagnosis.fit
    if fit is None:
        return ""
    before, after = (side.get("position_m") for side in (fit.confirm.before, fit.confirm.after))
    if before is None or after is None:
        return ""
    floor = fit.confirm.noise_floor.get("position_m", math.nan)
    own = math.nan if retuned_m is None else retuned_m
    was, now, tuned, noise = quantities((before, after, own, floor), "m")
    seen = f"on parts of the recording that no fit has seen, after {quantity(fit.horizon_s, 's')}"
    said = f"{capital(seen)} of driving by the recorded commands alone, the simulator is {was} off"
    if diagnosis.effects:
        found = "the likeliest of them" if diagnosis.undecided else "what was found"
        alone = f"; with its own numbers refitted alone, {tuned}" if math.isfinite(own) else ""
        beside = f" as well, {now}" if alone else f" and its own numbers refitted, {now}"
        return f"{said}{alone}; with {found}{beside}."
    if diagnosis.undecided and after < before:
        said += f"; with the best of these, {now}"
    elif diagnosis.verdict is Verdict.NONE:
        said += f"; with its own numbers refitted inside their scatter, {now}"
    return f"{said}. Noise of measuring alone makes {noise}." if floor > 0 else f"{said}."


def _bars(diagnosis: Diagnosis, picture: Picture) -> str:
    if diagnosis.fit is None:
        return ""
    title = f"Position error after {quantity(diagnosis.fit.horizon_s, 's')}, on unseen parts"
    return tag("h2", title) + around("div", picture.svg, "canvas")


def card(kind: str, label: str, title: str, rows: Sequence[tuple[str, str]]) -> str:
    """Return one card: what it is about, its title, and facts by name; empty ones are left out."""
    facts = "".join(tag("dt", name) + tag("dd", said) for name, said in rows if said)
    head = tag("p", label, "label") + tag("h2", title)
    return around("article", head + around("dl", facts), f"card {kind}")


def _effect_cards(diagnosis: Diagnosis) -> Iterator[Card]:
    open_names = {name for question in diagnosis.undecided for name in question.between}
    for i, effect in enumerate(diagnosis.effects, start=1):
        number = f", {i} of {len(diagnosis.effects)}" if len(diagnosis.effects) > 1 else ""
        where = _located_of(effect, diagnosis.located)
        rows = [
            ("What", pretty(effect.text)),
            ("How much", _amounts(effect)),
            ("Law", pretty(effect.formula or "").replace(" * ", " · ")),
            ("Where", where_and_when(where)),
            ("How sure", sureness(effect)),
            ("What to do", advice_of(effect)),
        ]
        kind = "Measuring off" if effect.equation is Equation.SENSOR else "Left out"
        kind = "Likeliest, but undecided" if effect.name in open_names else kind
        label = f"{kind}{number}" + ("" if effect.is_known else ", outside the library")
        yield Card("effect", label, capital(title_of(effect.name)), rows)


def _located_of(effect: Effect, located: Sequence[Located]) -> Sequence[Located]:
    """Return where an effect's own error lies, or else that of its part of the car."""
    alike = [found for found in located if found.equation is effect.equation]
    own = [found for found in alike if found.depends_on == effect.depends_on]
    return own[:1] or alike[:1]


def _amounts(effect: Effect) -> str:
    return "\n".join(
        f"{name_of(name, estimate.unit)} {interval(estimate)}"
        for name, estimate in effect.parameters.items()
    )


def name_of(name: str, unit: str) -> str:
    """Return a parameter's name in words, without the unit that follows its value."""
    suffix = "_" + unit.replace("*", "").replace("/", "").replace("^", "").lower()
    ends = (suffix, "_mps2", "_rad_s", "_per_min") if unit != "1" else ()
    stem = next((name.removesuffix(end) for end in ends if name.endswith(end)), name)
    return stem.replace("_", " ")


def _located_card(diagnosis: Diagnosis) -> Iterator[Card]:
    """Yield where the error lies, where no effect says it."""
    if diagnosis.located and not diagnosis.effects:
        yield Card(
            "effect", "Located", "Where it lies", [("Where", where_and_when(diagnosis.located))]
        )


def _undecided_cards(diagnosis: Diagnosis) -> Iterator[Card]:
    folders = folders_of(diagnosis.undecided)
    for question, folder in zip(diagnosis.undecided, folders, strict=True):
        yield _undecided_card(question, folder)


def _undecided_card(question: Undecided, folder: str) -> Card:
    titles = [title_of(name) for name in question.between]
    which = f"Either {joined(titles, 'or')}: each explains this recording, one hardly better."
    rows = [
        ("Which", which),
        ("Drive this" if folder else "Do this", question.drive_this),
        ("Then" if folder else "By driving", _then(question, folder)),
        ("Or check", "\n".join(checks_of(question.between))),
    ]
    return Card("question", "Undecided", capital(joined(titles, "or")) + "?", rows)


def _then(question: Undecided, folder: str) -> str:
    """Say how sure the drive would make, and where its files lie."""
    apart = question.expected_separation
    if apart <= 0.0:
        return ""
    if not folder:
        return (
            f"The best drive that was simulated parts them by {apart:.1f} standard deviations; "
            f"{_ENOUGH_STDS:g} are enough to be sure."
        )
    return (
        f"They differ by {apart:.1f} standard deviations; {_ENOUGH_STDS:g} are enough to be sure. "
        f"The drive's files lie in `{folder}` beside this page, for `scm play`."
    )


def _limit_card(evidence: Evidence) -> Iterator[Card]:
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
    yield Card("question", "Car file", title, rows)


def _unasked_card(diagnosis: Diagnosis) -> Card:
    """Say what there was no time for, and that more time would help."""
    rows = [
        ("What", "\n".join(question.text for question in diagnosis.unanswered)),
        ("Why", processor_said(diagnosis)),
        ("What to do", "Search again with more time, `--budget-s`. What is reported above was "
                       "looked for, and fitted, to the end."),
    ]  # fmt: skip
    return Card("question", "Left unasked", "Time ran out", rows)


def _checked_card(evidence: Evidence) -> Card:
    tried = evidence.tried
    said = "Its ordinary numbers may move inside the scatter that the car file states."
    if tried:
        best = max(tried, key=lambda t: t.gain - t.needed)
        said = f"Every effect that this car can show was tried, each alone. {_best_tried(best)}"
    rows = [
        ("Checked", said),
        ("What to do", "Nothing. If the car still surprises you, record faster turns, harder "
                       "starts and stops, and another part of the floor."),
    ]  # fmt: skip
    return Card("clear", "No mismatch", "What was checked", rows)


def _no_name_card(evidence: Evidence) -> Card:
    """Say what to do about a difference that nothing explains."""
    tried = " No effect that was tried explains it." if evidence.tried else ""
    rows = [
        ("What", f"The car strays from the simulator by far more than noise.{tried}"),
        ("What to do", "See below where and when it strays. Weigh and measure the car, and give "
                       "its file an honest `std` for each number: one that is far off and may not "
                       "move is the usual cause. Are the commands those of this very drive?"),
    ]  # fmt: skip
    return Card("question", "No name", "Cause unknown", rows)


def _best_tried(best: Tried) -> str:
    """Say how near the best of those tried came to being one."""
    title = title_of(best.name)
    if best.gain <= best.needed:
        return f"None explains more than chance would; {title} comes nearest."
    return f"The best, {title}, explains something, but not enough to be called an effect."


def _other_problems_line(diagnosis: Diagnosis, evidence: Evidence) -> str:
    said = other_problems_said(diagnosis, evidence)
    if not said:
        return ""
    return around("p", tag("span", said) + '<a href="#data">Details below.</a>', "corrected")
