"""The guard: fencing, dead-man, limits, city stop."""

import math

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from scm.clock import NS_PER_MS
from scm.v2x.messages.drive_command import DriveCommand
from scm.vehicles.guard import Guard

START_NS = 10**12


def command(epoch=1, seq=1, throttle=0.5, steering=0.25):
    return DriveCommand(
        vehicle="n7", t_ns=0, epoch=epoch, seq=seq, throttle=throttle, steering=steering
    )


def at(age_ms):
    return START_NS + round(age_ms * NS_PER_MS)


@pytest.fixture
def guard():
    made = Guard()
    assert made.accept(command(), START_NS)
    return made


def test_a_new_guard_stops_until_its_first_command():
    output = Guard().output(START_NS)
    assert (output.throttle, output.steering, output.mode, output.hazard) == (0, 0, "stop", False)


def test_a_fresh_command_passes_unchanged(guard):
    output = guard.output(START_NS)
    assert (output.throttle, output.steering, output.mode) == (0.5, 0.25, "drive")
    assert not output.brake


@pytest.mark.parametrize(
    ("age_ms", "mode", "throttle", "hazard"),
    [
        (0, "drive", 0.5, False),
        (149, "drive", 0.5, False),
        (150 - 1e-6, "drive", 0.5, False),
        (150, "hold", 0.0, False),
        (151, "hold", 0.0, False),
        (299, "hold", 0.0, False),
        (300, "stop", 0.0, False),
        (301, "stop", 0.0, False),
        (999, "stop", 0.0, False),
        (1000 - 1e-6, "stop", 0.0, False),
        (1000, "lost", 0.0, True),
        (1001, "lost", 0.0, True),
        (3_600_000, "lost", 0.0, True),
    ],
)
def test_silence_holds_then_stops_then_loses_the_lease(guard, age_ms, mode, throttle, hazard):
    output = guard.output(at(age_ms))
    assert (output.mode, output.throttle, output.hazard) == (mode, throttle, hazard)
    assert output.steering == 0.25
    assert output.brake == (mode in ("stop", "lost"))


@pytest.mark.parametrize("age_ms", [150, 299, 300, 999])
def test_a_command_before_the_loss_drives_again(guard, age_ms):
    assert guard.accept(command(seq=2), at(age_ms))
    assert guard.output(at(age_ms)).mode == "drive"


@pytest.mark.parametrize("age_ms", [1000, 5000])
def test_a_lost_car_refuses_its_old_epoch_without_a_call_in_between(guard, age_ms):
    assert not guard.accept(command(seq=2), at(age_ms))
    assert guard.lost
    assert guard.output(at(age_ms)).mode == "lost"


def test_a_lost_car_obeys_a_newer_epoch(guard):
    guard.output(at(2000))
    assert guard.accept(command(epoch=2), at(2000))
    assert guard.output(at(2000)).mode == "drive"


def test_an_older_epoch_is_refused_and_counted(guard):
    guard.accept(command(epoch=5, seq=1), START_NS)
    assert not guard.accept(command(epoch=4, seq=9), START_NS)
    assert guard.refused == 1
    assert guard.epoch == 5


@pytest.mark.parametrize(("seq", "accepted"), [(0, False), (1, False), (2, True), (9, True)])
def test_a_repeated_or_older_sequence_number_is_refused(guard, seq, accepted):
    assert guard.accept(command(seq=seq), START_NS) is accepted


def test_a_newer_epoch_counts_its_own_sequence(guard):
    guard.accept(command(seq=100), START_NS)
    assert guard.accept(command(epoch=2, seq=0), START_NS)


def test_refused_commands_do_not_keep_a_car_alive(guard):
    for age_ms in range(0, 1000, 50):
        guard.accept(command(seq=1, throttle=1.0), at(age_ms))
    assert guard.output(at(1000)).mode == "lost"


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["throttle", "steering"])
def test_a_command_that_is_no_number_is_refused(guard, bad, field):
    assert not guard.accept(command(seq=2, **{field: bad}), START_NS)
    assert guard.output(START_NS).throttle == 0.5


@pytest.mark.parametrize(("wished", "given"), [(7.0, 1.0), (-7.0, -1.0), (1.0, 1.0), (-0.3, -0.3)])
def test_commands_are_limited(guard, wished, given):
    guard.accept(command(seq=2, throttle=wished, steering=-wished), START_NS)
    output = guard.output(START_NS)
    assert (output.throttle, output.steering) == (given, -given)


def test_the_city_stop_wins_over_a_fresh_command(guard):
    guard.stop(engaged=True)
    output = guard.output(START_NS)
    assert (output.throttle, output.steering, output.mode) == (0.0, 0.25, "stop")
    guard.stop(engaged=False)
    assert guard.output(START_NS).mode == "drive"


