"""The recording that comes with the repository: README's line finds what it conceals."""

from pathlib import Path

import pytest

from scm.mismatch.pipeline import diagnose, write
from scm.mismatch.validate.check_report import check_report

CONCEALED_RAD = 0.0628  # as docs/make/sample.py prints
BUDGET_S = 240.0  # twice the usual: other tests take the processor too


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_the_sample_s_steering_trim_is_found_and_its_report_is_true(
    root: Path, tmp_path: Path
) -> None:
    searched = diagnose([root / "recordings" / "sample"], budget_s=BUDGET_S)
    found = searched.diagnosis
    assert [effect.name for effect in found.effects] == ["steer_trim"]
    trim = found.effects[0].parameters["offset_rad"]
    assert trim.low <= CONCEALED_RAD <= trim.high
    assert found.fit is not None
    confirm = found.fit.confirm
    assert confirm.after["position_m"] < 0.1 * confirm.before["position_m"]
    write(searched, tmp_path)
    assert searched.selected is not None
    figures = check_report(tmp_path, searched.selected.recordings)
    assert figures
    assert [figure for figure in figures if not figure.agrees] == []
