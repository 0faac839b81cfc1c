"""Chance without a stream: numbers in, the same luck out, in any order and on any thread."""

from scm.vehicles.jit import law


@law
def mixed(a: int, b: int) -> int:
    """Return 32 bits that look random and depend on both numbers (PCG, O'Neill 2014)."""
    state = ((a & 0xFFFFFFFF) * 747796405 + (b & 0xFFFFFFFF) * 277803737 + 2891336453) & 0xFFFFFFFF
    word = (((state >> ((state >> 28) + 4)) ^ state) * 277803737) & 0xFFFFFFFF
    return (word >> 22) ^ word


@law
def reached(loss: float, seed: int, sender: int, receiver: int, frame: int) -> bool:
    """Return whether a frame reached a receiver: the same answer whoever asks, and when."""
    if loss <= 0.0:
        return True
    return mixed(mixed(seed, sender), mixed(receiver, frame)) >= loss * 4294967296.0
