"""The page: one HTML file that asks nobody for anything, and needs no script to be read."""

from html import escape
from pathlib import Path

from scm.mismatch.evidence import Evidence
from scm.mismatch.findings import Diagnosis
from scm.mismatch.report.drawings import Drawings
from scm.mismatch.report.expert import expert_sections
from scm.mismatch.report.first_screen import first_screen
from scm.mismatch.report.html_text import around, tag
from scm.mismatch.report.plot import colours_css
from scm.mismatch.report.verdict_text import verdict_sentence
from scm.vehicles.car import Car

_CHAPTERS = {
    "where": "where",
    "when": "when",
    "curves": "the effect",
    "runs": "free runs",
    "numbers": "numbers",
    "tried": "what was tried, rivals",
    "data": "the recording",
    "reading": "how to read this",
    "inputs": "inputs",
}


def page_html(
    diagnosis: Diagnosis,
    evidence: Evidence,
    drawings: Drawings,
    cars: tuple[Car, Car],
    use: str,
) -> str:
    """Return the page; `cars` are the given one and the patched one, `use` what to do with it."""
    below = expert_sections(diagnosis, evidence, drawings, cars)
    body = first_screen(diagnosis, evidence) + tag("p", use, "use") + _links(below) + below
    return document(f"{evidence.vehicle}: {verdict_sentence(diagnosis)}", body)


def document(title: str, body: str) -> str:
    """Return a whole page around HTML that is safe already."""
    style = colours_css() + Path(__file__).with_name("style.css").read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n"
        f"{around('main', body)}\n</body>\n</html>\n"
    )


def _links(below: str) -> str:
    """Return links to the sections that there are."""
    links = [
        f'<a href="#{anchor}">{words}</a>'
        for anchor, words in _CHAPTERS.items()
        if f'<section id="{anchor}">' in below
    ]
    return around("nav", tag("span", "For experts:") + "".join(links))
