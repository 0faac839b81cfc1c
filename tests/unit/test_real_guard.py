"""The guard of a real car: every claim is made of a module, so that mutants can be held to it."""

import math
from collections import Counter
from dataclasses import FrozenInstanceError

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RunError
from scm.geometry import Pose2
from scm.v2x.messages.eye_track import EyeTrack
from scm.vehicles.guard import Guarded
from vehicle_agent import guard as real

CLAIMS = []
T0 = 10**12
STEP = 20 * NS_PER_MS
MIDDLE = 1.5, 0.75


def claim(function):
    CLAIMS.append(function)
    return function


@pytest.mark.parametrize("made", CLAIMS, ids=lambda function: function.__name__)
def test_the_guard(made):
    made(real)


def track(t_ns=T0, x=1.5, y=0.75, yaw=0.0, speed=0.0, variances=(1e-6, 1e-6, 1e-6), **more):
    rows = [[0.0] * 6 for _ in range(6)]
    for i, variance in enumerate(variances):
        rows[i][i] = variance
    told = {"age_s": 0.0, "stale": False} | more
    return EyeTrack(
        vehicle="n7", tag_id=1, t_ns=t_ns, x_m=x, y_m=y, yaw_rad=yaw, speed_mps=speed,
        lateral_speed_mps=0.0, yaw_rate_radps=0.0, covariance=tuple(map(tuple, rows)), **told,
    )  # fmt: skip


def drive(throttle=0.5, steering=0.0, mode="drive"):
    return Guarded(throttle, steering, mode, hazard=False)


def limits(g, **changed):
    usual = {
        "fence": g.rectangle(0.0, 0.0, 3.0, 1.5),
        "throttle_slew_per_s": 1000.0,
        "steering_slew_per_s": 1000.0,
    }
    return g.GuardLimits(**usual | changed)


def seeing(g, seen=None, **changed):
    """A guard that has been asked once, and has seen a track at T0."""
    made = g.RealGuard(limits(g, **changed))
    made.pass_on(drive(0.0), T0 - STEP)
    made.see(track() if seen is None else seen, T0)
    return made


def close(a, b):
    return math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-12)


def refused(g, **changed):
    with pytest.raises(RunError) as caught:
        limits(g, **changed)
    return str(caught.value)


@claim
def the_defaults_are_a_nigels(g):
    made = g.GuardLimits(g.rectangle(0.0, 0.0, 3.0, 1.5))
    assert (made.margin_m, made.throttle, made.throttle_slew_per_s) == (0.05, 1.0, 4.0)
    assert (made.steering_slew_per_s, made.top_speed_mps, made.decel_mps2) == (10.0, 0.3, 1.0)
    assert (made.reaction_s, made.curvature_per_m, made.crawl) == (0.15, 4.1, 0.35)
    assert (made.front_m, made.rear_m, made.width_m) == (0.23, 0.07, 0.175)
    assert (made.pose_age_s, made.position_std_m, made.yaw_std_rad) == (0.25, 0.05, 0.15)
    assert made.harmless == frozenset()


@claim
def limits_and_outcomes_are_frozen_and_hold_no_more_than_they_name(g):
    for made, name in ((limits(g), "crawl"), (g.Passed(0.0, 0.0, False, ()), "throttle")):
        assert not hasattr(made, "__dict__")
        with pytest.raises(FrozenInstanceError):
            setattr(made, name, 1.0)


@claim
def a_rectangle_is_made_of_any_two_opposite_corners(g):
    expected = ((-1.0, 2.0), (3.0, 2.0), (3.0, 5.0), (-1.0, 5.0))
    for corners in ((-1, 2, 3, 5), (3, 2, -1, 5), (-1, 5, 3, 2), (3, 5, -1, 2)):
        assert g.rectangle(*map(float, corners)) == expected


