"""What a UART makes of bytes that were sent at another speed than it listens at."""

import math

IDLE = 1


def heard(data: bytes, sent_baud: int, read_baud: int) -> bytes:
    """Return the bytes that a listener takes from a burst, one after the other without a pause.

    It waits for a falling edge that is still low half a bit later, and then looks at the middle of
    each of its own eight bits, whatever the sender meant by them. Wrong stop bits do not stop it:
    the Arduino core keeps such bytes. At no speed (0 baud) there is nothing to hear.
    """
    if sent_baud == read_baud:
        return data
    if 0 in (sent_baud, read_baud):
        return b""
    bits = [IDLE]
    for byte in data:
        bits += [0, *((byte >> at) & 1 for at in range(8)), 1]
    step, out, at = sent_baud / read_baud, bytearray(), 1
    while (edge := _falling(bits, at)) is not None:
        if _level(bits, edge + step * 0.5):
            at = edge + 1
            continue
        level = [_level(bits, edge + step * (k + 1.5)) for k in range(8)]
        out.append(sum(bit << k for k, bit in enumerate(level)))
        at = math.ceil(edge + step * 9.5)
    return bytes(out)


def _falling(bits: list[int], begin: int) -> int | None:
    for at in range(begin, len(bits)):
        if bits[at] == 0 and bits[at - 1] == 1:
            return at
    return None


def _level(bits: list[int], at: float) -> int:
    return bits[int(at)] if at < len(bits) else IDLE
