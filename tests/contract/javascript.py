"""Tokens of JavaScript, as far as tests need them: names, also those inside template literals."""

import re
from collections.abc import Generator, Iterator

Token = tuple[str, str, int]

TOKEN = re.compile(
    r"""(?P<skip>\s+|//[^\n]*|/\*.*?\*/)|(?P<string>"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')"""
    r"""|(?P<template>`)|(?P<word>[A-Za-z_$][\w$]*)|(?P<number>\d[\w.]*)"""
    r"""|(?P<regex>/(?:\\.|\[(?:\\.|[^\]\\\n])*\]|[^/\\\n\[])+/[a-z]*)|(?P<sign>.)""",
    re.DOTALL,
)
ENDS_A_VALUE = re.compile(r"[\w$)\]]$")  # after which a slash divides


def tokens(text: str, at: int = 0, *, inside: bool = False) -> Generator[Token, None, int]:
    """Yield kind, text and place of tokens; `inside` ends at the brace that closes `${`."""
    depth, before = 0, ""
    while at < len(text):
        found = TOKEN.match(text, at)
        assert found is not None  # a sign is any character
        kind, token = str(found.lastgroup), found[0]
        if kind == "regex" and ENDS_A_VALUE.search(before) and before not in {"return", "case"}:
            kind, token = "sign", "/"
        if kind == "template":
            at = yield from _template(text, at + 1)
            before = "`"
            continue
        depth += inside * ((token == "{") - (token == "}"))
        if depth < 0:
            return at + 1
        if kind != "skip":
            yield kind, token, at
            before = token
        at += len(token)
    return at


def _template(text: str, at: int) -> Generator[Token, None, int]:
    while text[at] != "`":
        if text[at] == "\\":
            at += 2
        elif text.startswith("${", at):
            at = yield from tokens(text, at + 2, inside=True)
        else:
            at += 1
    return at + 1


def own_names(text: str) -> Iterator[tuple[str, int]]:
    """Yield the names that a script gives itself, with their line: no fields of what it reads.

    Fields of the interface follow a dot, stand before the colon of a literal, or have underscores.
    """
    last, one_but_last = "", ""
    words = [token for token in tokens(text) if token[0] != "number"]
    for (kind, word, at), (_, after, _) in zip(words, [*words[1:], ("", "", 0)], strict=True):
        is_field = last == "." and one_but_last not in {"this", "."}
        is_key = after == ":" and last in {"{", ","}
        if kind == "word" and not (is_field or is_key or ("_" in word and word.islower())):
            yield word, text.count("\n", 0, at) + 1
        last, one_but_last = word, last