@claim
def a_fence_is_a_convex_polygon_counter_clockwise(g):
    square = (0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)
    limits(g, fence=((0.0, 0.0), (0.5, 0.0), *square[1:]))
    limits(g, fence=((0.0, 0.0), (1.0, 0.0), (0.4, 0.1)))
    star = [(math.cos(a), math.sin(a)) for a in (0.0, 2.513, 5.027, 1.257, 3.770)]
    for wrong in (
        (),
        square[:1],
        square[:2],
        square[::-1],
        (*square[:3], (0.9, 0.5)),
        (*square, (0.0, 1.0)),
        ((0.0, 0.0), (0.5, 0.0), (0.5, 0.0), *square[1:]),
        ((0.0, 0.0), (1.0, 1.0)),
        (*square[:3], (0.0, math.nan)),
        (*square[:3], (-math.inf, 1.0)),
        ((0.0, 0.0), (2.0, 0.0), (1.0, 0.0), (1.0, 1.0)),
        tuple(star),
    ):
        said = refused(g, fence=wrong)
        assert said == f"guard: fence: got {wrong}; expected a convex polygon, counter-clockwise"


@claim
def a_limit_is_a_finite_number_not_below_zero(g):
    limits(g, margin_m=0, rear_m=0.0)
    for wrong in (-0.1, math.inf, math.nan):
        said = refused(g, reaction_s=wrong)
        expected = {"reaction_s": wrong}
        assert said == f"guard: limits: got {expected}; expected finite numbers, not below zero"
    assert "{'decel_mps2': 0.0}" in refused(g, decel_mps2=0.0)
    assert "{'crawl': -1}" in refused(g, crawl=-1)


@claim
def outside_is_counted_from_the_outline_to_the_margin(g):
    made = limits(g)
    for pose, expected in (
        (Pose2(1.5, 0.75, 0.0), 0.05 - (0.75 - 0.0875)),
        (Pose2(0.07, 0.75, 0.0), 0.05),
        (Pose2(2.77, 0.75, 0.0), 0.05),
        (Pose2(0.23, 0.75, math.pi), 0.05),
        (Pose2(1.5, 0.07, math.pi / 2), 0.05),
        (Pose2(1.5, 1.27, math.pi / 2), 0.05),
        (Pose2(2.9, 1.4, 0.0), 0.18),
        (Pose2(2.7, 1.4, math.pi / 4), 0.05 + 1.4 + (0.23 + 0.0875) / math.sqrt(2.0) - 1.5),
    ):
        assert close(made.outside_m(pose), expected), pose
    skew = limits(g, fence=((0.0, 0.0), (4.0, 0.0), (0.0, 3.0)))
    far = (0.23 * 3 + 0.0875 * 4) / 5
    assert close(skew.outside_m(Pose2(1.0, 1.0, 0.0)), 0.05 + far - 1.0)


@claim
def without_a_pose_it_stops(g):
    made = g.RealGuard(limits(g))
    made.pass_on(drive(), T0)
    assert made.pass_on(drive(0.5, 0.2), T0 + STEP) == g.Passed(0.0, 0.2, True, ("pose",))


@claim
def what_is_in_order_passes_unchanged(g):
    assert seeing(g).pass_on(drive(0.5, 0.2), T0) == g.Passed(0.5, 0.2, False, ())
    assert seeing(g).pass_on(drive(-0.5, -0.2), T0) == g.Passed(-0.5, -0.2, False, ())
    assert seeing(g).pass_on(drive(1.0, 1.0), T0) == g.Passed(1.0, 1.0, False, ())
    assert seeing(g).pass_on(drive(-1.0, -1.0), T0) == g.Passed(-1.0, -1.0, False, ())


@claim
def a_wrong_value_never_passes(g):
    for throttle, steering in ((math.nan, 0.1), (1.1, 0.1), (-1.1, 0.1), (0.5, math.nan),
                               (0.5, 1.1), (0.5, -1.1), (math.inf, -math.inf)):  # fmt: skip
        made = seeing(g)
        made.pass_on(drive(0.5, 0.3), T0)
        passed = made.pass_on(drive(throttle, steering), T0 + STEP)
        assert passed == g.Passed(0.0, 0.3, False, ("value",))