def test_the_city_stop_does_not_hide_a_loss(guard):
    guard.stop(engaged=True)
    assert guard.output(at(1000)).mode == "lost"


def test_a_granted_epoch_fences_before_its_first_command(guard):
    assert guard.set_epoch(2, at(10))
    assert not guard.accept(command(epoch=1, seq=2), at(20))
    output = guard.output(at(20))
    assert (output.mode, output.throttle, output.steering) == ("hold", 0.0, 0.25)
    assert guard.accept(command(epoch=2, seq=0), at(30))
    assert guard.output(at(30)).mode == "drive"


def test_the_new_holders_time_counts_from_the_grant(guard):
    guard.set_epoch(2, at(500))
    assert guard.output(at(700)).mode == "hold"


@pytest.mark.parametrize("epoch", [0, 1])
def test_an_epoch_that_is_not_newer_changes_nothing(guard, epoch):
    assert not guard.set_epoch(epoch, at(10))
    assert guard.output(at(10)).mode == "drive"


def test_a_granted_epoch_ends_a_loss_but_does_not_drive(guard):
    guard.output(at(1500))
    guard.set_epoch(2, at(1500))
    assert guard.output(at(1500)).mode == "hold"
    assert guard.output(at(1800)).mode == "stop"
    assert guard.output(at(2500)).mode == "lost"


def test_the_age_of_the_newest_command_is_known_after_the_first(guard):
    assert Guard().command_age_ns(START_NS) is None
    assert guard.command_age_ns(at(80)) == 80 * NS_PER_MS
    guard.accept(command(seq=1, throttle=0.1), at(90))
    assert guard.command_age_ns(at(100)) == 100 * NS_PER_MS, "a refused one is none"
    guard.set_epoch(9, at(110))
    assert guard.command_age_ns(at(120)) is None, "the new holder has said nothing"


def test_a_clock_that_steps_back_never_makes_a_command_younger(guard):
    guard.output(at(900))
    guard.output(at(100))
    assert guard.output(at(100)).mode == "stop"
    assert guard.accept(command(seq=2), at(100))
    assert guard.output(at(1900)).mode == "lost"


class GuardMachine(RuleBasedStateMachine):
    """Anybody may send anything at any time: the guard keeps its promises."""

    def __init__(self):
        super().__init__()
        self.guard = Guard()
        self.now_ns = START_NS
        self.accepted_ns = None
        self.highest = 0
        self.lost_epoch = None

    @rule(wait_ms=st.integers(0, 1200))
    def wait(self, wait_ms):
        self.now_ns += wait_ms * NS_PER_MS

    @rule(
        epoch=st.integers(0, 6),
        seq=st.integers(0, 6),
        throttle=st.floats(),
        steering=st.floats(),
    )
    def send(self, epoch, seq, throttle, steering):
        self.note_loss()
        if self.guard.accept(command(epoch, seq, throttle, steering), self.now_ns):
            assert epoch >= self.highest
            assert self.lost_epoch is None or epoch > self.lost_epoch
            assert math.isfinite(throttle)
            assert math.isfinite(steering)
            self.highest, self.accepted_ns, self.lost_epoch = epoch, self.now_ns, None

    @rule(epoch=st.integers(0, 6))
    def grant(self, epoch):
        self.note_loss()
        if self.guard.set_epoch(epoch, self.now_ns):
            assert epoch > self.highest
            self.highest, self.accepted_ns, self.lost_epoch = epoch, self.now_ns, None

    @rule(engaged=st.booleans())
    def stop(self, engaged):
        self.guard.stop(engaged)

    @precondition(lambda self: self.accepted_ns is not None)
    @rule()
    def silence_ends_in_a_stop(self):
        self.now_ns += 1000 * NS_PER_MS
        self.note_loss()
        output = self.guard.output(self.now_ns)
        assert output.mode == "lost"
        assert output.throttle == 0.0

    @invariant()
    def the_output_keeps_its_limits(self):
        output = self.guard.output(self.now_ns)
        assert -1.0 <= output.throttle <= 1.0
        assert -1.0 <= output.steering <= 1.0
        assert output.mode == "drive" or output.throttle == 0.0
        assert output.hazard == (output.mode == "lost")

    @invariant()
    def nobody_drives_on_an_old_command(self):
        self.note_loss()
        if self.accepted_ns is None or self.now_ns - self.accepted_ns >= 150 * NS_PER_MS:
            assert self.guard.output(self.now_ns).mode != "drive"

    def note_loss(self):
        silent = self.accepted_ns is not None and self.now_ns - self.accepted_ns >= 10**9
        if silent:
            self.lost_epoch = self.highest


GuardMachine.TestCase.settings = settings(max_examples=60, stateful_step_count=40)
test_whatever_arrives_the_guard_keeps_its_promises = GuardMachine.TestCase
