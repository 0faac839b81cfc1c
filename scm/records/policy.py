"""What a trained policy's file says of it."""

import msgspec

POLICY_KEY = "scm_policy"  # of the ONNX file's metadata
INPUT, OUTPUT = "observation", "action"


class PolicyMetadata(msgspec.Struct, kw_only=True, frozen=True):
    """A policy.

    Attributes:
        policy: Version of this form.
        task: That it was trained for, with its map.
        observations: Names of its input's columns, each with its unit.
        low, high: Their range; what lies beyond is clipped.
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