@claim
def a_wrong_value_holds_the_steering_of_a_new_guard_straight(g):
    assert seeing(g).pass_on(drive(math.nan, 0.3), T0).steering == 0.0


@claim
def throttle_may_be_limited(g):
    for throttle, passed in ((0.9, 0.4), (-0.9, -0.4)):
        made = seeing(g, throttle=0.4)
        assert made.pass_on(drive(throttle), T0) == g.Passed(passed, 0.0, False, ("limit",))
    assert seeing(g, throttle=0.4).pass_on(drive(0.4), T0).reasons == ()
    assert seeing(g, throttle=0.4).pass_on(drive(-0.4), T0).reasons == ()


@claim
def only_a_driving_mode_moves_the_car(g):
    for mode, brake, reason in (("hold", False, "age"), ("stop", True, "stop"),
                                ("lost", True, "lost")):  # fmt: skip
        passed = seeing(g).pass_on(drive(0.5, 0.2, mode), T0)
        assert passed == g.Passed(0.0, 0.2, brake, (reason,))


@claim
def actuators_move_no_quicker_than_they_may(g):
    made = seeing(g, throttle_slew_per_s=5.0, steering_slew_per_s=10.0)
    passed = [made.pass_on(drive(0.25, -0.5), T0 + i * STEP) for i in range(4)]
    assert [p.throttle for p in passed] == pytest.approx([0.1, 0.2, 0.25, 0.25])
    assert [p.steering for p in passed] == pytest.approx([-0.2, -0.4, -0.5, -0.5])
    assert [p.reasons for p in passed] == [("slew",), ("slew",), (), ()]
    passed = made.pass_on(drive(0.25, 0.5), T0 + 4 * STEP)
    assert close(passed.steering, -0.3)
    assert (passed.throttle, passed.reasons) == (0.25, ("slew",))


@claim
def throttle_falls_to_zero_at_once_and_grows_the_other_way_slowly(g):
    for sign in (1.0, -1.0):
        made = seeing(g, throttle_slew_per_s=5.0)
        for i in range(3):
            made.pass_on(drive(0.3 * sign), T0 + i * STEP)
        passed = made.pass_on(drive(0.05 * sign), T0 + 3 * STEP)
        assert passed == g.Passed(0.05 * sign, 0.0, False, ())
        made.pass_on(drive(0.1 * sign), T0 + 4 * STEP)
        passed = made.pass_on(drive(-0.3 * sign), T0 + 5 * STEP)
        assert close(passed.throttle, -0.1 * sign)
        assert passed.reasons == ("slew",)
        assert made.pass_on(drive(0.0), T0 + 6 * STEP).throttle == 0.0


@claim
def it_grows_from_what_passed_and_not_from_what_was_wished(g):
    made = seeing(g, throttle_slew_per_s=5.0)
    for i in range(5):
        made.pass_on(drive(0.5, 0.0, "hold"), T0 + i * STEP)
    assert close(made.pass_on(drive(0.5), T0 + 5 * STEP).throttle, 0.1)


@claim
def a_long_silence_or_a_clock_that_steps_back_is_no_licence_to_jump(g):
    made = seeing(g, throttle_slew_per_s=5.0, steering_slew_per_s=5.0)
    passed = made.pass_on(drive(1.0, 1.0), T0 + 249 * NS_PER_MS)
    assert close(passed.throttle, 0.5)
    assert close(passed.steering, 0.5)
    back = made.pass_on(drive(1.0, 1.0), T0)
    assert (back.throttle, back.steering) == (passed.throttle, passed.steering)
    assert close(made.pass_on(drive(1.0, 1.0), T0 + STEP).throttle, 0.6)


@claim
def a_new_guard_begins_from_rest(g):
    made = g.RealGuard(limits(g))
    made.see(track(), T0)
    assert made.pass_on(drive(0.5, 0.5), T0) == g.Passed(0.0, 0.0, False, ("slew",))


