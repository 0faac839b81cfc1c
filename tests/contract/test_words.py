"""No identifier of the code is made of a word that the glossary has retired."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
GLOSSARY = ROOT / "docs" / "glossary.md"
TWIN_MEANS_CITY_TWIN = {"twin", "twins"}  # a car's versioned file; only effects may not be twins
RECORDS = ("Struct", "BaseModel", "Message", "Record")
STANDARD = {
    "law",  # of `scm.vehicles.jit`: users' own effects import it by its name of 0.1
    "tell",  # of files
    "wait_for_calm",  # of `scm.fleet.City`: scripts of users call it by its name of 0.1
    "__slots__",  # Python's own name
    "_slots_",  # of ctypes structures
    "calm",  # the public name of a signal plan
}
PUBLISHED = ("scm/client/nouns",)  # written from the interface: methods carry its operation ids


@cache
def retired() -> set[str]:
    """Return the words of the first column of the glossary's table."""
    table = GLOSSARY.read_text(encoding="utf-8").split("## Retired words")[1]
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("|")][2:]
    words = {word for row in rows for word in re.findall(r"[a-z]+", re.sub(r"\(.*?\)", "", row))}
    return words - TWIN_MEANS_CITY_TWIN


def words_of(identifier: str) -> list[str]:
    """Return the words that an identifier is made of, in lower case."""
    found = re.findall(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+", identifier)
    return [word.lower() for word in found]


def defined_in(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield every name that code defines, with its line.

    A field of a record is not among them: its name can be part of a contract, and
    `test_interfaces` holds those.
    """
    fields = {
        id(statement.target)
        for node in ast.walk(tree) if isinstance(node, ast.ClassDef)
        for statement in node.body if isinstance(statement, ast.AnnAssign)
        if any(ast.unparse(base).endswith(RECORDS) for base in node.bases)
    }  # fmt: skip
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                yield node.name, node.lineno
            case ast.arg():
                yield node.arg, node.lineno
            case ast.Name(ctx=ast.Store()) if id(node) not in fields:
                yield node.id, node.lineno
            case ast.Attribute(ctx=ast.Store()):
                yield node.attr, node.lineno


def faults(place: Path) -> list[str]:
    """Return the places of retired words in the names of one module, its own among them."""
    tree = ast.parse(place.read_text(encoding="utf-8"))
    names = [(place.stem, 1), *defined_in(tree)]
    return sorted({
        f"{place.relative_to(ROOT)}:{line}: {name}"
        for name, line in names
        if name not in STANDARD and retired().intersection(words_of(name))
    })  # fmt: skip


def modules(of: str) -> list[Path]:
    """Return the modules of a package, or the one module that is named."""
    place = ROOT / of
    return [place] if place.is_file() else sorted(place.rglob("*.py"))


def is_published(place: Path) -> bool:
    """Return whether a module has the names of a published interface."""
    path = place.relative_to(ROOT).as_posix()
    return any(path == each or path.startswith(each + "/") for each in PUBLISHED)


def test_no_identifier_is_made_of_a_retired_word() -> None:
    """Everywhere but where an interface has published the old names."""
    places = [p for top in ("scm", "vehicle_agent") for p in modules(top) if not is_published(p)]
    assert [fault for place in places for fault in faults(place)] == []


def test_words_of_an_identifier() -> None:
    """Both ways of writing are taken apart."""
    assert words_of("_TakePacket") == ["take", "packet"]
    assert words_of("told_ns") == ["told", "ns"]
    assert "told" in retired()
    assert "twins" not in retired()
