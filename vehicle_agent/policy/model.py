"""A policy that was read, ready to drive."""

from pathlib import Path

import msgspec
import numpy as np

from scm.arrays import Floats
from scm.errors import LearningError
from scm.records.policy import (
    COMMANDS,
    INPUT,
    OUTPUT,
    POLICY_KEY,
    SPEED_CURVATURE,
    PolicyMetadata,
)
from vehicle_agent.network_file import session_of


def is_policy(path: Path) -> bool:
    """Return whether a file is a policy, not another network; False where it is neither."""
    try:
        return POLICY_KEY in session_of(path).get_modelmeta().custom_metadata_map
    except LearningError:
        return False


class Policy:
    """A policy.

    Args:
        path: Of the file.

    Attributes:
        metadata: What it is.

    Raises:
        LearningError: naming the file, what was expected and what was found.
    """

    def __init__(self, path: Path) -> None:
        self._session = session_of(path)
        entries = self._session.get_modelmeta().custom_metadata_map
        if POLICY_KEY not in entries:
            raise LearningError(f"{path}: expected a policy with metadata ({POLICY_KEY}), got none")
        try:
            self.metadata = msgspec.json.decode(entries[POLICY_KEY], type=PolicyMetadata)
        except msgspec.MsgspecError as cause:
            raise LearningError(f"{path}: its metadata: {cause}") from cause
        if self.metadata.actions not in (COMMANDS, SPEED_CURVATURE):
            known = ", ".join(COMMANDS), ", ".join(SPEED_CURVATURE)
            got = ", ".join(self.metadata.actions)
            raise LearningError(f"{path}: its actions are {got}: expected {' or '.join(known)}")
        columns = len(self.metadata.observations)
        ports = [
            (one.name, one.type, list(one.shape))
            for one in (*self._session.get_inputs(), *self._session.get_outputs())
        ]
        expected = [(INPUT, "tensor(float)", [1, columns]), (OUTPUT, "tensor(float)", [1, 2])]
        if ports != expected:
            raise LearningError(f"{path}: expected {expected}, got {ports}")
        action = self._run(np.zeros(columns))
        if not np.isfinite(action).all():
            raise LearningError(
                f"{path}: expected actions, got {action.tolist()}: are its weights NaN?"
            )

    def __call__(self, observation: Floats) -> Floats:
        """Return the action (2,), within its range, for an observation (columns,)."""
        found = np.clip(self._run(observation), self.metadata.action_low, self.metadata.action_high)
        return np.asarray(found)

    def _run(self, observation: Floats) -> Floats:
        seen = observation[None].astype(np.float32)
        (action,) = self._session.run([OUTPUT], {INPUT: seen})
        return np.asarray(action[0], dtype=np.float64)