@claim
def a_pose_is_good_for_a_quarter_of_a_second(g):
    made = seeing(g)
    assert made.pass_on(drive(), T0 + 250 * NS_PER_MS - 1).reasons == ()
    old = g.Passed(0.0, 0.0, True, ("pose",))
    assert made.pass_on(drive(), T0 + 250 * NS_PER_MS) == old
    made.see(track(T0 + NS_PER_S), T0 + NS_PER_S)
    assert made.pass_on(drive(), T0 + NS_PER_S).reasons == ()


@claim
def the_age_that_the_eye_tells_counts(g):
    made = seeing(g, track(age_s=0.2))
    assert made.pass_on(drive(), T0 + 49 * NS_PER_MS).reasons == ()
    assert made.pass_on(drive(), T0 + 51 * NS_PER_MS).reasons == ("pose",)
    for age_s in (-0.1, math.nan, math.inf):
        assert seeing(g, track(age_s=age_s)).pass_on(drive(), T0).reasons == ("pose",)
    assert seeing(g, track(stale=True)).pass_on(drive(), T0).reasons == ("pose",)
    assert seeing(g, track(age_s=0.2)).pass_on(drive(), T0 - NS_PER_S).reasons == ("slew",)


@claim
def a_pose_told_twice_or_overtaken_is_not_younger(g):
    for t_ns in (T0, T0 - 1):
        made = seeing(g)
        made.see(track(t_ns, stale=True), T0 + 200 * NS_PER_MS)
        assert made.pass_on(drive(), T0 + 200 * NS_PER_MS).reasons == ()
        assert made.pass_on(drive(), T0 + 251 * NS_PER_MS).reasons == ("pose",)
    made = seeing(g)
    made.see(track(T0 + 1), T0 + 1)
    assert made.pass_on(drive(), T0 + 250 * NS_PER_MS).reasons == ()


@claim
def clocks_may_differ_but_what_comes_later_than_the_quickest_is_older(g):
    for skew in (-3 * NS_PER_S, 0, 3 * NS_PER_S):
        made = seeing(g, track(T0 + skew))
        for i in range(1, 11):
            sent, late = T0 + i * 100 * NS_PER_MS, (i % 5) * 50 * NS_PER_MS
            made.see(track(sent + skew), sent + late)
            assert made.pass_on(drive(), sent + late).reasons == (), (skew, i)
        late_ns = 249 * NS_PER_MS
        sent = T0 + 2 * NS_PER_S
        made.see(track(sent + skew), sent + late_ns)
        assert made.pass_on(drive(), sent + late_ns).reasons == ()
        assert made.pass_on(drive(), sent + 252 * NS_PER_MS).reasons == ("pose",)
        made.see(track(sent + NS_PER_S + skew), sent + NS_PER_S + 252 * NS_PER_MS)
        assert made.pass_on(drive(), sent + NS_PER_S + 252 * NS_PER_MS).reasons == ("pose",)


@claim
def a_quicker_track_shows_that_the_others_were_late(g):
    made = seeing(g, track(T0 - 200 * NS_PER_MS))
    made.see(track(T0 + STEP), T0 + STEP)
    made.see(track(T0 + 2 * STEP), T0 + 2 * STEP + 251 * NS_PER_MS)
    assert made.pass_on(drive(), T0 + 2 * STEP + 251 * NS_PER_MS).reasons == ("pose",)


@claim
def a_clock_that_drifts_slowly_is_forgiven(g):
    made = seeing(g)
    for i in range(1, 101):
        at, drift = i * 100 * NS_PER_S, i * 9 * NS_PER_MS
        made.see(track(T0 + at - drift), T0 + at)
        assert made.pass_on(drive(), T0 + at).reasons == ()
        assert made.pass_on(drive(), T0 + at + 249 * NS_PER_MS).reasons == ()
    made.see(track(T0 + at + NS_PER_S - drift - 240 * NS_PER_MS), T0 + at + NS_PER_S)
    assert made.pass_on(drive(), T0 + at + NS_PER_S + 5 * NS_PER_MS).reasons == ()
    assert made.pass_on(drive(), T0 + at + NS_PER_S + 15 * NS_PER_MS).reasons == ("pose",)


