"""Turns parsed TOML into a record; errors read `file: key: expected .., got ..`."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import msgspec

from scm.errors import ScmError, nearest

R = TypeVar("R", bound=msgspec.Struct)

_PATH = re.compile(r" - at `(?:key in )?\$\.?(?P<path>.*)`$")
_PLAIN = (
    (re.compile(r"^Expected `([^`]+)`, got `([^`]+)`$"), r"expected \1, got \2"),
    (re.compile(r"^Object missing required field `([^`]+)`$"), r"key \1 is missing"),
    (re.compile(r"^Object contains unknown field `([^`]+)`$"), r"key \1 is not known here"),
    # The only number that is fixed is the format's: `map = 1`.
    (re.compile(r"^Invalid enum value (\d+)$"), r"expected 1 (the {path} format), got \1"),
    (re.compile(r"^Invalid enum value (.+)$"), r"\1 is not one of the words allowed here"),
    (re.compile(r"^Expected `array` of length (\d+), got (\d+)$"), r"expected \1 values, got \2"),
)
_UNKNOWN = re.compile(r"^key (?P<key>\S+) is not known here$")
_TYPES = {
    "str": "text in quotes",
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
    "null": "nothing",
}


def record_of(
    data: object,
    kind: type[R],
    path: Path,
    error: type[ScmError],
    keys: Sequence[str],
    within: str = "",
) -> R:
    """Return parsed TOML as a record.

    Args:
        data: What the file holds.
        kind: Of record.
        path: Of the file, for errors.
        error: What to raise.
        keys: All that such a file may hold, to name the nearest of an unknown one.
        within: The key of the table that `data` is, if it is not the whole file.

    Raises:
        ScmError: an `error` with file, key, what was expected and what was found.
    """
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as cause:
        raise error(f"{path}: {_in_plain_words(str(cause), data, keys, within)}") from cause


def _in_plain_words(message: str, data: object, keys: Sequence[str], within: str) -> str:
    """Return msgspec's sentence as `key: expected .., got ..` with the record's name."""
    found = _PATH.search(message)
    path = found["path"] if found else ""
    text = message[: found.start()] if found else message
    for pattern, plain in _PLAIN:
        if pattern.match(text):
            text = pattern.sub(plain.replace("{path}", path), text)
            break
    if unknown := _UNKNOWN.match(text):
        text += nearest(unknown["key"], keys)
    for python, word in _TYPES.items():
        text = re.sub(rf"\b(expected|got|\|) {python}\b", rf"\1 {word}", text)
    where = f"{'.'.join(filter(None, (within, path)))}{_name_at(path, data)}"
    return f"{where}: {text.replace(' | ', ' or ')}" if where else text


def _name_at(path: str, data: object) -> str:
    """Return ` (name)` of the innermost record on the way to a key that has a name or an id."""
    name = ""
    for step in re.findall(r"[^.\[\]]+", path):
        if isinstance(data, list) and step.isdigit() and int(step) < len(data):
            data = data[int(step)]
        elif isinstance(data, dict):
            data = data.get(step)
        if isinstance(data, dict):
            named = data.get("name", data.get("light_id", data.get("sign_id", "")))
            name = f" ({named})" if named != "" else name
    return name
