"""The calibration drive as a part: it waits where it must, and records what passed."""

from scm.clock import NS_PER_MS, NS_PER_S
from scm.v2x.exchange import Incoming
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.eye_pose import EyePose
from tests.unit.calibrate.rig import LIMITS, START, STEP_NS, T0, Eye, Hidden, HiddenBody, drive
from tests.unit.test_real_guard import track
from vehicle_agent.body import Obeyed
from vehicle_agent.calibrate.part import CalibrationPart
from vehicle_agent.calibrate.pattern import SHORT


class Wheels:
    wants_eye = False

    def __init__(self):
        self.summary = []

    def was_lifted(self):
        return False

    def inhibit_reason(self, now_ns):
        return ""

    def obeyed(self):
        return None

    def advance(self, now_ns):
        pass

    def command(self, throttle, steering):
        self.summary.append((throttle, steering))


def stepped(part, count, first=0, more=()):
    """Step with a pose every time, and `more` before the first; return what was sent."""
    sent = []
    for i in range(first, first + count):
        now_ns = T0 + i * STEP_NS
        inbox = [Incoming(track(now_ns, START.x, START.y), now_ns)]
        if i == first:
            inbox += [Incoming(message, now_ns) for message in more]
        sent += part.step(now_ns, inbox)
    return sent


def test_without_a_pose_it_stands_and_records_nothing():
    wheels = Wheels()
    part = CalibrationPart("n7", wheels, LIMITS)
    sent = [each for i in range(200) for each in part.step(T0 + i * STEP_NS, [])]
    assert set(wheels.summary) == {(0.0, 0.0)}
    assert part.recorded.command == []
    assert not part.done.is_set()
    assert sent[-1].detail == "calibrates: waits (pose); held up: pose 1"


def test_the_city_wide_stop_holds_it_and_it_goes_on_afterwards():
    wheels = Wheels()
    part = CalibrationPart("n7", wheels, LIMITS)
    stepped(part, 60)
    assert wheels.summary[-1][0] != 0.0
    sent = stepped(part, 200, 60, [CityStop(t_ns=0, engaged=True)])
    assert {throttle for throttle, _ in wheels.summary[60:]} == {0.0}
    assert sent[-1].detail.startswith("calibrates: waits (stop)")
    before = part._pattern.progress
    stepped(part, 30, 260, [CityStop(t_ns=0, engaged=False)])
    assert wheels.summary[-1][0] != 0.0
    assert part._pattern.progress == before


def test_beyond_the_floor_it_waits_until_it_is_put_inside():
    wheels, said = Wheels(), []
    part = CalibrationPart("n7", wheels, LIMITS, on_progress=said.append)
    for i in range(100):
        now_ns = T0 + i * STEP_NS
        part.step(now_ns, [Incoming(track(now_ns, 1.9, 0.7), now_ns)])
    assert {throttle for throttle, _ in wheels.summary} == {0.0}
    assert said[-1] == "waits (outside the floor)"
    stepped(part, 60, 100)
    assert wheels.summary[-1][0] != 0.0
    assert said[-1] == "3 % driven"


def test_what_is_recorded_is_what_passed_the_guard():
    wheels = Wheels()
    part = CalibrationPart("n7", wheels, LIMITS)
    stepped(part, 100)
    assert [row[1:] for row in part.recorded.command] == wheels.summary
    assert [row[0] for row in part.recorded.command[:3]] == [0.0, 0.02, 0.04]


class Slow(Wheels):
    """Wheels whose line takes a while and tells of several at once."""

    def obeyed(self):
        return [Obeyed(T0 + ms * NS_PER_MS, 0.1, 0.2) for ms in (7, 31, 29)]


def test_what_left_for_the_actuators_is_recorded_when_it_did_and_never_back_in_time():
    part = CalibrationPart("n7", Slow(), LIMITS)
    part.step(T0, [Incoming(track(T0), T0)])
    assert part.recorded.command == [(0.007, 0.1, 0.2), (0.031, 0.1, 0.2)]


def test_a_pose_that_is_stale_or_told_twice_is_not_recorded():
    part = CalibrationPart("n7", Wheels(), LIMITS)
    inbox = [track(T0), track(T0), track(T0 + 1, stale=True), track(T0 + NS_PER_MS)]
    part.step(T0, [Incoming(message, T0) for message in inbox])
    assert [row[0] for row in part.recorded.pose] == [0.0, 0.001]


def sighting(t_ns, x_m, flags=()):
    return EyePose(camera="top", vehicle="n7", tag_id=1, t_ns=t_ns, x_m=x_m, y_m=0.7, yaw_rad=0.0,
                   covariance=(1e-6,) * 9, flags=flags)  # fmt: skip


def test_what_a_camera_saw_itself_is_recorded_in_place_of_smoothed_tracks():
    part = CalibrationPart("n7", Wheels(), LIMITS)
    inbox = [
        track(T0, 1.0), sighting(T0, 0.99), track(T0 + NS_PER_MS, 1.1),
        sighting(T0 + 2 * NS_PER_MS, 0.98, ("moved",)), sighting(T0 + 3 * NS_PER_MS, 0.97),
    ]  # fmt: skip
    part.step(T0, [Incoming(message, T0) for message in inbox])
    assert [row[:2] for row in part.recorded.pose] == [(0.0, 0.99), (0.003, 0.97)]


def test_it_ends_at_rest():
    wheels = Wheels()
    part = CalibrationPart("n7", wheels, LIMITS)
    stepped(part, 100)
    part.finish(T0 + NS_PER_S)
    assert wheels.summary[-1] == (0.0, 0.0)


def test_an_eye_that_is_blind_for_a_while_holds_it_up_for_as_long():
    hidden = Hidden()
    took = {}
    for blind in ((), (10, 11, 12)):
        body = HiddenBody(hidden, START)
        part = CalibrationPart("n7", body, LIMITS, plan=SHORT)
        took[blind], farthest = drive(part, body, Eye(hidden), LIMITS, blind)
        assert farthest < 0.0
    assert 2.6 < took[10, 11, 12] - took[()] < 3.2  # a leg, of 1 s, that went on would end early
    assert part.guard.counts["pose"] == 2
