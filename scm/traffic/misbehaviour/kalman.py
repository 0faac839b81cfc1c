"""A constant-velocity Kalman filter of one car on the floor, in plain numbers.

    p' = p + v dt, v' = v; jerk of the driver as white noise of acceleration q [m^2/s^3]

x and y share one covariance (a, b; b, c), because a claim has equal variance in both.
A claim gives position and velocity (speed along yaw).
"""

import math

ACCEL_PSD, HARD_PSD = 0.08, 0.9  # q of a driver, and of driving by hand [m^2/s^3]


class Kalman:
    """One car's filter; begins at its first claim.

    Attributes:
        moved_m: How far the last claim was from the prediction.
        moved_mps: Likewise its velocity.
        position_std: Of that prediction and claim together, one axis [m]; `velocity_std` likewise.
        is_warm: Whether there was a prediction.
        has_begun: Whether it has a state.
    """

    __slots__ = (
        "_a", "_b", "_c", "_vx", "_vy", "_x", "_y",
        "has_begun", "is_warm", "moved_m", "moved_mps", "position_std", "velocity_std",
    )  # fmt: skip

    def __init__(self) -> None:
        self._x = self._y = self._vx = self._vy = 0.0
        self._a = self._b = self._c = 0.0
        self.is_warm = self.has_begun = False
        self.moved_m = self.moved_mps = 0.0
        self.position_std = self.velocity_std = 1.0

    def begin(self, x: float, y: float, vx: float, vy: float) -> None:
        """Start anew at a claim."""
        self._x, self._y, self._vx, self._vy = x, y, vx, vy
        self._a, self._b, self._c, self.is_warm = 1e-4, 0.0, 1e-4, False
        self.has_begun = True

    def stop(self) -> None:
        """Drop the state, after a claim without heading or speed."""
        self.is_warm = self.has_begun = False

    def update(
        self, dt: float, x: float, y: float, vx: float, vy: float, own_m: float, own_mps: float,
        psd: float = ACCEL_PSD,
    ) -> None:  # fmt: skip
        """Predict to a claim dt seconds later, store the innovation, and update."""
        q = psd * dt
        a = self._a + dt * (2.0 * self._b + dt * self._c) + q * dt * dt / 3.0
        b = self._b + dt * self._c + q * dt / 2.0
        c = self._c + q
        ex, ey = x - self._x - dt * self._vx, y - self._y - dt * self._vy
        wx, wy = vx - self._vx, vy - self._vy
        r, w = own_m * own_m, own_mps * own_mps
        sa, sc = a + r, c + w
        self.moved_m, self.moved_mps = math.hypot(ex, ey), math.hypot(wx, wy)
        self.position_std, self.velocity_std = math.sqrt(sa), math.sqrt(sc)
        self.is_warm = True
        # Gain K = P S^-1 with S = P + diag(r, w).
        det = sa * sc - b * b
        k11, k12 = (a * sc - b * b) / det, (b * sa - a * b) / det
        k21, k22 = (b * sc - c * b) / det, (c * sa - b * b) / det
        self._x += dt * self._vx + k11 * ex + k12 * wx
        self._y += dt * self._vy + k11 * ey + k12 * wy
        self._vx += k21 * ex + k22 * wx
        self._vy += k21 * ey + k22 * wy
        self._a = (1.0 - k11) * a - k12 * b
        self._b = (1.0 - k11) * b - k12 * c
        self._c = c - k21 * b - k22 * c
