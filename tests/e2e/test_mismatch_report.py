"""The report of a diagnosis in a real browser, on a desk and on a phone."""

import os
import shutil
from pathlib import Path

import pytest

from scm.mismatch.report.write import write_report
from tests.unit.mismatch import made_up_findings as made_up

CHROMIUM = shutil.which("chromium") or "/usr/bin/chromium"
pytestmark = [
    pytest.mark.e2e,
    pytest.mark.skipif(
        not Path(CHROMIUM).exists() and "CI" not in os.environ,
        reason=f"no browser: {CHROMIUM} is missing (apt-get install chromium)",
    ),
]
SMALLEST_TEXT_PX = 9.0


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield chromium
        chromium.close()


@pytest.fixture
def open_report(browser, tmp_path):
    contexts = []

    def open_at(name, width, scheme="light"):
        write_report(*made_up.CASES[name](), tmp_path)
        context = browser.new_context(viewport={"width": width, "height": 844}, color_scheme=scheme)
        contexts.append(context)
        page = context.new_page()
        page.complaints, page.asked = [], []
        page.on("console", lambda message: page.complaints.append(message.text))
        page.on("request", lambda request: page.asked.append(request.url))
        page.goto((tmp_path / "report.html").as_uri())
        return page

    yield open_at
    for context in contexts:
        context.close()


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("name", made_up.CASES)
def test_the_page_fits_its_window_and_asks_only_for_itself(open_report, name, width):
    page = open_report(name, width)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.complaints == []
    assert len(page.asked) == 1


def test_pictures_can_be_read_on_a_phone(open_report):
    page = open_report("pair", 390)
    heights = page.evaluate(
        """() => [...document.querySelectorAll('svg')].map(svg => {
            const scale = svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
            return scale * parseFloat(getComputedStyle(svg).fontSize);
        })"""
    )
    assert min(heights) > SMALLEST_TEXT_PX


def test_no_text_of_a_picture_is_cut_off(open_report):
    page = open_report("pair", 1280)
    cut = page.evaluate(
        """() => [...document.querySelectorAll('svg')].flatMap(svg => {
            const box = svg.getBoundingClientRect();
            return [...svg.querySelectorAll('text')].filter(text => {
                const inner = text.getBoundingClientRect();
                const cut = inner.left < box.left - 1 || inner.right > box.right + 1;
                    return inner.width > 0 && cut;  // a hidden layer's text has no width
            }).map(text => text.textContent);
        })"""
    )
    assert cut == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out_from_its_paper_in_both_schemes(open_report, scheme):
    page = open_report("one_effect", 1280, scheme)
    ink, paper = page.evaluate(
        """() => ['color', 'backgroundColor'].map(name =>
            getComputedStyle(document.querySelector('.card'))[name]
            .match(/[0-9]+/g).slice(0, 3).map(Number).reduce((a, b) => a + b) / 3)"""
    )
    assert abs(ink - paper) > 180
    assert (paper > 128) == (scheme == "light")
