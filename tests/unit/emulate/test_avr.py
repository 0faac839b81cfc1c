"""C's numbers on an AVR, against what avr-gcc's code gave on a simulated ATmega328P (simavr)."""

import struct

import pytest

from vehicle_agent.emulate.avr import float32, int16, int_of, plus, times
from vehicle_agent.emulate.sketches import ackermann

# The float's bits, and the ints 97 + 30 * d, 255 * d and -(255 * d) that came out.
ON_AN_AVR = """
00000000 97 0 0
80000000 97 0 0
3f000000 112 127 -127
bf000000 82 -127 127
3ecccccd 109 102 -102
becccccd 85 -102 102
3f7d70a4 126 252 -252
3f800000 127 255 -255
bf800000 67 -255 255
3f8147ae 127 257 -257
40000000 157 510 -510
c0533333 -2 -841 841
41700000 547 3825 -3825
447a0000 30097 -7144 7144
44884000 -32739 15806 -15806
44898000 -32439 18356 -18356
c4898000 32633 -18356 18356
43008000 3952 32767 -32767
43010000 3967 -32641 32641
c3010000 -3773 32641 -32641
43808000 7807 -1 1
4b189680 -23712 0 0
4c8583b0 30080 0 0
4c895440 0 0 0
cc895440 0 0 0
4e6e6b28 0 0 0
7f61b1e6 0 0 0
ff61b1e6 0 0 0
7f800000 0 0 0
ff800000 0 0 0
7fc00000 0 0 0
3b7f9724 97 0 0
3b80c73b 97 1 -1
000116c2 97 0 0
3d088888 98 8 -8
4b008080 3936 -128 128
3f7ffffe 127 254 -254
bdcccccd 94 -25 25
bd086595 96 -8 8
"""

# The sketch's angle, and the left and right wheel's that came out [deg].
ACKERMANN_ON_AN_AVR = """
-200 -16 -24
-90 -61 61
-60 -41 -87
-30 -23 -40
-15 -13 -17
-1 0 -1
0 0 0
1 1 0
5 5 4
29 38 23
30 40 23
60 87 41
200 24 16
"""


def rows(table):
    return [line.split() for line in table.split("\n") if line]


@pytest.mark.parametrize("row", rows(ON_AN_AVR))
def test_commands_become_the_ints_that_an_avr_makes_of_them(row):
    (d,) = struct.unpack(">f", bytes.fromhex(row[0]))
    throttle = int_of(times(255, d))
    assert [int_of(plus(97, times(30, d))), throttle, int16(-throttle)] == [int(n) for n in row[1:]]


@pytest.mark.parametrize("row", rows(ACKERMANN_ON_AN_AVR))
def test_the_larger_car_works_out_its_wheels_as_an_avr_does(row):
    angle, left, right = map(int, row)
    assert ackermann(angle) == (left, right)


def test_floats_beyond_32_bits_are_infinite():
    assert float32(-1e39) == float("-inf")
