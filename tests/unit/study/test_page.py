"""What a person sees of a study: the text, the page, and the line while it runs."""

import io
import re

import pytest

from scm.study import plots
from scm.study.live_table import LiveTable
from scm.study.loaded_study import load
from scm.study.page import study_page
from scm.study.results import create_results, open_results
from scm.study.run import run_study
from scm.study.text_report import text_report
from tests.unit.study.studying import Here, loaded, write

SCENARIO = """def run(case, a=1.0, b=0.0, kind='x'):
    if kind == 'y' and a > 2.5: raise ValueError('<too> much')
    return {'total': a + b}
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    factors = 'b = { uniform = [0.0, 2.0] }\nkind = ["x", "y"]'
    study = loaded(folder, scenario=SCENARIO, factors=factors, more="samples = 10")
    run_study(create_results(study, folder / "out", []), Here(study), lambda _: None)
    return open_results(folder / "out")


def test_the_text_begins_with_what_did_not_end_and_then_the_worst(results):
    lines = text_report(results)
    assert lines[0] == "adding: Adding"
    assert re.fullmatch(r"240 of 240 cases: \d+ success, 40 error, \d+ failure", lines[1])
    assert lines[3].startswith("failures, the worst first (10 of ")
    assert "error: ValueError: <too> much (adds.py:2); a = 3, " in lines[4]
    assert any(line.startswith("  scm study replay ") for line in lines)


def test_the_text_has_success_and_measures_by_factor_and_main_effects(results):
    text = "\n".join(text_report(results))
    assert re.search(r"\na +cases +success \[%\] +total \[1\]\n", text)
    assert re.search(r"\n2 +80 +100\.0 \[95\.4, 100\.0\] ", text)
    assert re.search(r"main effects.*\nfactor +measure", text)


def test_the_page_loads_nothing_and_escapes_what_scenarios_say(results):
    page = study_page(results)
    assert "&lt;too&gt; much" in page
    assert "<too>" not in page
    assert not re.search(r"(src|href)=\"(?!#)", page)
    assert "http" not in re.sub(r'xmlns(:\w+)?="[^"]*"', "", page).replace("http://www.w3.org", "")
    assert page.count("<svg") >= 2
    named = re.findall(r'<(?!path|clipPath|use)\w+ [^>]*?\bid="([^"]*)"', page)
    assert len(named) == len(set(named))


def test_the_page_s_pictures_take_the_page_s_colours(results):
    page = study_page(results)
    assert "var(--ink)" in page
    assert not re.search(r"(fill|stroke): ?#(?!000000|ffffff)[0-9a-f]{6}", page)


def test_a_study_without_limits_has_ended_cases_and_no_success(tmp_path):
    path = write(tmp_path)
    path.write_text(path.read_text().replace("at_most = 4.5", ""))
    study = load(path)
    results = create_results(study, tmp_path / "out", [])
    run_study(results, Here(study), lambda _: None)
    lines = text_report(results)
    assert lines[1] == "12 of 12 cases: 12 ended"
    assert lines[3] == "no failures"
    assert "success" not in "\n".join(lines)


def test_the_line_says_how_far_it_is_and_names_each_case_that_did_not_end(results):
    stream = io.StringIO()
    table = LiveTable(stream, results, 240)
    assert "240 of 240; success" in table.line()
    error = next(row for row in results.rows.values() if row.outcome == "error")
    table.add(error)
    assert stream.getvalue().startswith(f"case {error.case} (a = 3, b = ")
    assert "41 did not end" in table.line()
    table.close()


def test_the_text_of_a_study_that_has_not_begun(tmp_path):
    study = loaded(tmp_path)
    assert text_report(create_results(study, tmp_path / "out", []))[1] == "0 of 12 cases: none yet"


def test_a_plot_of_many_cases_has_a_limited_number_of_dots(results, monkeypatch):
    rows = [row for row in results.rows.values() if row.has_ended]
    drawn = results.study.design.axes[1]
    marks = []
    for most in (len(rows), 3):
        monkeypatch.setattr(plots, "MAX_DOTS", most)
        (plot,) = plots.plots_of(rows, [drawn], "total", "1")
        marks.append(plot.svg.count("<use"))
    assert marks[0] - marks[1] > len(rows) / 2  # the rest are ticks and levels
