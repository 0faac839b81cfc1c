"""Functions for terms that run over many cars at once: straight text, no library call, no branch.

A term may use + - * / abs min max math.sqrt math.floor math.copysign, selects (`a if c else b`) and
these. Each is odd or even exactly as its namesake, and the same in every lane bit for bit.
"""

import math

from scm.vehicles.jit import kernel_function

_QUARTER = 0.6366197723675814  # quarter turns in a radian
# half pi in three parts: whole quarter turns up to 2^20 subtract without loss
_HALF_PI, _HALF_PI_2, _HALF_PI_3 = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21


@kernel_function
def soft_sign(x: float) -> float:
    """Odd, slope 1 at 0, tends to +-1 as 1 - 1/(2 x^2): the cheap way to turn over at rest."""
    far = min(max(x, -1e8), 1e8)
    return far / math.sqrt(1.0 + far * far)


@kernel_function
def expm1_neg(x: float) -> float:
    """exp(-x) - 1 for x >= 0, relative error below 2e-14; below 0 as at 0, exactly 0."""
    r = min(max(x, 0.0), 40.0) * -0.0078125
    p = 1.0 + r * (1.0 / 11.0)
    p = 1.0 + r * (1.0 / 10.0) * p
    p = 1.0 + r * (1.0 / 9.0) * p
    p = 1.0 + r * (1.0 / 8.0) * p
    p = 1.0 + r * (1.0 / 7.0) * p
    p = 1.0 + r * (1.0 / 6.0) * p
    p = 1.0 + r * (1.0 / 5.0) * p
    p = 1.0 + r * 0.25 * p
    p = 1.0 + r * (1.0 / 3.0) * p
    e = r * (1.0 + r * 0.5 * p)
    e = e * (e + 2.0)
    e = e * (e + 2.0)
    e = e * (e + 2.0)
    e = e * (e + 2.0)
    e = e * (e + 2.0)
    e = e * (e + 2.0)
    return e * (e + 2.0)


@kernel_function
def exp_neg(x: float) -> float:
    """exp(-x) for x >= 0, absolute error below 1e-15; below 0 as at 0, exactly 1."""
    return 1.0 + expm1_neg(x)


@kernel_function
def tanh(x: float) -> float:
    """Hyperbolic tangent of any x, relative error below 2e-14."""
    e = expm1_neg(2.0 * abs(x))
    return math.copysign(e / (2.0 + e), x)


@kernel_function
def tan_small(x: float) -> float:
    """Tangent of |x| < 1.2, relative error below 1e-14 (the continued fraction, eight deep)."""
    z = x * x
    top = 34459425.0 + z * (-4729725.0 + z * (135135.0 + z * (-990.0 + z)))
    foot = 34459425.0 + z * (-16216200.0 + z * (945945.0 + z * (-13860.0 + z * 45.0)))
    return x * top / foot


@kernel_function
def atan_small(x: float) -> float:
    """Arc tangent of |x| < 0.414, error below 1e-15 (a polynomial through Chebyshev's nodes)."""
    z = x * x
    p = -0.043478194068325114 + z * 0.021132541605679074
    p = -0.06640218254107566 + z * (0.05688267986007488 + z * p)
    p = -0.090907729431749 + z * (0.07689951670025079 + z * p)
    p = -0.14285714180830275 + z * (0.11111106174675703 + z * p)
    p = -0.3333333333332843 + z * (0.1999999999885322 + z * p)
    return x * (1.0 + z * p)


@kernel_function
def atan(x: float) -> float:
    """Arc tangent of any x, error below 1e-15: turned by a quarter or an eighth first."""
    size = abs(x)
    steep, middle = size > 2.414213562373095, size > 0.4142135623730951
    top = -1.0 if steep else (size - 1.0 if middle else size)
    foot = size if steep else (size + 1.0 if middle else 1.0)
    turned = 1.5707963267948966 if steep else (0.7853981633974483 if middle else 0.0)
    return math.copysign(turned + atan_small(top / foot), x)


@kernel_function
def sin_cos(x: float) -> tuple[float, float]:
    """Sine and cosine of |x| < 1e6, error below 1e-15."""
    turns = float(math.floor(x * _QUARTER + 0.5))
    r = ((x - turns * _HALF_PI) - turns * _HALF_PI_2) - turns * _HALF_PI_3
    z = r * r
    p = 2.755731338241015e-06 + z * (-2.5050717544078517e-08 + z * 1.5894753989656358e-10)
    p = 0.008333333333320416 + z * (-0.00019841269828677557 + z * p)
    s = r + r * z * (-0.16666666666666616 + z * p)
    p = 2.4801587288872934e-05 + z * (
        -2.7557314294061107e-07 + z * (2.087572447311353e-09 + z * -1.1360012422911849e-11)
    )
    p = 0.04166666666666656 + z * (-0.001388888888887176 + z * p)
    c = 1.0 - 0.5 * z + z * z * p
    quarter = turns - 4.0 * float(math.floor(turns * 0.25))
    odd = abs(quarter - 2.0) == 1.0
    sine, cosine = c if odd else s, s if odd else c
    return -sine if quarter > 1.5 else sine, -cosine if abs(quarter - 1.5) < 1.0 else cosine
