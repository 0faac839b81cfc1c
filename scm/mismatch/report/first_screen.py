"""The first screen: what, where, how sure, how much better, and what to do."""

from collections.abc import Iterator, Sequence

from scm.mismatch.evidence import Evidence, Tried
from scm.mismatch.findings import DataProblem, Diagnosis, Effect, Undecided, Verdict
from scm.mismatch.report.advice import advice_of
from scm.mismatch.report.bars import better_picture
from scm.mismatch.report.html_text import around, tag
from scm.mismatch.report.plot import Picture
from scm.mismatch.report.verdict_text import (
    can_judge,
    other_problems,
    pressing_problems,
    verdict_sentence,
)
from scm.mismatch.report.wording import (
    capital,
    interval,
    joined,
    quantity,
    spans,
    sureness,
    title_of,
    where_and_when,
)


def first_screen(diagnosis: Diagnosis, evidence: Evidence) -> str:
    """Return the page's head."""
    kind = str(diagnosis.verdict) if can_judge(diagnosis) else "unable"
    where = f"Car {evidence.vehicle}, recording {joined(evidence.recordings) or 'unnamed'}"
    head = tag("p", where, "inputs") + tag("h1", verdict_sentence(diagnosis))
    verdict = around("div", head + better(diagnosis), "words")
    picture = better_picture(diagnosis.fit) if _shows_better(diagnosis) else None
    bars = around("div", _bars(diagnosis, picture), "bars") if picture else ""
    cards = [*_effect_cards(diagnosis), *_undecided_cards(diagnosis), *_located_card(diagnosis)]
    if diagnosis.verdict is Verdict.NONE and can_judge(diagnosis):
        cards.append(_checked_card(evidence))
    cards += _data_cards(diagnosis)
    return (
        around("header", verdict + bars, f"verdict {kind}")
        + around("div", "".join(cards), "cards")
        + _other_problems_line(diagnosis)
    )


def _shows_better(diagnosis: Diagnosis) -> bool:
    return bool(diagnosis.effects)


def better(diagnosis: Diagnosis) -> str:
    """Return how much better it got, as a paragraph; nothing where nothing was fitted."""
    fit = diagnosis.fit
    if fit is None:
        return ""
    before, after = (side.get("position_m") for side in (fit.confirm.before, fit.confirm.after))
    if before is None or after is None:
        return ""
    horizon = f"after {quantity(fit.horizon_s, 's')} of free running"
    if not _shows_better(diagnosis):
        floor = fit.confirm.noise_floor.get("position_m")
        noise = f"; noise of measuring alone makes {quantity(floor, 'm')}" if floor else ""
        best = ""
        if diagnosis.undecided and after < before:
            best = f"; with the best of these it would be {quantity(after, 'm')}"
        said = f"The simulator is off by {quantity(before, 'm')} {horizon}{best}{noise}."
        return tag("p", said)
    said = (
        f"On drives that the fit did not see, the simulator was off by {quantity(before, 'm')} "
        f"{horizon}; with what was found it is off by {quantity(after, 'm')}."
    )
    return tag("p", said)


def _bars(diagnosis: Diagnosis, picture: Picture) -> str:
    if diagnosis.fit is None:
        return ""
    title = f"Position error after {quantity(diagnosis.fit.horizon_s, 's')}, on unseen drives"
    return tag("h2", title) + around("div", picture.svg, "canvas")


def _card(kind: str, label: str, title: str, rows: Sequence[tuple[str, str]]) -> str:
    facts = "".join(tag("dt", name) + tag("dd", said) for name, said in rows if said)
    head = tag("p", label, "label") + tag("h2", title)
    return around("article", head + around("dl", facts), f"card {kind}")


def _effect_cards(diagnosis: Diagnosis) -> Iterator[str]:
    for i, effect in enumerate(diagnosis.effects, start=1):
        number = f" {i} of {len(diagnosis.effects)}" if len(diagnosis.effects) > 1 else ""
        where = [found for found in diagnosis.located if found.equation is effect.equation]
        rows = [
            ("What", effect.said),
            ("How much", _amounts(effect)),
            ("Law", effect.law or ""),
            ("Where", where_and_when(where)),
            ("How sure", sureness(effect)),
            ("What to do", advice_of(effect)),
        ]
        label = f"Left out{number}" if effect.listed else f"Left out{number}, outside the library"
        yield _card("effect", label, capital(title_of(effect.name)), rows)


