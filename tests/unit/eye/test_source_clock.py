"""A camera's time stamps on our clock, checks of a frame's content, and what is said of both."""

import numpy as np
import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.eye.sources.camera_clock import CameraClock
from scm.eye.sources.capture import Grabbed
from scm.eye.sources.frame_monitor import FrameCheck, FrameMonitor

FRAME_NS = NS_PER_S // 30
OFFSET_NS = 1_234_567 * NS_PER_S
RNG_SEED = 4


def run(clock, count, drift=0.0, jitter_ms=8.0, start=0, stamps_from=0, seed=RNG_SEED):
    """Return (true, mapped) times of frames that come at least 5 ms late on a camera of `drift`."""
    delays = 5.0 + np.random.default_rng(seed).exponential(jitter_ms, count)
    true, mapped = [], []
    for i, delay_ms in enumerate(delays):
        exposed_ns = OFFSET_NS + (start + i) * FRAME_NS
        stamp_ns = stamps_from + round((start + i) * FRAME_NS * (1.0 - drift))
        true.append(exposed_ns)
        mapped.append(clock.exposed(stamp_ns, exposed_ns + round(delay_ms * NS_PER_MS)))
    return np.array(true), np.array(mapped)


def test_jitter_of_the_way_is_taken_out_and_the_least_delay_stays():
    true, mapped = run(CameraClock(), 300)
    late_ms = (mapped - true)[60:] / NS_PER_MS
    # 8 ms of jitter would be the spread of the arrivals; 5 ms is the delay that nobody can see
    assert np.std(late_ms) < 0.2
    assert np.mean(late_ms) == pytest.approx(5.0, abs=0.3)


def test_a_drifting_clock_is_followed_and_its_drift_known():
    clock = CameraClock()
    true, mapped = run(clock, 30 * 240, drift=80e-6)
    assert clock.drift == pytest.approx(80e-6, abs=8e-6)
    late_ms = (mapped - true)[30 * 120 :] / NS_PER_MS
    # not followed, 30 s at 80 ppm would leave 2.4 ms
    assert np.abs(late_ms - 5.0).max() < 0.8
    assert clock.problem(int(mapped[-1])) == []


def test_a_clock_that_runs_oddly_fast_is_said():
    clock = CameraClock()
    _, mapped = run(clock, 30 * 90, drift=-600e-6)
    (said,) = clock.problem(int(mapped[-1]))
    assert said.startswith("the camera's clock runs ")
    assert said.endswith(" ppm fast")


def test_a_mapped_time_is_never_after_the_arrival():
    clock = CameraClock()
    rng = np.random.default_rng(1)
    for i in range(3000):
        arrival_ns = OFFSET_NS + i * FRAME_NS + int(rng.integers(0, 9 * NS_PER_MS))
        assert clock.exposed(1 + i * FRAME_NS, arrival_ns) <= arrival_ns


def test_the_same_stamp_is_the_same_frame():
    clock = CameraClock()
    assert clock.exposed(5, 100) == 100
    assert clock.exposed(5, 120) is None


@pytest.mark.parametrize(
    ("jump_s", "said"),
    [(-20.0, "the camera's clock went back by 20 s"), (9.0, "clock jumped ahead by 9.0")],
)
def test_a_clock_that_jumps_is_said_and_survived(jump_s, said):
    clock = CameraClock()
    base_ns = 100 * NS_PER_S
    _, before = run(clock, 90, stamps_from=base_ns)
    jump_ns = base_ns + round(jump_s * NS_PER_S)
    true, after = run(clock, 90, start=90, stamps_from=jump_ns, seed=5)
    assert after[0] > before[-1]
    assert np.all(np.diff(after) > 0)
    assert np.abs((after - true) / NS_PER_MS).max() < 60.0
    fresh = CameraClock()
    run(fresh, 90, stamps_from=base_ns)
    fresh.exposed(90 * FRAME_NS + jump_ns, int(true[0]))
    (text,) = fresh.problem(int(true[0]))
    assert said in text
    assert fresh.problem(int(true[0]) + 3 * NS_PER_S) == []


