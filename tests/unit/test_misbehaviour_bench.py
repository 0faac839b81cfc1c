"""What the bench of misbehaviour keeps and counts."""

import pytest
from msgspec.structs import replace
from numpy.testing import assert_allclose

from bench.misbehaviour import TOWNS, Outcome, Tally, rate_below, stored_story

SMALL = replace(TOWNS["school"], cars=2, span_s=1.0)


def test_a_stored_city_reads_back_unchanged(tmp_path):
    story = stored_story(SMALL, 1, None, own_eye=False)
    assert stored_story(SMALL, 1, tmp_path, own_eye=False) == story
    (path,) = tmp_path.iterdir()
    written = path.stat().st_mtime_ns
    assert stored_story(SMALL, 1, tmp_path, own_eye=False) == story
    assert path.stat().st_mtime_ns == written
    assert {frame.station for frame in story.frames} == {"n1", "n2"}
    assert {track.vehicle for track in story.tracks} == {"n1", "n2"}


@pytest.mark.parametrize(("count", "mean"), [(0, 2.9957), (1, 4.7439), (5, 10.513)])
def test_the_bound_of_a_rate_is_that_of_the_poisson_tables(count, mean):
    assert_allclose(rate_below(count, 2.0), mean / 2.0, rtol=1e-3)


def test_a_report_on_a_liar_is_found_and_one_on_an_honest_car_is_blame():
    tally = Tally()
    outcome = Outcome({"n1": 10**9, "n2": 10**9}, {"n1": 3 * 10**9, "n3": 10**9}, {}, {"n3": 6.0})
    outcome.why.update(n1="a", n3="b")
    tally.add(outcome, 4, {"n1", "n2"}, 900.0)
    assert tally.cell() == "0.50, 0.50, 2.0, 1.00"
    assert tally.highest == 6.0
