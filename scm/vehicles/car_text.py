"""Changes entries of a car file's text and leaves everything else, comments too, as it stands.

It knows the one form that car files are written in, `key = { value = ... }` on top of TOML; whoever
uses it reads the result back, and writes the file anew where it does not say what it should.
"""

import json
import re
from collections.abc import Sequence

from scm.vehicles.car import Car, all_terms
from scm.vehicles.own_term import SUFFIX
from scm.vehicles.term import Term

_QUOTES = ('"""', "'''", '"', "'")
_MARK = re.compile("|".join(_QUOTES) + r"|[#\[\]{}\n]")  # what may end a value, or hides such
_DEEPER = {"[": 1, "{": 1, "]": -1, "}": -1}


def quoted(text: str) -> str:
    """Return text as a TOML string on one line."""
    printable = "".join(c if c.isprintable() else " " for c in text)
    return json.dumps(printable, ensure_ascii=False)


def number(value: float, digits: int = 9) -> str:
    """Return a float that reads back the same to so many digits."""
    return repr(float(f"{value:.{digits}g}"))


def set_entry(text: str, section: str, key: str, entry: str) -> str:
    """Return the text with `key = entry` in a section, in place of what stood there."""
    header = re.search(rf"^[ \t]*\[[ \t]*{re.escape(section)}[ \t]*\].*$", text, re.MULTILINE)
    if header is None:
        return f"{text.rstrip()}\n\n[{section}]\n{key} = {entry}\n"
    following = re.compile(r"^[ \t]*\[", re.MULTILINE).search(text, header.end())
    end = following.start() if following else len(text)
    found = re.compile(rf"^[ \t]*{re.escape(key)}[ \t]*=[ \t]*", re.MULTILINE).search(
        text, header.end(), end
    )
    if found:
        stop = end_of_value(text, found.end())
        return text[: found.end()] + entry + text[stop:]
    last = _last_entry_end(text, header.end(), end)
    return f"{text[:last]}\n{key} = {entry}{text[last:]}"


def set_list(text: str, key: str, names: Sequence[str], comment: str) -> str:
    """Return the text with a list of names on top: missing ones get a line of their own."""
    found = re.search(rf"^{re.escape(key)}[ \t]*=[ \t]*(?=\[)", text, re.MULTILINE)
    if found is None:
        return _new_list(text, key, names, comment)
    stop = end_of_value(text, found.end())
    body = text[found.end() + 1 : stop - 1]
    there = [name for name, _ in _strings(body)]
    for name in there:
        if name not in names:
            body = re.sub(rf'"{re.escape(name)}"[ \t]*,?[ \t]*', "", body)
    new = [name for name in names if name not in there]
    if new:
        added = ", ".join(map(quoted, new))
        body = f"{_with_last_comma(body)}\n    {added},  # {comment}\n"
    return f"{text[: found.end()]}[{body}]{text[stop:]}"


def _strings(body: str) -> list[tuple[str, int]]:
    """Return the strings of a list with where each ends; what stands in comments is none."""
    tokens = re.finditer(r'"([^"\n]*)"|#[^\n]*', body)
    return [(token[1], token.end()) for token in tokens if token[1] is not None]


def _with_last_comma(body: str) -> str:
    """Return the inside of a list so that more may follow."""
    entries = _strings(body)
    if not entries:
        return body.rstrip()
    end = entries[-1][1]
    closed = re.sub(r"#[^\n]*", "", body[end:]).strip().startswith(",")
    return (body if closed else f"{body[:end]},{body[end:]}").rstrip()


def _new_list(text: str, key: str, names: Sequence[str], comment: str) -> str:
    """Return the text with a list before its first section, where TOML wants it."""
    section = re.search(r"^[ \t]*\[", text, re.MULTILINE)
    at = section.start() if section else len(text)
    entries = ", ".join(map(quoted, names))
    return f"{text[:at].rstrip()}\n{key} = [{entries}]  # {comment}\n\n{text[at:]}"


def end_of_value(text: str, start: int) -> int:
    """Return where the value that starts here ends: behind its bracket, quote or last letter."""
    depth, at = 0, start
    while mark := _MARK.search(text, at):
        at, depth = mark.end(), depth + _DEEPER.get(mark[0], 0)
        if mark[0] in _QUOTES:
            at = _end_of_string(text, mark.start(), mark[0])
        elif mark[0] == "#":
            at = _end_of_line(text, mark.start())
        elif mark[0] == "\n":
            if depth == 0:
                return mark.start()
            continue
        if depth == 0:
            return at
    return len(text)


def _end_of_string(text: str, start: int, quote: str) -> int:
    at = start + len(quote)
    while at < len(text) and not text.startswith(quote, at):
        at += 2 if text[at] == "\\" and quote[0] == '"' else 1
    return at + len(quote)


def _end_of_line(text: str, start: int) -> int:
    found = text.find("\n", start)
    return len(text) if found < 0 else found


def _last_entry_end(text: str, start: int, end: int) -> int:
    """Return the end of the last line of a section that is neither empty nor a comment."""
    last = start
    for line in re.finditer(r"^[ \t]*[^\s#].*$", text[start:end], re.MULTILINE):
        last = start + line.end()
    return last


def term_names(car: Car) -> list[str]:
    """Return what a car file's `terms` holds for this car, in its order."""
    return [
        term.name if term.name in all_terms() else term.name + SUFFIX
        for term in without_further(car.terms)
    ]


def without_further(terms: Sequence[Term]) -> list[Term]:
    """Return the effects without the further terms that come with them."""
    further = {part.name for term in terms for part in term.also}
    return [term for term in terms if term.name not in further]
