"""Peers of the mismatch search: PySINDy's STLSQ on named terms, and a Gaussian-process residual."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bench.mismatch_residuals import NAMES, TARGETS, Residuals

SHIPPED = 0.1  # PySINDy's own threshold
RIDGE = 20.0  # for some 900 rows: terms are alike, and its own 0.05 lets them cancel each other
POINTS = 300  # more make a Gaussian process slow, not better


@dataclass
class Sindy:
    """Sparse regression of every target on its terms.

    Attributes:
        thresholds: Smallest coefficient that is kept, of each target, on terms of unit size.
        sizes: Of each target, by which it is divided; empty: its own standard deviation.
    """

    thresholds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(TARGETS, SHIPPED))
    sizes: dict[str, float] = field(default_factory=dict)

    def coefficients(self, data: Residuals, target: str) -> tuple[np.ndarray, float]:
        """Return coefficients of terms of unit size, and the target's size."""
        from pysindy import STLSQ

        theta, y = data.terms[target], data.targets[target]
        unit = np.maximum(np.sqrt(np.mean(theta**2, axis=0)), 1e-9)
        size = self.sizes.get(target) or max(float(np.std(y)), 1e-12)
        if self.thresholds[target] <= 0.0:
            return np.linalg.lstsq(theta / unit, y / size, rcond=1e-6)[0], size
        fit = STLSQ(threshold=self.thresholds[target], alpha=RIDGE)
        try:
            fit.fit(theta / unit, y / size)
        except ValueError:  # nothing is left
            return np.zeros(theta.shape[1]), size
        return np.asarray(fit.coef_).ravel(), size

    def names(self, data: Residuals) -> list[str]:
        """Return the effects that the surviving terms stand for, largest contribution first."""
        found: list[tuple[float, str]] = []
        for target in data.targets:
            c, _ = self.coefficients(data, target)
            for weight, effects in zip(c, NAMES[target].values(), strict=True):
                found += [(abs(weight), effects[0])] if weight else []
        return list(dict.fromkeys(name for _, name in sorted(found, reverse=True)))

    def forces(self, data: Residuals) -> tuple[np.ndarray, np.ndarray]:
        """Return weights of the drive's and the yaw's terms, to drive with."""
        found = []
        for target in ("drive", "yaw"):
            c, size = self.coefficients(data, target)
            theta = data.terms[target]
            found.append(c * size / np.maximum(np.sqrt(np.mean(theta**2, axis=0)), 1e-9))
        return found[0], found[1]


def calibrated(healthy: Sequence[Residuals]) -> Sindy:
    """Return thresholds at which no healthy recording keeps any term."""
    sizes = {t: float(np.median([np.std(h.targets[t]) for h in healthy])) for t in TARGETS}
    levels = {}
    for target in TARGETS:
        for level in np.geomspace(0.02, 3.0, 30):
            levels[target] = float(level)
            trial = Sindy(dict.fromkeys(TARGETS, float(level)), sizes)
            if not any(trial.coefficients(h, target)[0].any() for h in healthy):
                break
    return Sindy(levels, sizes)


@dataclass
class Gaussian:
    """A Gaussian process for each of the drive's and the yaw's residual; it names nothing."""

    def fit(self, data: Residuals) -> "Gaussian":
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

        pick = np.linspace(0, len(data.regressors) - 1, POINTS).astype(int)
        self._mean, self._std = data.regressors.mean(axis=0), data.regressors.std(axis=0) + 1e-9
        x = (data.regressors[pick] - self._mean) / self._std
        self._models = []
        for target in ("drive", "yaw"):
            y = data.targets[target]
            size = max(float(np.std(y)), 1e-9)
            kernel = ConstantKernel(0.5) * RBF(np.full(x.shape[1], 2.0)) + WhiteKernel(0.5)
            model = GaussianProcessRegressor(kernel, normalize_y=False, random_state=0)
            self._models.append((model.fit(x, y[pick] / size), size))
        return self

    def forces(self, at: np.ndarray) -> tuple[float, float]:
        x = (at - self._mean) / self._std
        drive, yaw = (float(model.predict(x)[0]) * size for model, size in self._models)
        return drive, yaw
