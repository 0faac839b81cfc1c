"""How far a car with a learned residual strays on another drive: free runs of one second.

The car drives once through all recorded commands, its pose carried to the measured one every
second, as `scm trial` judges patched cars; a peer's residual pushes it at every step.
"""

import numpy as np

from bench.mismatch_residuals import regressors, state_terms
from scm.geometry import Pose2
from scm.recording.motion import Poses
from scm.replay.commands import Commands
from scm.vehicles.fleet import Fleet

EVERY_S, STEP_S, WARM_UP_S = 0.1, 0.005, 3.0


def position_error(recording, car, pushes, horizon_s=1.0):
    """Return the rms position error at the end of each free run [m].

    Args:
        pushes: (state) -> accelerations along the body and about z; None: the car alone.
    """
    poses, commands = Poses(recording), Commands(recording, car)
    first = max(commands.span_s[0], float(poses.t[0])) + 0.1
    last = min(commands.span_s[1], float(poses.t[-1])) - 0.1
    t = np.arange(first, last, EVERY_S)
    seen = poses.motion(t)
    fleet = Fleet(car, 1)
    fleet.add(Pose2(float(seen.x[0]), float(seen.y[0]), float(seen.yaw[0])), float(seen.speed[0]))
    per, errors, history = round(horizon_s / EVERY_S), [], _History()
    for k, now in enumerate(t):
        if k and k % per == 0 and seen.valid[k]:
            if now > first + WARM_UP_S:
                errors.append(np.hypot(fleet.x[0] - seen.x[k], fleet.y[0] - seen.y[k]))
            _carry(fleet, seen, k)
        steps = now + STEP_S * np.arange(round(EVERY_S / STEP_S)) + 1e-9
        fleet.rollout(*commands.at(steps), STEP_S, ())
        if pushes is not None:
            along, turn = pushes(history.state(fleet, commands, float(now)))
            c, s = np.cos(fleet.yaw[0]), np.sin(fleet.yaw[0])
            # tyres and motors undo a push at once, so a step's lack of speed goes into its way too
            dv, dr = EVERY_S * along, EVERY_S * turn
            way, yaw = EVERY_S * dv, EVERY_S * dr
            change = (c * dv, s * dv, dr, c * way, s * way, yaw)
            fleet.push_rows(np.array([0]), np.array([change]))
    return float(np.sqrt(np.mean(np.square(errors))))


class _History:
    """What of the past a term needs."""

    def __init__(self):
        self.heat, self.speed = 0.0, 0.0

    def state(self, fleet, commands, now):
        u, s = (float(c[0]) for c in commands.at(np.array([now])))
        u0, s0 = (float(c[0]) for c in commands.at(np.array([now - 0.2])))
        self.heat += EVERY_S * (u * u - self.heat / 60.0)
        v, r, yaw = float(fleet.speed[0]), float(fleet.yaw_rate[0]), float(fleet.yaw[0])
        a, self.speed = (v - self.speed) / EVERY_S, v
        return {"u": u, "s": s, "du": (u - u0) / 0.2, "ds": (s - s0) / 0.2, "v": v, "a": a, "r": r,
                "yaw": yaw, "t": now, "heat": self.heat, "x": float(fleet.x[0]),
                "y": float(fleet.y[0])}  # fmt: skip


def sindy_pushes(forces, v_top):
    """Return the push of a sparse regression."""
    keys = ("u", "s", "du", "ds", "v", "a", "r", "yaw", "t", "heat")

    def pushes(state):
        drive, turn = state_terms(*(np.array([state[k]]) for k in keys), v_top)
        return float(drive[0] @ forces[0]), float(turn[0] @ forces[1])

    return pushes


def gaussian_pushes(gaussian):
    """Return the push of a Gaussian process."""
    keys = ("u", "s", "v", "r", "yaw", "t", "x", "y")

    def pushes(state):
        return gaussian.forces(regressors(*(np.array([state[k]]) for k in keys)))

    return pushes


def _carry(fleet, seen, k):
    """Set the pose to the measured one; speeds along and across the body stay."""
    now = fleet.planar_cogs(np.array([0]))[0]
    turn = np.arctan2(np.sin(seen.yaw[k] - fleet.yaw[0]), np.cos(seen.yaw[k] - fleet.yaw[0]))
    c, s = np.cos(turn), np.sin(turn)
    arm_x, arm_y = now[0] - fleet.x[0], now[1] - fleet.y[0]
    change = (c * now[3] - s * now[4] - now[3], s * now[3] + c * now[4] - now[4], 0.0,
              seen.x[k] + c * arm_x - s * arm_y - now[0],
              seen.y[k] + s * arm_x + c * arm_y - now[1], turn)  # fmt: skip
    fleet.push_rows(np.array([0]), np.array([change]))