def test_frames_from_a_queue_keep_their_old_times_and_are_said_to_be_late():
    clock = CameraClock()
    true, _ = run(clock, 90)
    arrival_ns = int(true[-1]) + 2 * NS_PER_S
    mapped = clock.exposed(90 * FRAME_NS, arrival_ns)
    assert mapped == pytest.approx(int(true[-1]) + FRAME_NS, abs=10 * NS_PER_MS)
    assert clock.problem(arrival_ns) == ["frames come 2.0 s later than the quickest"]


def noisy(seed=0, grey=100, shape=(480, 640, 3)):
    return np.random.default_rng(seed).integers(grey - 20, grey + 20, shape, dtype=np.uint8)


@pytest.mark.parametrize(
    ("image", "said"),
    [
        (np.full((480, 640, 3), 6, np.uint8), "frames are black"),
        (np.full((480, 640), 6, np.uint8), "frames are black"),
        (np.full((480, 640, 3), 255, np.uint8), "frames are overexposed: 100 % of the picture"),
        (np.full((480, 640, 3), 128, np.uint8), "frames are one flat grey of 128"),
        (noisy(), None),
    ],
)
def test_frames_without_anything_to_see_are_said(image, said):
    found = FrameCheck().look(image, 0)
    assert found is None if said is None else found.startswith(said)


def test_a_dark_room_with_a_tag_in_it_is_not_black():
    image = np.full((480, 640, 3), 5, np.uint8)
    image[200:280, 300:380] = noisy(shape=(80, 80, 3))
    assert FrameCheck().look(image, 0) is None


def test_the_same_picture_for_a_second_is_frozen_until_it_changes():
    check = FrameCheck()
    said = [check.look(noisy(), t) for t in (0, NS_PER_S, NS_PER_S + NS_PER_S // 2)]
    assert said == [None, None, "frames are frozen: the same picture for 1.5 s"]
    assert check.look(noisy(1), 2 * NS_PER_S) is None


def test_a_frame_of_another_size_is_left_out_and_said_until_the_first_size_is_back():
    monitor = FrameMonitor()
    assert monitor.accept(Grabbed(noisy()), 0).stamped == "arrived"
    assert monitor.accept(Grabbed(noisy(shape=(240, 320, 3))), 10) is None
    assert monitor.problem(10) == "size changed from 640 x 480 to 320 x 240 px: frames left out"
    assert monitor.accept(Grabbed(noisy(1)), 20).t_ns == 20
    assert monitor.problem(20) is None
    assert (monitor.tally.good, monitor.tally.resized) == (2, 1)


def test_a_known_age_counts_more_than_a_stamp_and_one_that_cannot_be_does_not():
    frame = FrameMonitor().accept(Grabbed(noisy(), stamp_ns=7, age_ns=40), 1000)
    assert (frame.t_ns, frame.stamped) == (960, "exposed")
    frame = FrameMonitor().accept(Grabbed(noisy(), stamp_ns=7, age_ns=-40), 1000)
    assert (frame.t_ns, frame.stamped) == (1000, "exposed")


def test_the_least_delay_is_taken_off_where_stamps_cannot_tell_it():
    monitor = FrameMonitor(delay_ns=30)
    assert monitor.accept(Grabbed(noisy()), 1000).t_ns == 970
    assert monitor.accept(Grabbed(noisy(), stamp_ns=7), 2000).t_ns == 1970
    assert monitor.accept(Grabbed(noisy(), stamp_ns=7, age_ns=5), 3000).t_ns == 2995


def test_silence_is_said_with_its_length():
    monitor = FrameMonitor()
    monitor.begin(0)
    assert monitor.problem(NS_PER_S) is None
    assert monitor.problem(12 * NS_PER_S // 10) == "no frame for 1.2 s"
    monitor.accept(Grabbed(noisy()), 2 * NS_PER_S)
    assert monitor.problem(2 * NS_PER_S) is None
