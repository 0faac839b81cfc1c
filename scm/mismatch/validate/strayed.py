"""Where and when a car strays for which no cause was found: its free runs after re-tuning.

What it strays along its way is laid to the drive, what it strays across to the steering.
"""

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.evidence import FreeRuns
from scm.mismatch.findings import Equation, Fit, Located
from scm.mismatch.validate.locate import box_of, spans_of

LEAST_SHARE = 0.1  # of the error, to be told


def strayed(runs: FreeRuns, fit: Fit) -> tuple[Located, ...]:
    """Return where the error of the free runs `after` lies, the larger part first.

    Args:
        runs: Of the re-tuned car.
        fit: Judged with them; noise of measuring alone is taken off by its floor.
    """
    floor_m = fit.confirm.noise_floor.get("position_m", 0.0)
    along, across = _apart(runs)
    known: Bools = np.isfinite(along) & np.isfinite(across)
    if not known.any() or floor_m <= 0.0:
        return ()
    middle = runs.measured["x"].shape[1] // 2
    x, y = (runs.measured[name][:, middle] for name in ("x", "y"))
    known &= np.isfinite(x) & np.isfinite(y)
    t = runs.start_s + 0.5 * float(runs.t_s[-1])
    beyond = {
        equation: 2.0 * (apart[known] / floor_m) ** 2 - 1.0
        for equation, apart in ((Equation.DRIVE, along), (Equation.STEERING, across))
    }
    sums = {equation: max(float(gain.sum()), 0.0) for equation, gain in beyond.items()}
    total = sum(sums.values())
    located = [
        Located(
            equation=equation,
            channels=("pose.x", "pose.y"),
            depends_on=(),
            when_s=spans_of(beyond[equation], t[known]),
            where=box_of(beyond[equation], x[known], y[known]),
            share_of_error=mine / total,
        )
        for equation, mine in sums.items()
        if mine > LEAST_SHARE * total
    ]
    return tuple(sorted(located, key=lambda one: -one.share_of_error))


def _apart(runs: FreeRuns) -> tuple[Floats, Floats]:
    """Return how far windows end along the recorded heading and across it [m]."""
    dx, dy = (runs.after[name][:, -1] - runs.measured[name][:, -1] for name in ("x", "y"))
    yaw = runs.measured["yaw"][:, -1]
    return np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
