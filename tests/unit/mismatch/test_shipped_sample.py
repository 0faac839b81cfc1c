"""The recording that comes with the repository: README's line finds what it conceals."""

from pathlib import Path

from scm.clock import StepClock, nanoseconds
from scm.mismatch.pipeline import diagnose, write
from scm.mismatch.validate.check_report import check_report

CONCEALED_RAD = 0.0628  # as docs/make/sample.py prints
SPAN_S = 40.0  # of 60: enough for the effect to be selected
BUDGET_S = 100.0


def test_the_sample_s_steering_trim_is_found_and_its_report_is_true(
    root: Path, tmp_path: Path
) -> None:
    """Time is up once all effects of the catalogue are tried: what else there is has own tests."""
    clock, fitted = StepClock(), list[str]()

    def notify(step: str) -> None:
        if step.startswith("fitting to the end"):
            fitted.append(step)
        elif fitted:
            clock.set_ns(nanoseconds(BUDGET_S))

    searched = diagnose([root / "recordings" / "sample"], span_s=(0.0, SPAN_S),
                        budget_s=BUDGET_S, notify=notify, clock=clock)  # fmt: skip
    found = searched.diagnosis
    assert [effect.name for effect in found.effects] == ["steer_trim"]
    trim = found.effects[0].parameters["offset_rad"]
    assert trim.low <= CONCEALED_RAD <= trim.high
    assert found.fit is not None
    confirm = found.fit.confirm
    assert confirm.after["position_m"] < 0.1 * confirm.before["position_m"]
    assert found.fit.retuned is not None
    assert found.fit.witness is not None
    assert confirm.after["position_m"] < 0.5 * found.fit.witness.position_m
    write(searched, tmp_path)
    assert searched.selected is not None
    figures = check_report(tmp_path, searched.selected.recordings)
    assert {figure.car for figure in figures} == {"given.toml", "car.toml", "bicycle"}
    assert [figure for figure in figures if not figure.agrees] == []
