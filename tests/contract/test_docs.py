"""The documentation is a site that builds without a warning, and what it names exists.

The same holds for the docstrings of packages.
"""

import ast
import importlib.util
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

FOLDERS = "bench|docs|examples|maps|recordings|scm|tests|vehicle_agent"
PATH = re.compile(rf"`((?:{FOLDERS})/[\w./-]+)`")
MODULE = re.compile(r"`((?:scm|vehicle_agent)(?:\.[a-z]\w*)+)(?:\.[A-Z]\w*)*`")
NO_MODULES = {"scm.drive.v1"}  # a protocol of WebSockets
NAMED = re.compile(r"`([a-z][\w./]*)`")  # a module, folder or file in a package's docstring
COLUMN = re.compile(r"^ *([a-z]\w*/?(?:, [a-z]\w*/?)*) {2,}\S", re.MULTILINE)  # in a table of it
NO_FILES = {"recording.yaml", "report.json", "drawn.json", "report.html", "car.toml"}
NO_FILES |= {"value", "t", "start", "cycle", "router"}  # arguments and functions of plug-ins
MADE = ("docs/physics/", "docs/changelog.md")  # by the code, and a history


def pages(root: Path) -> list[Path]:
    """Return the pages that people write."""
    found = [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "docs").rglob("*.md"))]
    return [p for p in found if not p.relative_to(root).as_posix().startswith(MADE)]


class Links(HTMLParser):
    """Collects what a page links to and shows."""

    def __init__(self) -> None:
        super().__init__()
        self.targets: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the address of a link or picture."""
        wanted = {"a": "href", "img": "src"}.get(tag)
        self.targets |= {value for name, value in attrs if name == wanted and value}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory, root: Path) -> Path:
    """The whole site, in a plain theme: the navigation of its own takes as long as all else.

    Without search and typographic quotes as well.
    """
    pytest.importorskip("sphinx", reason="Sphinx comes with `make test`")
    folder = tmp_path_factory.mktemp("site")
    options = ["-q", "-W", "--keep-going", "-b", "html", "-D", "html_theme=basic"]
    options += ["-t", "check", "-D", "smartquotes=0"]
    command = [sys.executable, "-m", "sphinx", *options, "-d", str(folder / "trees")]
    done = subprocess.run(
        [*command, str(root / "docs"), str(folder)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder


def test_the_site_builds_without_a_warning(site: Path) -> None:
    for page in ("start", "client", "messages", "commands", "physics/servo", "changelog"):
        assert (site / f"{page}.html").is_file()


def test_every_link_of_the_site_leads_to_a_file(site: Path) -> None:
    broken = []
    for page in sorted(site.rglob("*.html")):
        links = Links()
        links.feed(page.read_text(encoding="utf-8"))
        for target in links.targets:
            path = unquote(target.partition("#")[0])
            if path and not re.match(r"[a-z]+:", path) and not (page.parent / path).exists():
                broken.append(f"{page.relative_to(site)}: {target}")
    assert broken == []


def test_every_path_that_a_page_names_exists(root: Path) -> None:
    missing = [
        f"{page.relative_to(root)}: {path}"
        for page in pages(root)
        for path in PATH.findall(page.read_text(encoding="utf-8"))
        if not (root / path).exists()
    ]
    assert missing == []


def test_every_module_that_a_page_names_exists(root: Path) -> None:
    missing = [
        f"{page.relative_to(root)}: {name}"
        for page in pages(root)
        for name in MODULE.findall(page.read_text(encoding="utf-8"))
        if name not in NO_MODULES and not is_there(root, name)
    ]
    assert missing == []


def is_there(root: Path, name: str) -> bool:
    """Return whether a module exists, or the name that it defines."""
    place = root / name.replace(".", "/")
    if place.is_dir() or place.with_suffix(".py").is_file():
        return True
    module, _, attribute = name.rpartition(".")
    if importlib.util.find_spec(module) is None:
        return False
    return hasattr(importlib.import_module(module), attribute)


def sources(root: Path) -> list[Path]:
    """Return the modules of the product."""
    return [p for top in ("scm", "vehicle_agent") for p in sorted((root / top).rglob("*.py"))]


def test_every_module_that_a_package_docstring_names_exists(root: Path) -> None:
    """Seen from the package itself, from one that contains it, or from the root."""
    missing = []
    for file in (p for p in sources(root) if p.name == "__init__.py"):
        text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
        columns = {name for names in COLUMN.findall(text) for name in names.split(", ")}
        places = [p for p in file.parents if p == root or root in p.parents]
        missing += [
            f"{file.relative_to(root)}: {name}"
            for name in sorted((columns | set(NAMED.findall(text))) - NO_FILES)
            if not any(is_file(place, name) for place in places)
        ]
    assert missing == []


def is_file(place: Path, name: str) -> bool:
    """Return whether a folder holds a file, folder or module of this name."""
    module = place / name.replace(".", "/")
    return any(p.exists() for p in (place / name, module, module.with_suffix(".py")))