def _amounts(effect: Effect) -> str:
    return "\n".join(
        f"{name_of(name, estimate.unit)} {interval(estimate)}"
        for name, estimate in effect.parameters.items()
    )


def name_of(name: str, unit: str) -> str:
    """Return a parameter's name in words, without the unit that follows its value."""
    suffix = "_" + unit.replace("*", "").replace("/", "").replace("^", "")
    ends = (suffix, "_mps2", "_rad_s", "_nm") if unit != "1" else ()
    stem = next((name.removesuffix(end) for end in ends if name.endswith(end)), name)
    return stem.replace("_", " ")


def _located_card(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield where the error lies, where no effect says it."""
    if diagnosis.located and not diagnosis.effects:
        yield _card(
            "effect", "Located", "Where it lies", [("Where", where_and_when(diagnosis.located))]
        )


def _undecided_cards(diagnosis: Diagnosis) -> Iterator[str]:
    yield from (_undecided_card(open_question) for open_question in diagnosis.undecided)


def _undecided_card(question: Undecided) -> str:
    titles = [title_of(name) for name in question.between]
    tells = (
        f"It would tell them apart by {question.expected_separation:.1f} standard deviations."
        if question.expected_separation > 0.0
        else ""
    )
    all_of_them = "Both" if len(titles) == 2 else "All of them"
    which = f"Either {joined(titles, 'or')}. {all_of_them} explain this recording equally well."
    rows = [
        ("Which", which),
        ("Drive this", question.drive_this),
        ("Then", tells),
    ]
    return _card("question", "Undecided", capital(joined(titles, "or")) + "?", rows)


def _checked_card(evidence: Evidence) -> str:
    tried = evidence.tried
    said = "Its ordinary numbers may move inside the scatter that the car file states."
    if tried:
        best = max(tried, key=lambda t: t.gain - t.needed)
        said = f"{len(tried)} effects were tried, each alone. " + _best_tried(best)
    rows = [
        ("Checked", said),
        ("What to do", "Nothing. If the car still surprises you, record faster turns, harder "
                       "starts and stops, and another part of the floor."),
    ]  # fmt: skip
    return _card("clear", "No mismatch", "What was checked", rows)


def _best_tried(best: Tried) -> str:
    """Say how near the best of those tried came to being one."""
    title = title_of(best.name)
    if best.gain <= best.needed:
        return (
            f"None explains more than luck may: the best, {title}, brings {best.gain:.1f} of the "
            f"{best.needed:.1f} that it would need."
        )
    return f"The best, {title}, explains something, and not enough to be called an effect."


def _data_cards(diagnosis: Diagnosis) -> Iterator[str]:
    yield from (_data_card(problem) for problem in pressing_problems(diagnosis))


def _data_card(problem: DataProblem) -> str:
    rows = [
        ("What", problem.said),
        ("When", capital(spans(problem.when_s)) if problem.when_s else ""),
        ("Record instead", problem.record_instead),
    ]
    title = capital(problem.name.replace("_", " "))
    title += f": {problem.channel}" if problem.channel not in ("", "*") else ""
    return _card("data", "Problem of the recording", title, rows)


def _other_problems_line(diagnosis: Diagnosis) -> str:
    fixed = _named(other_problems(diagnosis, corrected=True))
    noticed = _named(other_problems(diagnosis, corrected=False))
    said = f"Put right in the recording before the car was blamed: {fixed}. " if fixed else ""
    said += f"Noticed in the recording, and left as it is: {noticed}. " if noticed else ""
    if not said:
        return ""
    return around("p", tag("span", said) + '<a href="#data">Details below.</a>', "corrected")


def _named(problems: Sequence[DataProblem]) -> str:
    return joined([f"{p.name.replace('_', ' ')} of {p.channel}" for p in problems])