@claim
def a_pose_that_the_eye_doubts_stops_the_car(g):
    doubt = g.Passed(0.0, 0.0, True, ("doubt",))
    least = 0.0, 0.0, 0.0
    most = 0.05 * 0.05, 0.05 * 0.05, 0.15 * 0.15
    assert seeing(g, track(variances=least)).pass_on(drive(), T0).reasons == ()
    assert seeing(g, track(variances=most)).pass_on(drive(), T0).reasons == ()
    for i in range(3):
        for wrong in (most[i] * 1.001, -1e-9, math.nan):
            variances = [*least]
            variances[i] = wrong
            assert seeing(g, track(variances=variances)).pass_on(drive(), T0) == doubt
    for name in ("x", "y", "yaw", "speed"):
        for wrong in (math.nan, math.inf):
            assert seeing(g, track(**{name: wrong})).pass_on(drive(), T0) == doubt


@claim
def flags_stop_the_car_but_for_those_called_harmless(g):
    flagged = track(flags=("disagree",))
    assert seeing(g, flagged).pass_on(drive(), T0).reasons == ("doubt",)
    harmless = frozenset({"disagree"})
    assert seeing(g, flagged, harmless=harmless).pass_on(drive(), T0).reasons == ()
    both = track(flags=("disagree", "frozen"))
    assert seeing(g, both, harmless=harmless).pass_on(drive(), T0).reasons == ("doubt",)


# At rest, the front may come to within 0.05 of x = 3: the rear axle to 2.72. At throttle 0.5 the
# car may do 0.15 m/s: it needs 0.15 * 0.15 + 0.15^2 / 2 = 0.03375 m to stop.


@claim
def it_stops_where_it_could_not_stop_inside(g):
    for x, yaw, sign in ((2.72, 0.0, 1.0), (0.12, 0.0, -1.0), (0.28, math.pi, 1.0)):
        inward = -0.0001 if x > 1.0 else 0.0001
        need = math.copysign(0.03375, inward)
        near = seeing(g, track(x=x + need - inward, yaw=yaw), crawl=0.0)
        assert near.pass_on(drive(0.5 * sign), T0) == g.Passed(0.0, 0.0, True, ("fence",))
        far = seeing(g, track(x=x + need + inward, yaw=yaw), crawl=0.0)
        assert far.pass_on(drive(0.5 * sign), T0) == g.Passed(0.5 * sign, 0.0, False, ())


@claim
def on_the_line_is_inside(g):
    exact = {"fence": g.rectangle(0.0, 0.0, 4.0, 2.0), "margin_m": 0.25, "front_m": 0.25,
             "width_m": 0.25, "reaction_s": 0.25, "top_speed_mps": 0.0}  # fmt: skip
    made = seeing(g, track(x=3.5), **exact)
    assert made.pass_on(drive(0.5), T0).reasons == ()
    made = seeing(g, track(x=3.5 - 2.0**-20), **exact | {"top_speed_mps": 0.5})
    assert made.pass_on(drive(0.25), T0).reasons == ("fence",)
    # v = 1/8: 1/32 for the reaction and 1/128 to stop.
    made = seeing(g, track(x=3.5 - 5.0 / 128.0), **exact | {"top_speed_mps": 0.25})
    assert made.pass_on(drive(0.5), T0).reasons == ()
    made = seeing(g, track(x=3.5 - 5.0 / 128.0, speed=0.125), **exact)
    assert made.pass_on(drive(0.5), T0).reasons == ()
    crawls = exact | {"top_speed_mps": 0.5, "crawl": 0.25}
    made = seeing(g, track(x=3.5 - 5.0 / 128.0), **crawls)
    assert made.pass_on(drive(0.75), T0).reasons == ("crawl",)


