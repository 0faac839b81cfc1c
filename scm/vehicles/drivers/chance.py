"""Chance without a stream: numbers in, the same luck out, in any order and on any thread."""

from scm.vehicles.jit import law


@law
def mixed(a: int, b: int) -> int:
    """Return 32 bits that look random and depend on both numbers (PCG, O'Neill 2014)."""
    state = ((a & 0xFFFFFFFF) * 747796405 + (b & 0xFFFFFFFF) * 277803737 + 2891336453) & 0xFFFFFFFF
    word = (((state >> ((state >> 28) + 4)) ^ state) * 277803737) & 0xFFFFFFFF
    return (word >> 22) ^ word
