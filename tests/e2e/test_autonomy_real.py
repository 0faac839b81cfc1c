"""The parking agent and the published Nigel, emulated behind its serial lines, under the Eye."""

import pytest

from bench.autonomy_real import drive


@pytest.mark.slow
def test_parking_agent_parks_the_emulated_published_nigel(tmp_path):
    row = drive(1, tmp_path, "parking")
    assert row["parked"] == 1.0
    assert row["clearance_m"] > 0.0
