"""How a car moves between sightings: a few tenths of a second of steady driving.

    x' = v cos(yaw) - u sin(yaw)       v' = white noise      v: along the car, at its rear axle
    y' = v sin(yaw) + u cos(yaw)       u' = -u / SLIP_S + white noise           u: to its left
    yaw' = r                           r' = white noise

The lateral speed is a decaying state, not zero: a rear axle does not slip at 0.26 m/s, but it does
at 4 m/s, and a filter that forbids it puts the slip into the yaw. The noises grow with speed,
because what cars do in a second grows with it: from a creeping Nigel to a racing F1TENTH.

Each camera's offset from the truth is a state too, (x, y, yaw), since it does not average out: it
changes only as the car moves over the floor, within about `OFFSET_M`.
"""

import numpy as np

from scm.arrays import Floats

STATES = 6  # x, y, yaw, v, u, yaw rate
OFFSET_STATES = 3  # x, y, yaw of a camera's common offset
SLIP_S = 0.15  # correlation time of slip
ACCEL_S = 0.2
"""Duration of an acceleration: converts its deviation to a density of white noise."""
OFFSET_M = 1.0  # correlation distance of a camera's offset
MAX_PREDICTION_S = 5.0  # a track is dropped then


def predict(mean: Floats, covariance: Floats, shared: Floats, dt: Floats) -> tuple[Floats, Floats]:
    """Return means (n, d) and covariances (n, d, d) of n tracks after spans dt, (n,) [s].

    Args:
        mean: x, y, yaw, v, u, r, then three of each camera's offset.
        covariance: Of these.
        shared: Covariance of each camera's offset at the car's place, (n, cameras, 3, 3).
        dt: Negative spans go back in time and increase the covariance as well.
    """
    dt = np.clip(dt, -MAX_PREDICTION_S, MAX_PREDICTION_S)
    x, y, yaw, v, u, r = mean[:, :STATES].T
    mid = yaw + 0.5 * r * dt
    c, s = np.cos(mid), np.sin(mid)
    keep = np.exp(-np.abs(dt) / SLIP_S)
    slip = SLIP_S * (1.0 - keep) * np.sign(dt)
    moved = mean.copy()
    moved[:, 0] = x + c * v * dt - s * u * slip
    moved[:, 1] = y + s * v * dt + c * u * slip
    moved[:, 2] = yaw + r * dt
    moved[:, 4] = u * keep
    held = np.exp(-np.abs(v * dt) / OFFSET_M)
    moved[:, STATES:] *= held[:, None]
    step = np.zeros_like(covariance)
    own = np.arange(mean.shape[1])
    step[:, own, own] = np.where(own < STATES, 1.0, held[:, None])
    step[:, 0, 2] = y - moved[:, 1]
    step[:, 1, 2] = moved[:, 0] - x
    step[:, 0, 5] = 0.5 * dt * step[:, 0, 2]
    step[:, 1, 5] = 0.5 * dt * step[:, 1, 2]
    step[:, 0, 3], step[:, 1, 3] = c * dt, s * dt
    step[:, 0, 4], step[:, 1, 4] = -s * slip, c * slip
    step[:, 2, 5] = dt
    step[:, 4, 4] = keep
    grown = step @ covariance @ step.swapaxes(1, 2)
    _add_process_noise(grown, v, dt, c, s)
    changed = (1.0 - held**2)[:, None, None]
    for camera in range(shared.shape[1]):
        place = slice(STATES + OFFSET_STATES * camera, STATES + OFFSET_STATES * (camera + 1))
        grown[:, place, place] += changed * shared[:, camera]
    return moved, grown


def slip_std(speed: Floats) -> Floats:
    """Return the standard deviation of the lateral speed [m/s]."""
    found: Floats = 0.004 + 0.06 * np.abs(speed)
    return found


def _add_process_noise(covariance: Floats, v: Floats, dt: Floats, c: Floats, s: Floats) -> None:
    """Add process noise: what the driver and the floor may have done meanwhile."""
    span, fast = np.abs(dt), np.abs(v)
    push = 2.0 * ACCEL_S * (0.2 + 0.6 * fast) ** 2
    turn = 2.0 * ACCEL_S * np.minimum(0.4 + 2.0 * fast, 7.0) ** 2
    side = slip_std(fast) ** 2
    far, near = push * span**3 / 3.0, push * span**2 / 2.0 * np.sign(dt)
    across = side * np.minimum(span, SLIP_S) ** 2 + turn * (fast**2) * span**5 / 20.0
    covariance[:, 0, 0] += c * c * far + s * s * across
    covariance[:, 1, 1] += s * s * far + c * c * across
    mixed = c * s * (far - across)
    covariance[:, 0, 1] += mixed
    covariance[:, 1, 0] += mixed
    for place, along in ((0, c), (1, s)):
        covariance[:, place, 3] += along * near
        covariance[:, 3, place] += along * near
    covariance[:, 2, 2] += turn * span**3 / 3.0
    covariance[:, 2, 5] += turn * span**2 / 2.0 * np.sign(dt)
    covariance[:, 5, 2] += turn * span**2 / 2.0 * np.sign(dt)
    covariance[:, 3, 3] += push * span
    covariance[:, 5, 5] += turn * span
    covariance[:, 4, 4] += side * (1.0 - np.exp(-2.0 * span / SLIP_S))