@claim
def it_stops_for_the_speed_that_it_has(g):
    fast = 0.4 * 0.15 + 0.4**2 / 2.0
    for inside, reasons in ((-0.0001, ("fence",)), (0.0001, ())):
        made = seeing(g, track(x=2.72 - fast - inside, speed=0.4))
        assert made.pass_on(drive(0.1), T0).reasons == reasons
        made = seeing(g, track(x=2.72 - fast - inside, speed=0.4))
        passed = made.pass_on(drive(0.0), T0)
        assert (passed.throttle, passed.brake, passed.reasons) == (0.0, bool(reasons), reasons)
        made = seeing(g, track(x=0.12 + fast + inside, speed=-0.4))
        assert made.pass_on(drive(0.1), T0).reasons == reasons
        made = seeing(g, track(x=2.72 - fast - inside, speed=0.4))
        assert made.pass_on(drive(-0.1), T0).reasons == reasons
    assert seeing(g, track(x=2.71, speed=-0.4)).pass_on(drive(0.0), T0).reasons == ()
    assert seeing(g, track(x=2.71, speed=-0.4)).pass_on(drive(-0.5), T0).reasons == ()


@claim
def it_knows_that_the_car_has_moved_since_it_was_seen(g):
    later = T0 + 100 * NS_PER_MS
    stop = 0.4 * 0.15 + 0.4**2 / 2.0
    for inside, reasons in ((-0.0001, ("fence",)), (0.0001, ())):
        made = seeing(g, track(x=2.72 - stop - 0.04 - inside, speed=0.4))
        assert made.pass_on(drive(0.1), later).reasons == reasons
        made = seeing(g, track(T0 - NS_PER_S))
        late = track(T0 - NS_PER_S + STEP, x=2.72 - stop - 0.04 - inside, speed=0.4)
        made.see(late, T0 + STEP + 100 * NS_PER_MS)
        assert made.pass_on(drive(0.1), T0 + STEP + 100 * NS_PER_MS).reasons == reasons


@claim
def near_the_fence_it_may_crawl(g):
    assert seeing(g, track(x=2.69)).pass_on(drive(1.0), T0) == g.Passed(
        0.35, 0.0, False, ("crawl",)
    )
    passed = seeing(g, track(x=0.15)).pass_on(drive(-1.0), T0)
    assert passed == g.Passed(-0.35, 0.0, False, ("crawl",))
    assert seeing(g, track(x=2.71)).pass_on(drive(1.0), T0).reasons == ("fence",)


@claim
def the_path_bends_as_the_wish_steers(g):
    # 0.61 m: straight on it would leave, at full steering it would end looking back.
    pose = {"x": 2.4, "y": 0.75}
    still = {"crawl": 0.0, "reaction_s": 4.0}
    assert seeing(g, track(**pose), **still).pass_on(drive(0.5), T0).reasons == ("fence",)
    assert seeing(g, track(**pose), **still).pass_on(drive(0.5, 1.0), T0).reasons == ()
    assert seeing(g, track(**pose), **still).pass_on(drive(0.5, -1.0), T0).reasons == ()
    # Up beside the upper fence it may only turn away from it: its front swings.
    beside = {"x": 1.5, "y": 1.35}
    assert seeing(g, track(**beside), crawl=0.0).pass_on(drive(0.5, 1.0), T0).reasons == ("fence",)
    assert seeing(g, track(**beside), crawl=0.0).pass_on(drive(0.5, -1.0), T0).reasons == ()
    # A half circle to the left of radius 0.25 ends 0.5 higher and looks back.
    half = {"curvature_per_m": 4.0, "reaction_s": math.pi / 4 / 0.3, "decel_mps2": 1e9}
    for y, reasons in ((0.8624, ()), (0.8626, ("fence",))):
        made = seeing(g, track(y=y), crawl=0.0, **half)
        assert made.pass_on(drive(1.0, 1.0), T0).reasons == reasons
    for x, reasons in ((0.2801, ()), (0.2799, ("fence",))):
        made = seeing(g, track(x=x, speed=0.3), crawl=0.0, **half)
        assert made.pass_on(drive(0.0, 1.0), T0).reasons == reasons


