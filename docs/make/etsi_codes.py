"""Write the table of ETSI's codes into `docs/v2x.md`, from the definitions of the messages.

Run with `python docs/make/etsi_codes.py` after a field or a code has changed; a test compares.
"""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from scm.v2x.etsi.codes import Codes, codes_in
from scm.v2x.etsi.json_form import KINDS

PAGE = Path(__file__).parents[1] / "v2x.md"
BEGIN, END = "<!-- codes -->\n", "<!-- end of codes -->\n"
HEAD = "| field | in | unavailable | out of range |\n|---|---|---|---|\n"
PARTS = ("value", "confidence", "speed", "timestamp", "second", "lane", "request")
"""Names that say too little without the record that holds them."""


def table() -> str:
    """Return the table in Markdown: a row for each field name with the same codes."""
    rows: dict[tuple[str, Codes], set[str]] = defaultdict(set)
    for kind, message in KINDS.items():
        for path, codes in codes_in(message.body):
            if codes is not None and (codes.unavailable or codes.out_of_range):
                rows[_short(path), codes].add(kind.upper())
    lines = [
        f"| `{name}` | {', '.join(sorted(kinds))} | {_text(codes.unavailable)} | "
        f"{_text(codes.out_of_range)} |\n"
        for (name, codes), kinds in sorted(rows.items(), key=lambda one: one[0][0])
    ]
    return HEAD + "".join(lines)


def _short(path: str) -> str:
    names = path.replace("[]", "").split(".")
    return ".".join(names[-2:] if names[-1] in PARTS else names[-1:])


def _text(values: Sequence[int]) -> str:
    if isinstance(values, range):
        return f"{values[0]} to {values[-1]}"
    return ", ".join(map(str, values))


def page() -> str:
    """Return the whole page with the table as the definitions have it now."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return before + BEGIN + table() + END + after


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
