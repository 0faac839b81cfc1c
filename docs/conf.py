"""Settings of the documentation's site; `make docs` builds it in build/site."""

import sys
import tomllib
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "docs" / "make")]

project = "Smart City Manager"
release = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "reference"]
default_role = "code"  # of docstrings, which write `name` as Markdown does
exclude_patterns = ["make"]
myst_heading_anchors = 4
suppress_warnings = ["misc.highlighting_failure"]  # `terms = [..., "servo"]` is not quite TOML

autodoc_default_options = {"members": True, "undoc-members": True}
autodoc_member_order = "bysource"
napoleon_use_ivar = True
toc_object_entries = False
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"Smart City Manager {release}"
html_show_copyright = False
html_show_sourcelink = False
html_copy_source = False


def _leave_out_of_navigation(app: Sphinx, _document: nodes.document) -> None:
    """Keep the pages of 90 effects out of the navigation: `physics/README` lists them."""
    name = app.env.current_document.docname
    if name.startswith("physics/") and name != "physics/README":
        app.env.metadata[name]["orphan"] = "true"


def _leave_out_search(app: Sphinx) -> None:
    app.builder.search = False


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect what is done to each page; with `-t check`, leave out the index for the search."""
    app.connect("doctree-read", _leave_out_of_navigation)
    if app.tags.has("check"):
        app.connect("builder-inited", _leave_out_search)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