@claim
def a_car_that_brakes_less_is_stopped_earlier_and_never_later_than_given(g):
    near, nearer = track(x=2.4), track(x=2.65)
    for assumed, reasons in (([], ()), ([0.05], ("fence",)), ([2.0], ()), ([0.05, None], ())):
        made = seeing(g, near, crawl=0.0)
        for decel_mps2 in assumed:
            made.assume_decel(decel_mps2)
        assert made.pass_on(drive(1.0), T0).reasons == reasons
    assert seeing(g, nearer, crawl=0.0, decel_mps2=5.0).pass_on(drive(1.0), T0).reasons == ()
    made = seeing(g, nearer, crawl=0.0)
    made.assume_decel(5.0)
    assert made.pass_on(drive(1.0), T0).reasons == ("fence",)


@claim
def outside_it_may_only_crawl_back_in(g):
    for x, yaw, back in ((2.9, 0.0, -1.0), (2.9, math.pi, 1.0), (0.0, 0.0, 1.0)):
        made = seeing(g, track(x=x, yaw=yaw))
        assert made.pass_on(drive(back), T0) == g.Passed(0.35 * back, 0.0, False, ("crawl",))
        made = seeing(g, track(x=x, yaw=yaw))
        assert made.pass_on(drive(0.2 * back), T0) == g.Passed(0.2 * back, 0.0, False, ("crawl",))
        made = seeing(g, track(x=x, yaw=yaw))
        assert made.pass_on(drive(-0.2 * back), T0) == g.Passed(0.0, 0.0, True, ("fence",))
        assert made.pass_on(drive(0.0), T0) == g.Passed(0.0, 0.0, True, ("fence",))


@claim
def what_still_rolls_out_must_rest_before_it_crawls_back(g):
    for speed, reasons in ((0.021, ("fence",)), (0.019, ("crawl",)), (-0.1, ("crawl",))):
        made = seeing(g, track(x=2.9, speed=speed))
        assert made.pass_on(drive(-1.0), T0).reasons == reasons
        made = seeing(g, track(x=0.0, speed=-speed))
        assert made.pass_on(drive(1.0), T0).reasons == reasons
    assert g.STANDSTILL_MPS == 0.02
    made = seeing(g, track(x=2.9, speed=0.02), crawl=1.0)
    assert made.pass_on(drive(-1.0), T0).reasons == ("crawl",)


@claim
def a_crawl_that_ends_no_less_far_out_does_not_pass(g):
    made = seeing(g, track(x=1.5, y=1.46), crawl=1.0, top_speed_mps=0.0)
    assert made.pass_on(drive(1.0), T0).reasons == ("fence",)
    made = seeing(g, track(x=1.5, y=1.46))
    assert made.pass_on(drive(1.0), T0).reasons == ("fence",)


@claim
def reasons_stand_in_the_order_of_the_checks(g):
    made = seeing(g, track(x=2.9), throttle=0.4, throttle_slew_per_s=1.0)
    assert made.pass_on(drive(-0.5), T0).reasons == ("limit", "slew", "crawl")
    assert made.pass_on(drive(math.nan, 0.0, "hold"), T0).reasons == ("value", "age", "fence")


@claim
def it_counts_how_often_each_limit_began_to_bite(g):
    made = seeing(g, throttle=0.4)
    assert made.summary == "pose 1"
    for i, throttle in enumerate((0.5, 0.5, 0.1, 0.5, math.nan, math.nan, 0.5)):
        made.pass_on(drive(throttle), T0 + i * STEP)
    assert made.counts == Counter(pose=1, limit=3, value=1)
    assert made.summary == "limit 3, pose 1, value 1"
    assert g.RealGuard(limits(g)).summary == ""
