"""A live camera is read in a thread that nothing can kill but `close`, which always does.

Time is the camera's: it moves with each frame, and with nothing else.
"""

import threading
import time
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scm.clock import NS_PER_MS, NS_PER_S, StepClock
from scm.errors import EyeError
from scm.eye.sources.capture import DamagedFrameError, Grabbed
from scm.eye.sources.live import LiveSource

PAUSES_S = (0.001, 0.004)
DEADLINE_S, STALL_S = 20.0, 60.0
FRAME_NS = 33 * NS_PER_MS


def picture(number, shape=(48, 64, 3)):
    return np.random.default_rng(number).integers(40, 200, shape, dtype=np.uint8)


class FakeCamera:
    """Does what a script says: one list of events for each time that it is opened.

    An event is how long ago a frame was exposed on a clock of its own [ms], or a word.
    """

    def __init__(self, *scripts):
        self.clock = StepClock()
        self.scripts = list(scripts)
        self.opened = 0
        self.closed = 0
        self.stopped = threading.Event()
        self.may_send = threading.Event()
        self.may_send.set()
        self.count = 0

    def open(self):
        self.opened += 1
        self.stopped.clear()
        self.events = iter(self.scripts.pop(0) if self.scripts else ["stall"])
        self.event = next(self.events, "gone")
        if self.event == "absent":
            raise EyeError("not there")
        if self.event == "odd":
            raise MemoryError
        return self

    def wait(self):
        if self.event == "stall":
            self.stopped.wait(STALL_S)
            raise EyeError("interrupted")
        if self.event == "gone":
            raise EyeError("it delivers no more frames")
        assert self.may_send.wait(DEADLINE_S)
        time.sleep(0.0005)  # who takes frames has a chance to
        self.later(FRAME_NS)

    def later(self, span_ns):
        self.clock.set_ns(self.clock.now_ns() + span_ns)

    def fetch(self):
        event, self.event = self.event, next(self.events, "gone")
        self.count += 1
        if event == "damaged":
            raise DamagedFrameError("a frame: JPEG cut short")
        if event == "crash":
            raise RuntimeError("driver")
        if event == "small":
            return Grabbed(picture(self.count, (24, 32, 3)))
        if event == "unstamped":
            return Grabbed(picture(self.count))
        stamp_ns = 77 * NS_PER_S + self.count * FRAME_NS - round(event * NS_PER_MS)
        return Grabbed(picture(self.count), stamp_ns)

    def interrupt(self):
        self.stopped.set()

    def close(self):
        self.closed += 1


def left():
    return [thread for thread in threading.enumerate() if thread.name.startswith("frames of")]


@pytest.fixture
def live():
    """Make live sources of fake cameras; every thread must have ended after the test."""
    made = []

    def make(camera, pauses_s=PAUSES_S):
        made.append(LiveSource("fake", camera.open, clock=camera.clock, pauses_s=pauses_s))
        return made[-1]

    yield make
    for source in made:
        source.close()
    until_none_is_left()


def read(source, ahead_ns=0):
    return source.read(source._clock.now_ns() + ahead_ns, None)


def until(condition, source=None):
    """Wait for a condition; return the frames that were taken meanwhile."""
    frames, ends = [], time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < ends, "waited in vain"
        frame = read(source) if source else None
        if frame is not None:
            frames.append(frame)
        time.sleep(0.001)
    return frames


def until_none_is_left():
    until(lambda: left() == [])


def begin(source, camera, ahead_ns=0):
    """Make the first `read`, which begins all, before the camera sends anything."""
    camera.may_send.clear()
    assert read(source, ahead_ns) is None
    camera.may_send.set()


def test_nothing_is_opened_before_the_first_take(live):
    camera = FakeCamera(["unstamped"])
    source = live(camera)
    assert (camera.opened, source.problem, left()) == (0, None, [])


def test_take_never_waits_for_a_camera_that_stalls_and_close_ends_it(live):
    camera = FakeCamera(["unstamped", "stall"])
    source = live(camera)
    (frame,) = until(lambda: source.tally.good and source._newest is None, source)
    assert frame.stamped == "arrived"
    began_s = time.monotonic()
    assert all(read(source) is None for _ in range(100))
    source.close()
    until_none_is_left()
    assert time.monotonic() - began_s < STALL_S / 2
    assert camera.closed == 1


def test_a_slow_consumer_gets_the_newest_frame_and_the_others_are_counted(live):
    camera = FakeCamera([*["unstamped"] * 9, "stall"])
    source = live(camera)
    begin(source, camera)
    until(lambda: source.tally.good == 9)
    frame = read(source)
    np.testing.assert_array_equal(frame.image, picture(9))
    assert source.tally.passed_over == 8
    assert read(source) is None


