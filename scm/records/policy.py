"""What a trained policy's file says of it."""

import msgspec

POLICY_KEY = "scm_policy"  # of the ONNX file's metadata
INPUT, OUTPUT = "observation", "action"
COMMANDS, SPEED_CURVATURE = ("throttle", "steering"), ("speed_mps", "curvature_per_m")
"""What actions may be: the commands themselves, or what the car's controller turns into them."""


class PolicyMetadata(msgspec.Struct, kw_only=True, frozen=True):
    """A policy.

    Attributes:
        policy: Version of this form.
        task: That it was trained for, with its map.
        observations: Names of its input's columns, each with its unit.
        low, high: Their range; what lies beyond is clipped.
        actions: Names of its output's columns: `COMMANDS` or `SPEED_CURVATURE`.
        action_low, action_high: Their range; what lies beyond is clipped.
        car: File of the cars that it drove.
        period_s: Between two actions.
        agents: Cars in a world.
        scm: Version of the program that it was trained with.
    """

    policy: int
    task: str
    observations: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    car: str
    period_s: float
    agents: int
    scm: str
    actions: tuple[str, str] = COMMANDS
    action_low: tuple[float, float] = (-1.0, -1.0)
    action_high: tuple[float, float] = (1.0, 1.0)
