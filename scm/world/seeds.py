"""Random generators by name: each component has its own, so none disturbs another's numbers."""

import hashlib

import numpy as np


def generator(seed: int, *names: str) -> np.random.Generator:
    """Return the generator of one component of a run; equal seed and names, equal numbers."""
    digest = hashlib.blake2s("/".join(names).encode()).digest()
    return np.random.default_rng([seed, *digest])


def number(seed: int, *names: str) -> int:
    """Return 31 bits that belong to one component of a run."""
    digest = hashlib.blake2s("/".join((str(seed), *names)).encode(), digest_size=4).digest()
    return int.from_bytes(digest, "big") >> 1
