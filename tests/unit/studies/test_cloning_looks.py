"""Looks of cameras, drawn by the study file that shows how."""

from pathlib import Path

from scm.camera.optics import fitted, optics_of
from scm.study.loaded_study import load
from scm.vehicles.car import varied_cars

STUDY = Path(__file__).parents[3] / "studies" / "cloning_looks.toml"


def test_each_case_has_a_camera_of_its_own_and_a_demonstration_has_others():
    usual = fitted("nigel")["front"]
    study, demonstration = load(STUDY), load(STUDY, "demonstration")
    seen = set()
    for which in (study, demonstration):
        for number in range(3):
            cars = which.case(number).cars
            with varied_cars(cars):
                look = fitted("nigel")["front"]
            assert look == optics_of(cars["nigel"], "front")
            seen.add(look)
    assert len(seen | {usual}) == 7
    varied = {"exposure", "gamma", "vignetting", "blur_px", "exposure_time_s", "read_noise", "roll"}
    assert all(getattr(a, name) != getattr(usual, name) for a in seen for name in varied)
    assert fitted("nigel")["front"] == usual
