"""Car files as people make them: a few figures, a drawing, and the car drives."""

import pytest

from tests.e2e.pages.visiting import LOOKS

MADE = ".new-car .above"
COMPILING_MS = 120_000  # the first car of a file


@pytest.fixture(scope="module", autouse=True)
def own_cars(tmp_path_factory):
    """Give the city a folder for people's car files."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SCM_CARS", str(tmp_path_factory.mktemp("cars")))
        yield


@pytest.mark.parametrize(("size", "theme"), LOOKS)
def test_the_page_lists_car_files_and_draws_the_new_one(look, size, theme):
    page = look("/cars", "cars", size, theme, ready=MADE).page
    assert "follows all" in page.inner_text("tr[data-file=nigel]")
    assert "wider than" in page.inner_text("tr[data-file=f1tenth]")
    assert page.get_attribute("nav a[aria-current=page]", "href") == "/vehicles"


def test_a_car_from_a_few_figures_drives_on_the_map_at_its_size(visit, running):
    visited = visit("/cars")
    page = visited.page
    page.wait_for_selector(MADE)
    for field, value in {
        "car": "page_buggy", "mass_kg": "1.8", "wheelbase_m": "21", "top_speed_mps": "2",
    }.items():  # fmt: skip
        page.fill(f".new-car [name={field}]", value)
    page.click("text=More figures")
    page.fill(".new-car [name=length_m]", "37")
    page.wait_for_selector(".new-car p:has-text('It can follow all lanes')")
    assert "mass_kg = { value = 1.8" in page.text_content(".new-car pre")
    page.click("text=Make the car file")
    page.wait_for_selector("tr[data-file=page_buggy]:has-text('own')")
    page.click(".new-car .next a:text-is('map')")
    page.click('button:text("Add a car")')
    page.wait_for_selector("dialog option:text-is('page_buggy')", state="attached")
    page.select_option("dialog select[name=car]", "page_buggy")
    page.fill("dialog input[name=vehicle]", "pb1")
    page.click("dialog button.primary")
    page.wait_for_selector("tr[data-car=pb1], tr:has-text('pb1')", timeout=COMPILING_MS)
    try:
        visited.wait(  # its shape is fetched once the car is there
            """async () => {
                const of = (await import('scm/shared/car_shape.js')).footprint('page_buggy');
                return Math.abs(of.front - of.rear - 0.37) < 1e-3 && of.wheelbase === 0.21;
            }"""
        )
    finally:
        running.web.delete("/vehicles/pb1").raise_for_status()


def test_a_name_that_is_taken_is_said_before_it_is_sent(visit):
    page = visit("/cars").page
    page.wait_for_selector(MADE)
    page.fill(".new-car [name=car]", "nigel")
    page.wait_for_selector(".new-car .form-error:has-text('named nigel already')")
    assert page.is_disabled("text=Make the car file")
    page.fill(".new-car [name=car]", "mine")
    page.fill(".new-car [name=mass_kg]", "-3")
    page.wait_for_selector(".new-car .form-error:has-text('mass_kg')")
