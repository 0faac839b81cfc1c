"""What a diagnosis says of the car as a whole."""

from scm.mismatch.diagnose import retuned_error
from scm.mismatch.judge import judge
from scm.mismatch.likelihood import Likelihood
from scm.mismatch.parts import split
from tests.unit.mismatch.made_drive import big_nigel, driven


def test_the_re_tuned_car_strays_by_what_refitting_alone_could_not_take_off():
    drive, true, half = driven((("steering.trim_rad", 0.05),)), 0.05, 0.025
    parts = split(Likelihood([drive], big_nigel()), 5.0)
    fit, _ = judge([drive], big_nigel(), {}, {"steering.trim_rad": true}, parts)
    tuned = {"steering.trim_rad": half}
    strays_m = retuned_error([drive], big_nigel(), tuned, {"steering.trim_rad": true}, parts)
    before, after = (side["position_m"] for side in (fit.confirm.before, fit.confirm.after))
    assert after < 0.9 * strays_m < 0.7 * before
