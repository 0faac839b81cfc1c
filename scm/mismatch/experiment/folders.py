"""Where suggested drives lie in a report's folder: one folder for each question that stays open."""

from collections.abc import Sequence

from scm.mismatch.findings import Undecided

FOLDER = "next_drive"
OFFERED_STDS = 3.2  # apart at least, rounded as it is told; what parts them less is not written


def folders_of(undecided: Sequence[Undecided]) -> tuple[str, ...]:
    """Return the folder of each question's drive, numbered from the second on; empty: no drive."""
    found, count = list[str](), 0
    for question in undecided:
        offered = question.expected_separation >= OFFERED_STDS
        count += offered
        found.append((FOLDER if count < 2 else f"{FOLDER}_{count}") if offered else "")
    return tuple(found)
