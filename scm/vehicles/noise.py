"""Counter-based noise: the number of (key, counter, index) is always the same.

The numbers of a stateful generator depend on who else draws from it. Here each value is a hash of
what it belongs to, so one car's noise does not depend on other cars, on order, on batches, or on
earlier calls:

    base = mix(key + counter G)                   one reading of one device
    u_i = mix(base + (i + 1) G) / 2^64            uniform over (0, 1)
    normal = sqrt(-2 ln u_i) (cos a, sin a)       a = 2 pi u_j, i and j differ

`mix` is the finaliser of SplitMix64 and G its odd constant, so the values of one reading are a
SplitMix64 sequence that starts at `base`. The angle is drawn within a quarter turn about 45 degrees
and two signs beside it, which needs a sine and a cosine of small angles only.
Source: Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014; Box, Muller, "A
note on the generation of random normal deviates", 1958.
"""

import hashlib
import math

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats, Ints
from scm.vehicles.jit import array_kernel, kernel_function

Keys = NDArray[np.uint64]

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_M1, _M2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_BIT0, _BIT1 = np.uint64(1), np.uint64(2)
_UNIT = 2.0**-53
_QUARTER = 0.5 * math.pi
_COS_45 = math.sqrt(0.5)


def key_of(seed: int, *names: str) -> np.uint64:
    """Return the key of one noise stream: one device of one car in a run."""
    text = "/".join((str(seed), *names)).encode()
    return np.uint64(int.from_bytes(hashlib.blake2s(text, digest_size=8).digest(), "little"))


def bases_of(keys: Keys, counters: Ints) -> Keys:
    """Return the base of each reading (k,) from its key and number."""
    bases = np.empty(len(keys), np.uint64)
    _bases(keys, counters, bases)
    return bases


def uniforms(bases: Keys, count: int) -> Floats:
    """Return uniform numbers in the open interval (0, 1), (k, count)."""
    out = np.empty((len(bases), count))
    _uniforms(bases, out)
    return out


def normals(bases: Keys, count: int) -> Floats:
    """Return standard normal numbers (k, count), a row for each base."""
    pairs = (count + 1) // 2
    radius = np.sqrt(-2.0 * np.log(uniforms(bases, pairs)))
    out = np.empty((len(bases), 2 * pairs))
    _turn(bases, radius, out)
    return out[:, :count]


@kernel_function
def mix(bits: np.uint64) -> np.uint64:
    """Scramble 64 bits: each input bit changes each output bit half of the time."""
    bits = (bits ^ (bits >> _S30)) * _M1
    bits = (bits ^ (bits >> _S27)) * _M2
    return bits ^ (bits >> _S31)


@array_kernel
def _bases(keys: Keys, counters: Ints, out: Keys) -> None:
    for i in range(len(keys)):
        out[i] = mix(keys[i] + np.uint64(counters[i]) * GOLDEN)


@array_kernel
def _uniforms(bases: Keys, out: Floats) -> None:
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            bits = mix(bases[i] + np.uint64(j + 1) * GOLDEN)
            out[i, j] = (float(np.int64(bits >> _S11)) + 0.5) * _UNIT


@array_kernel
def _turn(bases: Keys, radius: Floats, out: Floats) -> None:
    """Turn each radius (k, pairs) into two numbers; sine and cosine to 1e-11."""
    pairs = radius.shape[1]
    for i in range(radius.shape[0]):
        for j in range(pairs):
            bits = mix(bases[i] + np.uint64(pairs + j + 1) * GOLDEN)
            a = ((float(np.int64(bits >> _S11)) + 0.5) * _UNIT - 0.5) * _QUARTER
            q = a * a
            sine = 1.0 - q * (1.0 / 72.0) * (1.0 - q * (1.0 / 110.0))
            sine = a * (
                1.0 - q * (1.0 / 6.0) * (1.0 - q * (1.0 / 20.0) * (1.0 - q * (1.0 / 42.0) * sine))
            )
            cosine = 1.0 - q * (1.0 / 56.0) * (1.0 - q * (1.0 / 90.0) * (1.0 - q * (1.0 / 132.0)))
            cosine = 1.0 - q * 0.5 * (1.0 - q * (1.0 / 12.0) * (1.0 - q * (1.0 / 30.0) * cosine))
            size = radius[i, j] * _COS_45
            left = 1.0 - 2.0 * float(np.int64(bits & _BIT0))
            right = 1.0 - float(np.int64(bits & _BIT1))
            out[i, j] = size * (cosine - sine) * left
            out[i, pairs + j] = size * (cosine + sine) * right
