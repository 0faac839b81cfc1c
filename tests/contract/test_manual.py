"""The manual of effects that is committed is the one that the effects write."""

from pathlib import Path

import pytest

from scm.vehicles.describe_effects import all_effects
from scm.vehicles.manual.folder import INDEX, index_page, pages_of
from scm.vehicles.manual.manoeuvres import MANOEUVRES
from scm.vehicles.manual.picture import PLOTS, cars_of
from scm.vehicles.manual.shown import shown_of
from scm.vehicles.term import Term

FOLDER = Path(__file__).parents[2] / "docs" / "physics"
REMAKE = "run: scm show terms --docs docs/physics"
TERMS = {name: effect for name, effect in all_effects().items() if isinstance(effect, Term)}


def test_the_index_is_up_to_date():
    assert (FOLDER / INDEX).read_text(encoding="utf-8") == index_page(all_effects()), REMAKE


@pytest.mark.parametrize("name", all_effects())
def test_a_page_is_up_to_date_and_has_its_picture(name):
    (text,) = pages_of([all_effects()[name]]).values()
    assert (FOLDER / f"{name}.md").read_text(encoding="utf-8") == text, REMAKE
    picture = (FOLDER / f"{name}.svg").read_text(encoding="utf-8")
    assert picture.startswith("<svg ")
    assert "nan" not in picture


def test_no_page_outlives_its_effect():
    written = {path.stem for path in FOLDER.iterdir()} - {Path(INDEX).stem}
    assert written == set(all_effects())


def test_the_folder_stays_small():
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 3e6


@pytest.mark.parametrize("name", TERMS)
def test_a_picture_compares_two_cars_that_differ(name):
    term, shown = TERMS[name], shown_of(TERMS[name])
    assert shown.manoeuvre in MANOEUVRES
    assert shown.see in PLOTS
    (without, _), (with_it, _) = cars_of(term, shown)
    assert term in with_it.terms
    same = without.terms == with_it.terms and without.values == with_it.values
    assert not same or PLOTS[shown.see].dashed is not None