def test_a_camera_that_disappears_comes_back_by_itself(live):
    camera = FakeCamera(["unstamped"], ["absent"], ["odd"], ["crash"], ["unstamped", "stall"])
    source = live(camera)
    frames = until(lambda: source.tally.good == 2 and source._newest is None, source)
    assert [frame.t_ns for frame in frames] == sorted(frame.t_ns for frame in frames)
    assert (camera.opened, source.tally.opened, camera.closed) == (5, 3, 2)
    assert source.problem is None


def test_why_there_is_no_camera_is_said_after_its_name(live):
    source = live(FakeCamera(["absent"]), pauses_s=(30.0, 30.0))
    until(lambda: source.problem is not None, source)
    assert source.problem == "fake: cannot open it: not there"


def test_the_pause_doubles_until_its_longest_and_begins_anew_after_a_frame(live):
    source = live(FakeCamera(*[["absent"]] * 5, ["unstamped"], ["absent"]), pauses_s=(0.5, 2.0))
    pauses_s = []

    class Stop(threading.Event):
        def wait(self, timeout=None):
            pauses_s.append(timeout)
            return super().wait(0.001)

    source._stop = Stop()
    until(lambda: len(pauses_s) >= 7, source)
    assert pauses_s[:7] == [0.5, 1.0, 2.0, 2.0, 2.0, 0.5, 1.0]


def test_closing_does_not_wait_for_a_pause(live):
    source = live(FakeCamera(["absent"]), pauses_s=(30.0, 30.0))
    until(lambda: source.problem is not None, source)
    source.close()
    source.close()
    assert read(source) is None
    until_none_is_left()  # well before the pause is over


def test_damaged_frames_are_counted_and_said_for_a_second(live):
    camera = FakeCamera(["unstamped", "damaged", "damaged", "stall"])
    source = live(camera)
    until(lambda: source.tally.damaged == 2, source)
    camera.later(NS_PER_S - 3 * FRAME_NS)
    assert source.problem == "fake: a frame: JPEG cut short (2 damaged so far)"
    camera.later(3 * FRAME_NS)
    assert source.problem == "fake: no frame for 1.1 s"


def test_a_stall_is_said_with_its_length(live):
    camera = FakeCamera(["stall"])
    source = live(camera)
    begin(source, camera)
    camera.later(NS_PER_S)
    assert source.problem is None
    camera.later(NS_PER_S // 4)
    assert source.problem == "fake: no frame for 1.2 s"


def test_frames_are_on_the_callers_clock_whatever_ours_says(live):
    camera = FakeCamera(["unstamped", "stall"])
    source = live(camera)
    ahead_ns = 5000 * NS_PER_S
    begin(source, camera, ahead_ns)
    until(lambda: source.tally.good == 1)
    arrived_ns = source._newest.t_ns
    assert read(source, ahead_ns).t_ns - arrived_ns == ahead_ns


def test_a_caller_that_is_slow_to_call_does_not_move_frames(live):
    camera = FakeCamera(["unstamped", "stall"])
    source = live(camera)
    begin(source, camera)
    until(lambda: source.tally.good == 1)
    arrived_ns = source._newest.t_ns
    camera.later(NS_PER_S // 5)
    assert read(source, -NS_PER_S // 5).t_ns == arrived_ns


EVENTS = st.sampled_from(
    ["unstamped", "damaged", "crash", "small", "gone", "absent", "odd", 0, 5, 66, 900, -900, 33]
)


@settings(max_examples=40)
@given(scripts=st.lists(st.lists(EVENTS, max_size=12), min_size=1, max_size=6))
def test_no_schedule_of_faults_stops_it_or_turns_time_back(scripts):
    camera = FakeCamera(*scripts, ["unstamped", "stall"])
    source = LiveSource("fake", camera.open, clock=camera.clock, pauses_s=PAUSES_S)
    try:
        frames = until(lambda: camera.opened > len(scripts) and camera.event == "stall", source)
        now_ns = camera.clock.now_ns()
        said = source.problem
    finally:
        source.close()
    times = [frame.t_ns for frame in frames]
    assert all(a < b for a, b in pairwise(times))
    assert all(t_ns <= now_ns for t_ns in times)
    assert len({frame.image.shape for frame in frames}) <= 1
    assert said is None or said.startswith("fake: ")
    until_none_is_left()
    assert camera.closed == source.tally.opened
