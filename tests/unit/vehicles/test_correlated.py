"""Correlations of a car file: read, refused where they cannot be, and used as a prior."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.errors import CarError
from scm.mismatch.fit.likelihood import prior_precision
from scm.vehicles.car import load_car
from scm.vehicles.car_files import TYPES_DIR

PAIR = ("drive.stall_torque_nm", "drive.no_load_speed_rad_s")


def written(tmp_path, block):
    text = (TYPES_DIR / "nigel.toml").read_text(encoding="utf-8")
    path = tmp_path / "nigel.toml"
    path.write_text(f"{text}\n{block}\n", encoding="utf-8")
    return path


def block(names=PAIR, matrix=((1.0, -0.9), (-0.9, 1.0))):
    listed = ", ".join(f'"{name}"' for name in names)
    return f"[[correlated]]\nnumbers = [{listed}]\nmatrix = {[list(row) for row in matrix]}"


def test_a_group_is_read_as_it_stands(tmp_path):
    (group,) = load_car(written(tmp_path, block())).correlated
    assert group.numbers == PAIR
    assert group.matrix == ((1.0, -0.9), (-0.9, 1.0))


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (block(names=("drive.stall_torque", "drive.no_load_speed_rad_s")), "not in this car"),
        (block(names=("drive.stall_torque_nm",) * 2), "stands twice"),
        (block(matrix=((1.0, 0.9), (0.8, 1.0))), "symmetric"),
        (block(matrix=((1.0, 1.2), (1.2, 1.0))), "positive definite"),
        (block(matrix=((1.0, 0.5, 0.0), (0.5, 1.0, 0.0))), "2 rows of 2"),
        ("[[correlated]]\nnumbers = []", "expected numbers and matrix"),
    ],
)
def test_what_cannot_be_a_correlation_is_refused(tmp_path, wrong, why):
    with pytest.raises(CarError, match=why):
        load_car(written(tmp_path, wrong))


def test_the_prior_of_two_numbers_is_tight_along_what_they_share(tmp_path):
    car = load_car(written(tmp_path, block()))
    precision = prior_precision(car, ["body.mass_kg", *PAIR])
    covariance = np.linalg.inv(precision)
    assert_allclose(covariance, [[1.0, 0.0, 0.0], [0.0, 1.0, -0.9], [0.0, -0.9, 1.0]], atol=1e-12)
    opposite, together = np.array([0.0, 1.0, -1.0]), np.array([0.0, 1.0, 1.0])
    assert together @ precision @ together > 10.0 * (opposite @ precision @ opposite)
