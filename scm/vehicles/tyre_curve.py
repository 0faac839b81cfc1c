"""The tyre's normalised force curve of the AutoDRIVE paper: two cubics, odd in slip.

    F(s) = F_e (1.5 q - 0.5 q^3),  q = s / s_e               up to the extremum (s_e, F_e)
    F(s) = F_e + (F_a - F_e) (3 p^2 - 2 p^3),  p in 0..1     from there to the asymptote (s_a, F_a)

so F(0) = 0, F''(0) = 0, F'(s_e) = 0, F'(s_a) = 0; beyond s_a the force stays F_a.
"""

from scm.vehicles.jit import kernel_function


@kernel_function
def curve_over_slip(
    slip: float,
    slip_extremum: float,
    force_extremum: float,
    slip_asymptote: float,
    force_asymptote: float,
) -> float:
    """F(s) / s: the secant of the curve, positive and even; its limit at s = 0 included."""
    size = abs(slip)
    q = size / slip_extremum
    rising = force_extremum / slip_extremum * (1.5 - 0.5 * q * q)
    p = min((size - slip_extremum) / max(slip_asymptote - slip_extremum, 1e-9), 1.0)
    falling = force_extremum + (force_asymptote - force_extremum) * (p * p * (3.0 - 2.0 * p))
    return rising if size <= slip_extremum else falling / size
