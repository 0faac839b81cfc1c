"""No identifier is made of a retired word, see CONTRIBUTING.md; documented names exist."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from tests.contract.javascript import own_names

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "CONTRIBUTING.md"
TWIN_MEANS_CITY_TWIN = {"twin", "twins"}  # a car's versioned file; only effects may not be twins
RECORDS = ("Struct", "BaseModel", "Message", "Record")
STANDARD = {
    "law",  # of `scm.vehicles.jit`: users' own effects import it by its name of 0.1
    "tell",  # of files
    "wait_for_calm",  # of `scm.fleet.City`: scripts of users call it by its name of 0.1
    "__slots__",  # Python's own name
    "_slots_",  # of ctypes structures
    "calm",  # the public name of a signal plan
    "Promise",  # of JavaScript
    "strides",  # of NumPy's and numba's arrays
}
SECTION = re.compile(r"^( *)(Args|Attributes):\n((?:\1 +\S.*\n?)+)", re.MULTILINE)
IDENTIFIER = re.compile(r"[A-Za-z_]\w*")
ENTRY = re.compile(r"^( +)(\*{0,2}\w+(?:, \*{0,2}\w+)*): ")
Definition = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
SCRIPTS = "scm/api/static/js"
PUBLISHED = ("scm/client/nouns",)  # written from the interface: methods carry its operation ids


@cache
def retired() -> set[str]:
    """Return the words of the first column of the table of retired words."""
    table = TABLE.read_text(encoding="utf-8").split("## Retired words")[1]
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("|")][2:]
    words = {word for row in rows for word in re.findall(r"[a-z]+", re.sub(r"\(.*?\)", "", row))}
    return words - TWIN_MEANS_CITY_TWIN


@cache
def text_of(place: Path) -> str:
    """Return the source of a module."""
    return place.read_text(encoding="utf-8")


@cache
def tree_of(place: Path) -> ast.Module:
    """Return the syntax tree of a module."""
    return ast.parse(text_of(place))


def words_of(identifier: str) -> list[str]:
    """Return the words that an identifier is made of, in lower case."""
    found = re.findall(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+", identifier)
    return [word.lower() for word in found]


def defined_in(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield every name that code defines, with its line.

    A field of a record is not among them: its name can be part of a contract, and
    `test_interfaces` holds those.
    """
    fields: set[int] = set()
    for node in ast.walk(tree):  # a class comes before what is in it
        match node:
            case ast.ClassDef():
                if any(ast.unparse(base).endswith(RECORDS) for base in node.bases):
                    fields |= {
                        id(one.target) for one in node.body if isinstance(one, ast.AnnAssign)
                    }
                yield node.name, node.lineno
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                yield node.name, node.lineno
            case ast.arg():
                yield node.arg, node.lineno
            case ast.Name(ctx=ast.Store()) if id(node) not in fields:
                yield node.id, node.lineno
            case ast.Attribute(ctx=ast.Store()):
                yield node.attr, node.lineno


@cache
def is_retired(name: str) -> bool:
    """Return whether an identifier is made of a retired word."""
    return name not in STANDARD and not retired().isdisjoint(words_of(name))


def faults(place: Path) -> list[str]:
    """Return the places of retired words in the names of one module, its own among them.

    Only a module that has one anywhere, comments included, is parsed.
    """
    if not any(is_retired(word) for word in {place.stem, *IDENTIFIER.findall(text_of(place))}):
        return []
    names = [(place.stem, 1), *defined_in(tree_of(place))]
    return sorted({
        f"{place.relative_to(ROOT)}:{line}: {name}"
        for name, line in names
        if is_retired(name)
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


def test_no_name_of_the_dashboards_scripts_is_made_of_a_retired_word() -> None:
    """The names of their files among them."""
    wrong = [
        f"{place.relative_to(ROOT)}:{line}: {name}"
        for place in sorted((ROOT / SCRIPTS).rglob("*.js"))
        for name, line in [(place.stem, 1), *own_names(place.read_text(encoding="utf-8"))]
        if name not in STANDARD and retired().intersection(words_of(name))
    ]
    assert wrong == []


def test_words_of_an_identifier() -> None:
    """Both ways of writing are taken apart."""
    assert words_of("_TakePacket") == ["take", "packet"]
    assert words_of("told_ns") == ["told", "ns"]
    assert "told" in retired()
    assert "twins" not in retired()
    script = "const told = `${heard} said`; row.asked = { wish: /kept/.test(a) }; f(this.shelf)"
    assert [name for name, _ in own_names(script)] == [
        "const", "told", "heard", "row", "a", "f", "this", "shelf"
    ]  # fmt: skip


def test_documented_arguments_and_attributes_exist() -> None:
    """What "Args:" and "Attributes:" list are names of the function or the class."""
    places = [
        place
        for top in ("scm", "vehicle_agent")
        for place in modules(top)
        if SECTION.search(text_of(place))
    ]
    assert [f"{p.relative_to(ROOT)}: {n}" for p in places for n in undefined(tree_of(p))] == []


def definitions(inside: ast.Module | Definition) -> Iterator[Definition]:
    """Yield the classes and functions of a module, those inside classes too."""
    for node in inside.body:
        if isinstance(node, Definition):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from definitions(node)


def undefined(module: ast.Module) -> Iterator[str]:
    """Yield what the docstrings of a module list that the code does not have."""
    for node in definitions(module):
        for indent, title, block in SECTION.findall(ast.get_docstring(node) or ""):
            entries = [ENTRY.match(line) for line in block.splitlines()]
            depth = min(len(e[1]) for e in entries if e) if any(entries) else len(indent)
            listed = [
                e[2].replace("*", "").split(", ") for e in entries if e and len(e[1]) == depth
            ]
            known = names_of(node, title)
            yield from (f"{node.name}: {n}" for names in listed for n in names if n not in known)


def names_of(node: Definition, title: str) -> set[str]:
    """Return the parameters of a function or class, or the attributes of a class."""
    if not isinstance(node, ast.ClassDef):
        return {each.arg for each in ast.walk(node.args) if isinstance(each, ast.arg)}
    names = {
        each.id
        for part in node.body
        for each in ast.walk(part)
        if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)
    }
    names |= {each.name for each in definitions(node)}
    names |= {
        each.attr
        for each in ast.walk(node)
        if isinstance(each, ast.Attribute) and ast.unparse(each.value) == "self"
    }
    if title == "Args":
        names |= {
            a.arg for each in definitions(node) for a in ast.walk(each) if isinstance(a, ast.arg)
        }
    return names
