"""C number types of an 8-bit AVR: float with 32 bits, int with 16.

Where C leaves behaviour undefined it follows avr-libc, compared on a simulated ATmega328P.
"""

import math
import struct

FLOAT_TO_LONG = 2.0**31


def float32(value: float) -> float:
    """Round to 32 bits; overflow gives infinity."""
    try:
        rounded: float = struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return rounded


def int16(value: int) -> int:
    """Keep the lower 16 bits."""
    return (value + 0x8000) % 0x10000 - 0x8000


def int_of(value: float) -> int:
    """Convert to int: truncate, keep 16 bits; 0 for NaN and for values beyond a long."""
    if not abs(value) < FLOAT_TO_LONG:
        return 0
    return int16(int(value))


def times(whole: int, value: float) -> float:
    """Return int times float."""
    return float32(float32(whole) * value)


def plus(whole: int, value: float) -> float:
    """Return int plus float."""
    return float32(float32(whole) + value)
