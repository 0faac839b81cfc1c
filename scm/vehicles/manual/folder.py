"""Write the manual: a page and a picture for each effect and sensor fault, and an index."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from scm.vehicles.describe_effects import (
    CHAPTERS,
    OTHERS,
    Effect,
    all_effects,
    chapter_of,
    effect_named,
)
from scm.vehicles.manual.picture import draw_term
from scm.vehicles.manual.sensor_fault_page import draw_sensor_fault, sensor_fault_page
from scm.vehicles.manual.term_page import term_page
from scm.vehicles.term import Term

INDEX = "README.md"
_INTRODUCTION = """# Physical effects and sensor faults

A page for each effect that a car file can list under `terms`, and for each fault that a recording
may carry: equation, numbers, range, source, and the drive that makes it visible.
Written by `scm show terms --docs docs/physics` from the effects themselves; not edited by hand.
"""


def chosen_effects(name: str | None) -> list[Effect]:
    """Return the named effect, or all.

    Raises:
        TermError: when there is no such effect.
    """
    return list(all_effects().values()) if name is None else [effect_named(name)]


def pages_of(effects: Sequence[Effect]) -> dict[str, str]:
    """Return every page's text by file name, without simulating."""
    return {f"{effect.name}.md": _page(effect) for effect in effects}


def index_page(effects: Mapping[str, Effect]) -> str:
    """Return the index of all effects, grouped by what they act on."""
    titled = {title: list[Effect]() for title in (*(t for t, _ in CHAPTERS), OTHERS)}
    titled["Sensor faults"] = []
    for effect in effects.values():
        title = chapter_of(effect) if isinstance(effect, Term) else "Sensor faults"
        titled[title].append(effect)
    lines = [_INTRODUCTION]
    for title, chosen in titled.items():
        if chosen:
            lines += [f"## {title}", "", "| effect | what it is |", "|---|---|"]
            lines += [
                f"| [{effect.name}]({effect.name}.md) | {effect.about} |" for effect in chosen
            ]
            lines.append("")
    return "\n".join(lines)


def write_manual(
    folder: Path, effects: Sequence[Effect], on_progress: Callable[[int, str], None], *, index: bool
) -> None:
    """Write pages and pictures; `on_progress` gets the number done and the next name."""
    folder.mkdir(parents=True, exist_ok=True)
    if index:
        (folder / INDEX).write_text(index_page(all_effects()), encoding="utf-8")
    for name, text in pages_of(effects).items():
        (folder / name).write_text(text, encoding="utf-8")
    for i, effect in enumerate(effects):
        on_progress(i, effect.name)
        (folder / f"{effect.name}.svg").write_text(_picture(effect), encoding="utf-8")


def _page(effect: Effect) -> str:
    return term_page(effect) if isinstance(effect, Term) else sensor_fault_page(effect)


def _picture(effect: Effect) -> str:
    return draw_term(effect) if isinstance(effect, Term) else draw_sensor_fault(effect)
