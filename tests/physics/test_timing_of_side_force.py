"""Side force comes when it should: neither a long substep nor a lag of ours shifts a turn."""

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.fleet import Fleet
from tests.every_effect import car_with
from tests.reality.motion import COMMAND_S, ROW, Moving
from tests.reality.numbers import nominal

COMMANDS, STEP_S, FROM_S = 160, 0.005, 2.5
TERMS = {
    "steer_compliance": ("steering.compliance_rad", "give"),
    "tyre_relaxation": ("tyre_relaxation.length_m", "relaxation"),
}


def zigzag():
    """Throttle for about 3 m/s, and leaps of steering after 2 s."""
    rng = np.random.default_rng(1)
    steering = np.zeros(COMMANDS)
    k = 40
    while k < COMMANDS:
        held = rng.integers(4, 12)
        steering[k : k + held] = rng.uniform(-0.25, 0.25)
        k += held
    return np.full(COMMANDS, 0.48), steering


def ours(name, number, substep):
    numbers = {"drive.axle_lock": 1.0, TERMS[name][0]: number}
    fleet = Fleet(car_with([name], numbers, "f1tenth"), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    per = round(COMMAND_S / STEP_S)
    throttle, steering = (np.repeat(part, per) for part in zigzag())
    rate = fleet.rollout(throttle, steering, STEP_S, ("yaw_rate",), substep)["yaw_rate"]
    return STEP_S * (1 + np.arange(len(rate))), np.asarray(rate)[:, 0]


def independent(name, number):
    throttle, steering = zigzag()
    body = Moving(nominal("f1tenth") | {TERMS[name][1]: number}, (0.0, 0.0, 0.0), COMMANDS)
    rows = np.vstack([body.command(k, throttle[k], steering[k]) for k in range(COMMANDS)])
    return rows[:, 0], rows[:, ROW.index("yaw_rate")]


def late_s(run, other):
    """How much later the first run turns [s]."""
    t, rate = run
    use = (t > FROM_S) & (t < t[-1] - 0.01)
    shifts = np.arange(-8e-3, 8.01e-3, 5e-5)
    off = [np.std(rate[use] - np.interp(t[use] - shift, *other)) for shift in shifts]
    return shifts[np.argmin(off)]


def apart(run, other):
    """Root mean square of the difference of two yaw rates [rad/s]."""
    t, rate = run
    use = t > FROM_S
    return np.sqrt(np.mean((rate[use] - np.interp(t[use], *other)) ** 2))


@pytest.mark.parametrize(
    ("name", "number"),
    [("steer_compliance", 0.096), ("steer_compliance", 0.178),
     ("tyre_relaxation", 0.08), ("tyre_relaxation", 0.16)],
)  # fmt: skip
def test_a_car_turns_when_an_independent_one_does(name, number):
    assert abs(late_s(ours(name, number, 1e-3), independent(name, number))) <= 2.5e-4


@pytest.mark.parametrize(
    ("name", "number", "most"),
    [("steer_compliance", 0.178, 0.002), ("tyre_relaxation", 0.08, 0.003),
     ("tyre_relaxation", 0.16, 0.005)],
)  # fmt: skip
def test_a_substep_of_1_ms_turns_as_one_of_a_quarter_does(name, number, most):
    coarse, fine = ours(name, number, 1e-3), ours(name, number, 2.5e-4)
    assert abs(late_s(coarse, fine)) <= 3.5e-4
    assert apart(coarse, fine) < most
